//! Checks whether each motor moves its own joint, in the correct direction, with torques of the correct size: from short torque
//! ramps on one joint after the other, and from the torque that holds the arm at rest.
//!
//! A ramp needs no position loop on its joint; the position loops hold the other joints. The difference between a
//! ramp up and a ramp down reveals the direction, independent of the gravity that the model lacks.

use super::error::ProcedureError;
use crate::request_sequence::Recording;
use serde::{Deserialize, Serialize};
use supple_core::Vector;

/// Motion of another encoder relative to the motion of the ramped joint, above which the other joint counts as moved. A joint
/// that the ramped joint accelerates may move more: as far as the model predicts for a free joint.
const OTHER_SHARE: f64 = 0.5;
/// Motion of an encoder that counts as motion of its joint: more than the deflection of bristles and cables \[rad\].
const MOVED_RAD: f64 = 0.01;
/// Gravity torque above which the torque at rest reveals the torque scale \[N m\].
const HEAVY_NM: f64 = 4.0;
/// Factor between the holding torque and the model's gravity, above which units differ. First moments with an error of 28 % and
/// motors that give two thirds of the commanded torque cause a factor of 2.1.
const GRAVITY_FACTOR: f64 = 2.3;

/// Result of the wiring check of one joint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointWiring {
    /// Whether the encoder of the joint moved.
    pub moved: bool,
    /// Other joints whose encoders moved.
    pub others: Vec<usize>,
    /// Greatest torque of the ramp \[N m\].
    pub torque_nm: f64,
    /// Angle after the ramp up minus the angle after the ramp down, at the same time \[rad\].
    pub difference_rad: f64,
}

/// Determines which encoders moved in a ramp of `rate_nm_per_s` on a joint. `free_share` returns the distance that each joint
/// would move if it were free, relative to the travel of the ramped joint.
pub fn ramp_result(
    recording: &Recording,
    joint: usize,
    rate_nm_per_s: f64,
    free_share: impl Fn(usize) -> f64,
) -> JointWiring {
    let Some(last) = recording.t_s.len().checked_sub(1) else {
        return JointWiring::default();
    };
    let travel_rad = |joint: usize| {
        let travel_rad = recording.q_rad[(last, joint)] - recording.q_rad[(0, joint)];
        travel_rad.abs()
    };
    let other_rad =
        |other: usize| MOVED_RAD.max(OTHER_SHARE.max(free_share(other)) * travel_rad(joint));
    let all = 0..recording.q_rad.ncols();
    JointWiring {
        moved: travel_rad(joint) > MOVED_RAD,
        others: all
            .filter(|other| *other != joint && travel_rad(*other) > other_rad(*other))
            .collect(),
        torque_nm: rate_nm_per_s.abs() * (recording.t_s[last] - recording.t_s[0]),
        difference_rad: 0.0,
    }
}

/// Returns the angle of a joint in the ramp up minus its angle in the ramp down, at the end of the shorter ramp \[rad\].
pub fn difference_rad(up: &Recording, down: &Recording, joint: usize) -> f64 {
    let rows = up.t_s.len().min(down.t_s.len());
    if rows == 0 {
        return 0.0;
    }
    let travel = |of: &Recording| of.q_rad[(rows - 1, joint)] - of.q_rad[(0, joint)];
    travel(up) - travel(down)
}

fn wrong(problem: String, remedy: &str) -> Result<(), ProcedureError> {
    Err(ProcedureError::Wiring {
        problem,
        remedy: remedy.to_owned(),
    })
}

/// Checks that the result of a ramp agrees with the description; the error names the deviation.
///
/// # Errors
/// [`ProcedureError::Wiring`].
pub fn check_ramp(
    names: &[String],
    joint: usize,
    found: &JointWiring,
) -> Result<(), ProcedureError> {
    let title = |joint: usize| format!("joint {joint} ({})", names[joint]);
    match (found.moved, &found.others[..]) {
        (true, []) => Ok(()),
        (false, []) => wrong(
            format!(
                "{} did not move at {:.2} N m, and no other did",
                title(joint),
                found.torque_nm
            ),
            "check its brake, its stops and its motor, and the unit of its torque (torque constant, N m or A)",
        ),
        (false, [other]) => wrong(
            format!(
                "a torque on {} moves the encoder of {} instead of its own: motors or encoders of both are swapped, or \
                 the latter turns against its torque",
                title(joint),
                title(*other)
            ),
            "correct the order of the motors or encoders in the arm's TOML, or reverse the sign of the latter",
        ),
        (_, others) => {
            let others: Vec<String> = others.iter().map(|other| title(*other)).collect();
            wrong(
                format!(
                    "a torque on {} moves the encoder of {}: motors or encoders are swapped",
                    title(joint),
                    others.join(" and of ")
                ),
                "correct the order of the motors or encoders in the arm's TOML, or their plugs",
            )
        }
    }
}

/// Rejects a joint that moves in the opposite direction.
///
/// # Errors
/// [`ProcedureError::Wiring`].
pub fn check_direction(
    names: &[String],
    joint: usize,
    difference_rad: f64,
) -> Result<(), ProcedureError> {
    if difference_rad > 0.0 {
        return Ok(());
    }
    wrong(
        format!(
            "a positive torque on joint {joint} ({}) turns its encoder backwards, by {:.3} rad",
            names[joint], difference_rad
        ),
        "reverse the sign of its motor or of its encoder in the arm's TOML",
    )
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
        // At rest, dry friction may act in either direction.
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
