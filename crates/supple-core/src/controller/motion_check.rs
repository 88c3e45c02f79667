//! Checks of a requested motion over its whole length: reach, joint stops, joint speeds, torques
//! and workspace borders. They take some milliseconds and do not run in the control loop.

use super::Controller;
use super::mode::{Refusal, Request};
use super::requests::active_target;
use crate::config::{Config, Role};
use crate::dynamics::inverse_kinematics::inverse_kinematics;
use crate::dynamics::{Terms, terms};
use crate::law::impedance::Task;
use crate::math::{Vector, abs, smooth_step};
use crate::trajectory::{JointReference, Trajectory};

/// Number of sample intervals at which a motion is checked.
const POINTS: u32 = 128;
/// Maximum distance at which a point of a trajectory counts as reached \[m\].
const REACHED_M: f64 = 1e-3;
/// Fraction of the torque limits available to the feed-forward of a motion; the rest is for
/// feedback.
const TORQUE_SHARE: f64 = 0.9;

/// Checks a requested motion from the current pose. Requests without a motion pass.
///
/// # Errors
/// The first [`Refusal`] along the motion.
pub fn check_motion<const N: usize>(
    controller: &Controller<N>,
    position_rad: &Vector<N>,
    request: &Request<N>,
) -> Result<(), Refusal> {
    let config = controller.config();
    match request {
        Request::Track(trajectory) => {
            trajectory.validate().map_err(Refusal::Trajectory)?;
            along_trajectory(config, position_rad, trajectory)
        }
        Request::Move {
            target_rad,
            duration_s,
        } => along_line(config, position_rad, target_rad, *duration_s),
        Request::JointImpedance {
            target_rad,
            duration_s,
        } => {
            let target_rad = active_target(config, position_rad, target_rad);
            along_line(config, position_rad, &target_rad, *duration_s)
        }
        Request::Excite(series) => along(config, series.duration_s, |time_s| series.at(time_s)),
        _ => Ok(()),
    }
}

fn along_line<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
    duration_s: f64,
) -> Result<(), Refusal> {
    let displacement = to_rad - from_rad;
    along(config, duration_s, |time_s| {
        let (x, rate, rate_rate) = smooth_step(time_s / duration_s);
        JointReference {
            position_rad: from_rad + displacement * x,
            velocity_rad_per_s: displacement * (rate / duration_s),
            acceleration_rad_per_s2: displacement * (rate_rate / (duration_s * duration_s)),
        }
    })
}

fn along_trajectory<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    trajectory: &Trajectory,
) -> Result<(), Refusal> {
    let mut seed = *from_rad;
    let length_s = trajectory.length_s();
    for k in 0..=POINTS {
        let time_s = length_s * f64::from(k) / f64::from(POINTS);
        let reference = trajectory.at(time_s);
        if let Some((border, value_m)) = config.workspace.violated_border(&reference.position) {
            return Err(Refusal::Workspace { border, value_m });
        }
        let found = inverse_kinematics(
            &config.arm,
            &config.roles,
            &config.limits,
            &seed,
            &reference.position,
        );
        if found.distance_m > REACHED_M {
            return Err(Refusal::OutOfReach {
                time_s,
                distance_m: found.distance_m,
            });
        }
        seed = found.position_rad;
        let mut state = Terms::default();
        terms(&config.arm, &seed, &Vector::zeros(), &mut state);
        let Some(task) = Task::new(&state, &config.roles) else {
            continue;
        };
        let velocity = task.inverse * reference.velocity;
        terms(&config.arm, &seed, &velocity, &mut state);
        let bias = state.jacobian_dot_qd.fixed_rows::<3>(0);
        let acceleration = task.inverse * (reference.acceleration - bias);
        joints(config, &state, &velocity, &acceleration)?;
    }
    Ok(())
}

fn along<const N: usize>(
    config: &Config<N>,
    length_s: f64,
    at: impl Fn(f64) -> JointReference<N>,
) -> Result<(), Refusal> {
    let mut state = Terms::default();
    for k in 0..=POINTS {
        let reference = at(length_s * f64::from(k) / f64::from(POINTS));
        let (q, qd) = (reference.position_rad, reference.velocity_rad_per_s);
        terms(&config.arm, &q, &qd, &mut state);
        let tip = state.base_from_tip.translation;
        if k > 0
            && let Some((border, value_m)) = config.workspace.violated_border(&tip)
        {
            return Err(Refusal::Workspace { border, value_m });
        }
        let tip_velocity = state.jacobian.fixed_rows::<3>(0) * qd;
        let (value, limit) = (tip_velocity.norm(), config.limits.tip_speed_m_per_s);
        if value > limit {
            return Err(Refusal::Value {
                entry: "peak tip speed of the motion [m/s]",
                value,
                limit,
            });
        }
        joints(config, &state, &qd, &reference.acceleration_rad_per_s2)?;
    }
    Ok(())
}

/// Checks joint speeds and torques at one point of the motion.
fn joints<const N: usize>(
    config: &Config<N>,
    state: &Terms<N>,
    velocity: &Vector<N>,
    acceleration: &Vector<N>,
) -> Result<(), Refusal> {
    let torque = state.coriolis_gravity + state.mass_matrix * acceleration;
    for joint in 0..N {
        let limit_rad_per_s = config.limits.joint_speed_rad_per_s[joint];
        let value_rad_per_s = abs(velocity[joint]);
        if value_rad_per_s > limit_rad_per_s {
            return Err(Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
        if config.roles[joint] != Role::Active && velocity[joint] == 0.0 {
            continue;
        }
        let friction = config.friction[joint].torque_nm(velocity[joint]);
        let limit_nm = TORQUE_SHARE * config.limits.joint_torque_nm[joint];
        let value_nm = abs(torque[joint] + friction);
        if value_nm > limit_nm {
            return Err(Refusal::TooMuchTorque {
                joint,
                value_nm,
                limit_nm,
            });
        }
    }
    Ok(())
}
