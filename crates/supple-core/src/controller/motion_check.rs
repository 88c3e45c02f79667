//! Checks of a requested motion from start to end: reach between the soft stops, joint and tip speeds, torques and
//! workspace borders. They take some milliseconds and do not run in the control loop.

use super::Controller;
use super::checks::COMPLIANT_SPEED_SHARE;
use super::mode::{Refusal, Request};
use super::pose_task::{DIRECTIONS, pose_reference};
use super::request_checks::{check_pose_joints, check_position_limits, target_with_held_joints};
use crate::config::{Config, Role};
use crate::dynamics::inverse_kinematics::inverse_kinematics;
use crate::dynamics::{Terms, terms};
use crate::law::impedance::Task;
use crate::math::{Vector, Vector3, abs, smooth_step};
use crate::model::pose::{Pose, rotation_vector};
use crate::trajectory::{JointReference, Reference, Rotation, Trajectory};

/// Number of equal time intervals in a period of a motion; it is checked at their ends.
const INTERVALS: u32 = 128;
/// Greatest number of periods of a motion, ramps included: what can be checked within a second.
const MAX_PERIODS: f64 = 1000.0;
/// Maximum distance at which a point of a trajectory counts as reached \[m\].
const REACHED_M: f64 = 1e-3;
/// Maximum angle at which an orientation counts as reached \[rad\].
const REACHED_RAD: f64 = 1e-3;
/// Maximum number of Newton steps from one pose to the next.
const NEWTON_STEPS: u32 = 20;
/// Maximum number of Newton steps from one tip position to the next.
const POINT_STEPS: u32 = 5;
/// Fraction of the torque limits available to the feed-forward of a motion; the rest is for
/// feedback.
const TORQUE_SHARE: f64 = 0.9;
/// Fraction of the speed limits available to the reference of a motion: an arm that lags moves faster than its reference
/// when it catches up.
const SPEED_SHARE: f64 = 0.95;

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
            let samples = times_s(trajectory.length_s(), trajectory.periods())?;
            let samples = samples.map(|time_s| (time_s, trajectory.at(time_s)));
            check_references(controller, position_rad, samples)
        }
        Request::TrackPose {
            trajectory,
            rotation,
        } => {
            check_pose_joints(config)?;
            trajectory.validate().map_err(Refusal::Trajectory)?;
            rotation.validate().map_err(Refusal::Trajectory)?;
            check_pose(config, position_rad, trajectory, rotation)
        }
        Request::Move {
            target_rad,
            duration_s,
        } => check_minimum_jerk_move(config, 1.0, position_rad, target_rad, *duration_s),
        Request::JointImpedance {
            target_rad,
            duration_s,
        } => {
            let target_rad = target_with_held_joints(config, position_rad, target_rad);
            check_minimum_jerk_move(
                config,
                COMPLIANT_SPEED_SHARE,
                position_rad,
                &target_rad,
                *duration_s,
            )
        }
        Request::Excite(series) => {
            series.validate().map_err(Refusal::Trajectory)?;
            let times_s = times_s(series.duration_s, series.duration_s / series.period_s())?;
            check_joint_motion(config, 1.0, times_s, |time_s| series.at(time_s))
        }
        Request::SetPoint(set_point) => {
            set_point.validate()?;
            let reference = set_point.reference();
            check_point(config, &mut { *position_rad }, &reference, 0.0)
        }
        _ => Ok(()),
    }
}

/// Checks a tip motion that set-points will request, given as times \[s\] and references in order, from a pose near the
/// first sample. The checks of a sample are those of [`check_motion`] for a trajectory.
///
/// # Errors
/// The first [`Refusal`] along the motion.
pub fn check_references<const N: usize>(
    controller: &Controller<N>,
    position_rad: &Vector<N>,
    references: impl IntoIterator<Item = (f64, Reference)>,
) -> Result<(), Refusal> {
    // The solution of each sample is the first guess of the next.
    let mut q = *position_rad;
    for (time_s, reference) in references {
        check_point(controller.config(), &mut q, &reference, time_s)?;
    }
    Ok(())
}

/// Checks a minimum-jerk motion on a straight line in joint space.
fn check_minimum_jerk_move<const N: usize>(
    config: &Config<N>,
    speed_share: f64,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
    duration_s: f64,
) -> Result<(), Refusal> {
    let displacement = to_rad - from_rad;
    let times_s = times_s(duration_s, 0.0)?;
    check_joint_motion(config, speed_share, times_s, |time_s| {
        let (share, first_derivative, second_derivative) = smooth_step(time_s / duration_s);
        JointReference {
            position_rad: from_rad + displacement * share,
            velocity_rad_per_s: displacement * (first_derivative / duration_s),
            acceleration_rad_per_s2: displacement * (second_derivative / (duration_s * duration_s)),
        }
    })
}

/// Checks one point of a tip motion. `q` is a pose near it and becomes the pose at the point.
fn check_point<const N: usize>(
    config: &Config<N>,
    q: &mut Vector<N>,
    reference: &Reference,
    time_s: f64,
) -> Result<(), Refusal> {
    if let Some((border, value_m)) = config.workspace.violated_border(&reference.position) {
        return Err(Refusal::Workspace { border, value_m });
    }
    let mut dynamics = Terms::default();
    match follow_point(config, q, &reference.position, &mut dynamics) {
        Some(position_rad) => *q = position_rad,
        None => {
            let found = inverse_kinematics(
                &config.arm,
                &config.roles,
                &config.limits,
                q,
                &reference.position,
            );
            if found.distance_m > REACHED_M {
                return Err(Refusal::OutOfReach {
                    time_s,
                    distance_m: found.distance_m,
                });
            }
            *q = found.position_rad;
            terms(&config.arm, q, &Vector::zeros(), &mut dynamics);
        }
    }
    let Some(task) = Task::new(&dynamics, &config.roles) else {
        // The mass matrix is not positive definite: only reach and borders are checked.
        return Ok(());
    };
    let qd = task.inverse * reference.velocity;
    terms(&config.arm, q, &qd, &mut dynamics);
    let bias_acceleration = dynamics.jacobian_dot_qd.fixed_rows::<3>(0);
    let qdd = task.inverse * (reference.acceleration - bias_acceleration);
    check_joints(config, 1.0, &dynamics, &qd, &qdd)
}

/// Returns a pose with the tip at `position`, found by Newton steps from a pose near it with the law's own inverse of the
/// Jacobian: a redundant arm moves its light joints most. `state` becomes the state of the pose. Returns `None` if the steps do
/// not converge, or if the pose exceeds the position limits.
fn follow_point<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    position: &Vector3<f64>,
    state: &mut Terms<N>,
) -> Option<Vector<N>> {
    let mut q = *from_rad;
    for _ in 0..POINT_STEPS {
        terms(&config.arm, &q, &Vector::zeros(), state);
        let error = position - state.base_from_tip.translation;
        if error.norm() <= REACHED_M {
            return check_position_limits(config, &q).is_ok().then_some(q);
        }
        let task = Task::new(state, &config.roles)?;
        q += task.inverse * error;
    }
    None
}

/// Checks a motion of position and orientation, with the joint motion that the task's inverse gives, starting from rest.
fn check_pose<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    trajectory: &Trajectory,
    rotation: &Rotation,
) -> Result<(), Refusal> {
    let mut q = *from_rad;
    let mut state = Terms::default();
    terms(&config.arm, &q, &Vector::zeros(), &mut state);
    let start = state.base_from_tip.rotation;
    let length_s = trajectory.length_s().max(rotation.duration_s);
    let periods = match trajectory.length_s() > 0.0 {
        true => trajectory.periods() * length_s / trajectory.length_s(),
        false => 1.0,
    };
    for time_s in times_s(length_s, periods)? {
        let position = trajectory.at(time_s);
        if let Some((border, value_m)) = config.workspace.violated_border(&position.position) {
            return Err(Refusal::Workspace { border, value_m });
        }
        let reference = pose_reference(&position, &rotation.at(&start, time_s));
        let task = solve_pose(config, &reference.base_from_tip, &mut q, &mut state, time_s)?;
        check_position_limits(config, &q)?;
        let velocity = task.inverse * reference.velocity();
        terms(&config.arm, &q, &velocity, &mut state);
        let acceleration = task.inverse * (reference.acceleration() - state.jacobian_dot_qd);
        check_joints(config, 1.0, &state, &velocity, &acceleration)?;
    }
    Ok(())
}

/// Moves `q` to a pose of the tip near it by Newton steps, and returns the task in that pose.
fn solve_pose<const N: usize>(
    config: &Config<N>,
    wanted: &Pose,
    q: &mut Vector<N>,
    state: &mut Terms<N>,
    time_s: f64,
) -> Result<Task<N, DIRECTIONS>, Refusal> {
    let mut steps = 0;
    loop {
        terms(&config.arm, q, &Vector::zeros(), state);
        let task = Task::of_pose(state, &config.roles).ok_or(Refusal::Singular)?;
        let found = &state.base_from_tip;
        let distance = wanted.translation - found.translation;
        let angle = rotation_vector(&(wanted.rotation * found.rotation.transpose()));
        let (distance_m, angle_rad) = (distance.norm(), angle.norm());
        if distance_m <= REACHED_M && angle_rad <= REACHED_RAD {
            return Ok(task);
        }
        if steps == NEWTON_STEPS {
            return Err(match distance_m <= REACHED_M || task.is_damped {
                true => Refusal::Singular,
                false => Refusal::OutOfReach { time_s, distance_m },
            });
        }
        let error = Vector::<DIRECTIONS>::from_fn(|k, _| match k {
            0..3 => distance[k],
            _ => angle[k - 3],
        });
        *q += task.inverse * error;
        steps += 1;
    }
}

/// Returns the times at which a motion of this length is checked \[s\], from its start to its end.
fn times_s(length_s: f64, periods: f64) -> Result<impl Iterator<Item = f64>, Refusal> {
    if periods > MAX_PERIODS || periods.is_nan() {
        return Err(Refusal::Value {
            entry: "number of periods of the motion, with its ramps,",
            value: periods,
            limit: MAX_PERIODS,
        });
    }
    let intervals = INTERVALS * (periods as u32).saturating_add(1);
    Ok((0..=intervals).map(move |k| length_s * f64::from(k) / f64::from(intervals)))
}

/// Checks a joint motion; `speed_share` of the limits of joint and tip speed applies.
fn check_joint_motion<const N: usize>(
    config: &Config<N>,
    speed_share: f64,
    times_s: impl Iterator<Item = f64>,
    reference_at: impl Fn(f64) -> JointReference<N>,
) -> Result<(), Refusal> {
    let mut dynamics = Terms::default();
    for time_s in times_s {
        let reference = reference_at(time_s);
        let (q, qd) = (reference.position_rad, reference.velocity_rad_per_s);
        terms(&config.arm, &q, &qd, &mut dynamics);
        let tip = dynamics.base_from_tip.translation;
        // The first sample is the current pose, which a request cannot change.
        if time_s > 0.0
            && let Some((border, value_m)) = config.workspace.violated_border(&tip)
        {
            return Err(Refusal::Workspace { border, value_m });
        }
        let tip_velocity = dynamics.jacobian.fixed_rows::<3>(0) * qd;
        let limit = SPEED_SHARE * speed_share * config.limits.tip_speed_m_per_s;
        let value = tip_velocity.norm();
        if value > limit {
            return Err(Refusal::Value {
                entry: "peak tip speed of the motion [m/s]",
                value,
                limit,
            });
        }
        let qdd = &reference.acceleration_rad_per_s2;
        check_joints(config, speed_share, &dynamics, &qd, qdd)?;
    }
    Ok(())
}

/// Checks joint speeds and torques at one point of the motion.
fn check_joints<const N: usize>(
    config: &Config<N>,
    speed_share: f64,
    dynamics: &Terms<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> Result<(), Refusal> {
    let torque = dynamics.coriolis_gravity + dynamics.mass_matrix * qdd;
    for joint in 0..N {
        let limit_rad_per_s =
            SPEED_SHARE * speed_share * config.limits.joint_speed_rad_per_s[joint];
        let value_rad_per_s = abs(qd[joint]);
        if value_rad_per_s > limit_rad_per_s {
            return Err(Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
        // A held joint at rest is carried by its position loop.
        if config.roles[joint] != Role::Active && qd[joint] == 0.0 {
            continue;
        }
        let friction = config.friction[joint]
            .at_load(dynamics.gravity[joint])
            .torque_nm(qd[joint]);
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
