//! Measures the breakaway torque of each joint: ramps its torque in both directions until it has moved by two
//! degrees, while the other joints are held.
//!
//! The torque beyond the model's gravity at which a joint starts to slide is `S_0`. Half the sum of both directions is
//! independent of errors of the gravity model; half the difference is that error. A ramp begins at the torque that held
//! its joint, and its torque includes that holding torque.

use crate::error::ExperimentError;
use crate::excite::{move_to, without_held_joints};
use crate::request_sequence::{Recording, RequestSequence, Step};
use crate::run::joint_label;
use serde::{Deserialize, Serialize};
use supple_core::controller::{Breakaway, Mode, Request};
use supple_core::dynamics::gravity;
use supple_core::{Config, Vector};
use supple_plant::PlantConfig;

/// Slope of the ramp \[N m/s\]; 1e-4 N m a cycle of 1 ms.
pub const RATE_NM_PER_S: f64 = 0.1;
/// Motion at which a ramp stops: two degrees \[rad\].
pub const STOP_RAD: f64 = 0.034_907;
/// Maximum ramp torque; beyond it the joint counts as blocked \[N m\].
const LIMIT_NM: f64 = 6.0;
/// Motion that counts as sliding: more than bristle deflection and encoder resolution \[rad\].
const SLIDING_RAD: f64 = 3.5e-3;
/// Rest between the two directions \[s\].
const REST_S: f64 = 0.3;

/// Breakaway of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointBreakaway {
    /// Torque beyond the model's gravity at which the joint started to slide in the positive direction \[N m\].
    pub positive_nm: f64,
    /// Torque in the negative direction, positive if the torque was negative \[N m\].
    pub negative_nm: f64,
}

impl JointBreakaway {
    /// Returns `S_0` \[N m\].
    pub fn breakaway_nm(&self) -> f64 {
        0.5 * (self.positive_nm + self.negative_nm)
    }

    /// Returns the direction-independent torque: error of the gravity model, or a friction offset \[N m\].
    pub fn offset_nm(&self) -> f64 {
        0.5 * (self.positive_nm - self.negative_nm)
    }
}

/// Ramps each of `joints` in both directions at `pose_rad`; results are in the order of `joints`.
///
/// # Errors
/// [`ExperimentError`]; a joint that does not break away.
pub fn breakaway<const N: usize>(
    config: &Config<N>,
    plant: &PlantConfig<N>,
    pose_rad: &Vector<N>,
    joints: &[usize],
    done: &mut dyn FnMut(usize),
) -> Result<Vec<JointBreakaway>, ExperimentError> {
    let mut found = Vec::new();
    for &joint in joints {
        let torque = |direction: f64| -> Result<f64, ExperimentError> {
            let limit_nm = LIMIT_NM.min(config.limits.joint_torque_nm[joint]);
            let ramp = Breakaway {
                joint,
                rate_nm_per_s: direction * RATE_NM_PER_S,
                stop_rad: STOP_RAD,
                limit_nm,
            };
            let sequence = RequestSequence {
                name: format!("breakaway of {}", joint_label(config, joint)),
                config: without_held_joints(config),
                plant: plant.clone(),
                start_rad: *pose_rad,
                steps: vec![
                    Step::wait(Request::GravityHold, REST_S),
                    move_to(config, pose_rad, pose_rad),
                    Step {
                        until_done: true,
                        ..Step::wait(Request::Breakaway(ramp), limit_nm / RATE_NM_PER_S + REST_S)
                    },
                ],
            };
            // Torque beyond gravity and angle of each cycle.
            let mut trace: Vec<(f64, f64)> = Vec::new();
            sequence.perform(&mut |cycle, _| {
                if cycle.output.mode == Mode::Breakaway {
                    let torques = &cycle.output.torques;
                    let beyond_nm =
                        torques.friction[joint] + torques.joint_pd[joint] + torques.handover[joint];
                    trace.push((beyond_nm, cycle.measurement.position_rad[joint]));
                }
                Ok(())
            })?;
            torque_before_sliding(&trace, direction).ok_or(ExperimentError::Stuck {
                joint: joint_label(config, joint),
                torque_nm: limit_nm,
            })
        };
        found.push(JointBreakaway {
            positive_nm: torque(1.0)?,
            negative_nm: torque(-1.0)?,
        });
        done(joint);
    }
    Ok(found)
}

/// Returns the torque of a ramp beyond the gravity of `config` at which its joint began to slide \[N m\], positive along the
/// ramp's direction, which is 1 or -1; `None` if the joint did not slide. The recording begins with the ramp.
pub(crate) fn sliding_torque_nm<const N: usize>(
    config: &Config<N>,
    recording: &Recording,
    joint: usize,
    direction: f64,
) -> Option<f64> {
    let trace: Vec<(f64, f64)> = (0..recording.t_s.len())
        .map(|k| {
            let angles = recording.q_rad.row(k).transpose();
            let gravity_nm = gravity(&config.arm, &Vector::from_column_slice(angles.as_slice()));
            let beyond_nm = recording.tau_nm[(k, joint)] - gravity_nm[joint];
            (beyond_nm, angles[joint])
        })
        .collect();
    torque_before_sliding(&trace, direction)
}

/// Returns the torque of the last cycle before the joint slid, positive along `direction`.
fn torque_before_sliding(trace: &[(f64, f64)], direction: f64) -> Option<f64> {
    let start = trace.first()?.1;
    let slid = |q: f64| direction * (q - start) > SLIDING_RAD;
    slid(trace.last()?.1).then_some(())?;
    let last = trace.iter().rposition(|(_, q)| !slid(*q))?;
    Some(direction * trace[last].0)
}
