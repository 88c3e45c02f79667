//! Whether each motor moves its own joint, in its direction, with torques of the right size: from torque ramps on one
//! joint after the other, and from the torque that holds the arm at rest.
//!
//! A ramp needs no position loop on its joint. The joint whose encoder moves first is the one that the motor moves.

use super::error::ProcedureError;
use crate::request_sequence::Recording;
use serde::{Deserialize, Serialize};
use supple_core::Vector;

/// Motion of an encoder that counts as motion of its joint: more than bristles and cables give \[rad\].
const MOVED_RAD: f64 = 6e-3;
/// Factor between the ramp's torque at the first motion and the model's breakaway torque, above which units differ.
const BREAKAWAY_FACTOR: f64 = 4.0;
/// Gravity torque above which the torque at rest tells the scale \[N m\].
const HEAVY_NM: f64 = 4.0;
/// Factor between the holding torque and the model's gravity, above which units differ.
const GRAVITY_FACTOR: f64 = 1.6;

/// Finding for one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointWiring {
    /// Joint whose encoder moved first; `None` if none moved.
    pub moved: Option<usize>,
    /// Its direction for a positive torque.
    pub positive: bool,
    /// Torque of the ramp at which it moved, or its greatest torque \[N m\].
    pub torque_nm: f64,
}

/// Evaluates a ramp of `rate_nm_per_s`: which encoder moved first, where, and at which torque.
pub fn ramp_result(recording: &Recording, rate_nm_per_s: f64) -> JointWiring {
    let (Some(begin_s), rows) = (recording.t_s.first(), recording.t_s.len()) else {
        return JointWiring {
            moved: None,
            positive: true,
            torque_nm: 0.0,
        };
    };
    let travel =
        |row: usize, joint: usize| recording.q_rad[(row, joint)] - recording.q_rad[(0, joint)];
    let first = (0..rows).find_map(|row| {
        let joints = 0..recording.q_rad.ncols();
        let farthest =
            joints.max_by(|a, b| travel(row, *a).abs().total_cmp(&travel(row, *b).abs()))?;
        (travel(row, farthest).abs() > MOVED_RAD).then_some((row, farthest))
    });
    let row = first.map_or(rows - 1, |(row, _)| row);
    JointWiring {
        moved: first.map(|(_, joint)| joint),
        positive: first.is_none_or(|(row, joint)| {
            travel(row, joint).is_sign_positive() == rate_nm_per_s.is_sign_positive()
        }),
        torque_nm: rate_nm_per_s.abs() * (recording.t_s[row] - begin_s),
    }
}

/// Names the first joint whose ramp does not fit the description.
///
/// # Errors
/// [`ProcedureError::Wiring`].
pub fn check_ramp(
    names: &[String],
    joint: usize,
    found: &JointWiring,
    model_breakaway_nm: f64,
) -> Result<(), ProcedureError> {
    let (name, torque_nm) = (&names[joint], found.torque_nm);
    let wrong = |problem: String, remedy: &str| {
        Err(ProcedureError::Wiring {
            problem,
            remedy: remedy.to_owned(),
        })
    };
    let Some(moved) = found.moved else {
        return wrong(
            format!("joint {joint} ({name}) did not move at {torque_nm:.2} N m, and no other did"),
            "check its brake, its stops and its motor, and the unit of its torque (torque constant, N m or A)",
        );
    };
    if moved != joint {
        let other = &names[moved];
        return wrong(
            format!(
                "a torque on joint {joint} ({name}) moves the encoder of joint {moved} ({other}): motors or encoders \
                 are swapped"
            ),
            "correct the order of the motors or encoders in the arm's TOML, or their plugs",
        );
    }
    if !found.positive {
        return wrong(
            format!("a positive torque on joint {joint} ({name}) turns its encoder backwards"),
            "reverse the sign of its motor or of its encoder in the arm's TOML",
        );
    }
    let factor = torque_nm / model_breakaway_nm.max(1e-3);
    if factor > BREAKAWAY_FACTOR {
        return wrong(
            format!(
                "joint {joint} ({name}) moved at {torque_nm:.2} N m, its model breaks away at {model_breakaway_nm:.2} N m"
            ),
            "check the unit of its torque (torque constant, N m or A, gear ratio), or its friction in the arm's TOML",
        );
    }
    Ok(())
}

/// Compares the mean torque at rest with the gravity of the model.
///
/// # Errors
/// [`ProcedureError::Wiring`].
pub fn check_gravity<const N: usize>(
    names: &[String],
    rest: &Recording,
    gravity_nm: &Vector<N>,
    friction_nm: &Vector<N>,
) -> Result<(), ProcedureError> {
    for joint in 0..N {
        let held_nm = rest.tau_nm.column(joint).mean();
        let model_nm = gravity_nm[joint];
        if model_nm.abs() < HEAVY_NM + friction_nm[joint] {
            continue;
        }
        // Dry friction may act either way at rest.
        let lower_nm = model_nm.abs() / GRAVITY_FACTOR - friction_nm[joint];
        let upper_nm = model_nm.abs() * GRAVITY_FACTOR + friction_nm[joint];
        let along_nm = held_nm * model_nm.signum();
        if !(lower_nm..=upper_nm).contains(&along_nm) {
            return Err(ProcedureError::Wiring {
                problem: format!(
                    "joint {joint} ({}) is held at rest by {held_nm:.1} N m, its model has {model_nm:.1} N m of gravity",
                    names[joint]
                ),
                remedy: "check the unit and the sign of its torque, the mounting of the base (gravity in the arm's \
                         TOML) and the masses"
                    .to_owned(),
            });
        }
    }
    Ok(())
}
