//! Checks of a request that are fast enough for the control loop; [`super::check_motion()`] checks a motion over its whole
//! length.

use super::mode::{Breakaway, Refusal};
use super::pose_gains::{GainMatrices, GainPart};
use super::pose_task::DIRECTIONS;
use super::validate;
use crate::config::{Config, Gains, JointGains, Role, RotationalGains};
use crate::law::target::{EIGENVALUE_ROUNDING, eigenvalue_range};
use crate::law::task::count_active;
use crate::math::{Vector, abs};
use crate::trajectory::{
    Fourier, LimitViolation, MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_JERK, MINIMUM_JERK_SPEED,
    Rotation, Trajectory,
};

/// Maximum difference between the target of a held joint and the angle at which it is held \[rad\].
const HELD_TOLERANCE_RAD: f64 = 1e-6;
/// Maximum distance of a joint from the start of an excitation \[rad\].
const EXCITE_START_RAD: f64 = 0.02;
/// Longest ramp of gains \[s\].
const MAX_RAMP_S: f64 = 3600.0;
/// Maximum joint damping that may be requested, whatever the delay allows \[N m s/rad\].
const MAX_JOINT_DAMPING_NM_S_PER_RAD: f64 = 1e5;

pub(super) fn check_gains<const N: usize>(
    config: &Config<N>,
    gains: &Gains,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    validate::gains(gains, limits.stiffness_n_per_m, limits.damping_n_s_per_m).map_err(
        |error| Refusal::Value {
            entry: error.entry,
            value: error.value,
            limit: if error.entry == "stiffness_n_per_m" {
                limits.stiffness_n_per_m
            } else {
                limits.damping_n_s_per_m
            },
        },
    )?;
    check_ramp(ramp_s)
}

pub(super) fn check_joint_gains<const N: usize>(
    config: &Config<N>,
    gains: &JointGains<N>,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let stiffest = &config.move_gains.stiffness_nm_per_rad;
    for joint in 0..N {
        for (entry, value, limit) in [
            (
                "impedance_stiffness_nm_per_rad",
                gains.stiffness_nm_per_rad[joint],
                stiffest[joint],
            ),
            (
                "impedance_damping_nm_s_per_rad",
                gains.damping_nm_s_per_rad[joint],
                MAX_JOINT_DAMPING_NM_S_PER_RAD,
            ),
        ] {
            if !(0.0..=limit).contains(&value) {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit: if value < 0.0 { 0.0 } else { limit },
                });
            }
        }
    }
    check_ramp(ramp_s)
}

pub(super) fn check_rotational_gains<const N: usize>(
    config: &Config<N>,
    gains: &RotationalGains,
    ramp_s: f64,
) -> Result<(), Refusal> {
    for axis in 0..3 {
        for (entry, value, limit) in [
            (
                "rotational stiffness_nm_per_rad",
                gains.stiffness_nm_per_rad[axis],
                config.pose.max_stiffness_nm_per_rad,
            ),
            (
                "rotational damping_nm_s_per_rad",
                gains.damping_nm_s_per_rad[axis],
                config.pose.max_damping_nm_s_per_rad,
            ),
        ] {
            if !(0.0..=limit).contains(&value) {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit: if value < 0.0 { 0.0 } else { limit },
                });
            }
        }
    }
    check_ramp(ramp_s)
}

#[cold]
#[inline(never)]
pub(super) fn check_gain_matrices<const N: usize>(
    config: &Config<N>,
    part: GainPart,
    gains: &GainMatrices,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let (stiffness_limit, damping_limit) = match part {
        GainPart::Linear => (
            config.limits.stiffness_n_per_m,
            config.limits.damping_n_s_per_m,
        ),
        GainPart::Rotational => (
            config.pose.max_stiffness_nm_per_rad,
            config.pose.max_damping_nm_s_per_rad,
        ),
    };
    for (matrix, entry, limit) in [
        (
            &gains.stiffness,
            "eigenvalue of the stiffness matrix",
            stiffness_limit,
        ),
        (
            &gains.damping,
            "eigenvalue of the damping matrix",
            damping_limit,
        ),
    ] {
        if let Some(value) = matrix.iter().find(|value| !value.is_finite()) {
            return Err(Refusal::Value {
                entry: "entry of a gain matrix",
                value: *value,
                limit,
            });
        }
        let Some((min, max)) = eigenvalue_range(matrix) else {
            return Err(Refusal::Value {
                entry: "asymmetry of a gain matrix",
                value: (matrix - matrix.transpose()).amax(),
                limit: 0.0,
            });
        };
        if min < -EIGENVALUE_ROUNDING * max {
            return Err(Refusal::Value {
                entry,
                value: min,
                limit: 0.0,
            });
        }
        if max > limit {
            return Err(Refusal::Value {
                entry,
                value: max,
                limit,
            });
        }
    }
    check_ramp(ramp_s)
}

/// Checks that enough joints are active for the six directions of a pose.
pub(super) fn check_pose_joints<const N: usize>(config: &Config<N>) -> Result<(), Refusal> {
    let active = count_active(&config.roles);
    if active >= DIRECTIONS {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "number of active joints, of which a pose needs six,",
        value: active as f64,
        limit: DIRECTIONS as f64,
    })
}

pub(super) fn check_rotation<const N: usize>(
    config: &Config<N>,
    rotation: &Rotation,
) -> Result<(), Refusal> {
    rotation.validate().map_err(Refusal::Trajectory)?;
    let (value, limit) = (
        rotation.peak_rad_per_s(),
        config.pose.angular_speed_rad_per_s,
    );
    if value > limit || value.is_nan() {
        return Err(Refusal::Value {
            entry: "peak angular speed of the rotation [rad/s]",
            value,
            limit,
        });
    }
    Ok(())
}

pub(super) fn check_ramp(ramp_s: f64) -> Result<(), Refusal> {
    if (0.0..=MAX_RAMP_S).contains(&ramp_s) {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "ramp_s",
        value: ramp_s,
        limit: if ramp_s > 0.0 { MAX_RAMP_S } else { 0.0 },
    })
}

pub(super) fn check_peak<const N: usize>(
    config: &Config<N>,
    trajectory: &Trajectory,
) -> Result<(), Refusal> {
    let (speed, acceleration) = trajectory.peaks();
    for (entry, value, limit) in [
        (
            "peak speed of the trajectory [m/s]",
            speed,
            config.limits.tip_speed_m_per_s,
        ),
        (
            "peak acceleration of the trajectory [m/s^2]",
            acceleration,
            config.limits.tip_acceleration_m_per_s2,
        ),
    ] {
        if value > limit || value.is_nan() {
            return Err(Refusal::Value {
                entry,
                value,
                limit,
            });
        }
    }
    Ok(())
}

pub(super) fn check_excitation<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    series: &Fourier<N>,
) -> Result<(), Refusal> {
    series.validate().map_err(Refusal::Trajectory)?;
    series
        .within(&config.limits)
        .map_err(|violation| match violation {
            LimitViolation::Position(joint, value_rad) => {
                Refusal::BeyondJointStop { joint, value_rad }
            }
            LimitViolation::Speed(joint, value_rad_per_s, limit_rad_per_s) => Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            },
        })?;
    let start = series.at(0.0).position_rad;
    let value = (start - from_rad).amax();
    if value <= EXCITE_START_RAD {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "distance of a joint from the start of the excitation",
        value,
        limit: EXCITE_START_RAD,
    })
}

pub(super) fn check_breakaway<const N: usize>(
    config: &Config<N>,
    ramp: &Breakaway,
) -> Result<(), Refusal> {
    let refuse = |entry, value, limit| {
        Err(Refusal::Value {
            entry,
            value,
            limit,
        })
    };
    if ramp.joint >= N {
        return refuse("joint", ramp.joint as f64, (N - 1) as f64);
    }
    let fastest = config.limits.torque_rate_nm_per_s[ramp.joint];
    let rate = abs(ramp.rate_nm_per_s);
    if !(rate > 0.0 && rate <= fastest) {
        return refuse("rate_nm_per_s", ramp.rate_nm_per_s, fastest);
    }
    let furthest = config.limits.joint_tracking_error_rad;
    if !(ramp.stop_rad > 0.0 && ramp.stop_rad <= furthest) {
        return refuse("stop_rad", ramp.stop_rad, furthest);
    }
    let strongest = config.limits.joint_torque_nm[ramp.joint];
    if !(ramp.limit_nm > 0.0 && ramp.limit_nm <= strongest) {
        return refuse("limit_nm", ramp.limit_nm, strongest);
    }
    Ok(())
}

/// Returns the target with the angles of `from_rad` for the held joints.
pub(super) fn target_with_held_joints<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    target_rad: &Vector<N>,
) -> Vector<N> {
    Vector::from_fn(|joint, _| match config.roles[joint] {
        Role::Active => target_rad[joint],
        Role::Held { .. } => from_rad[joint],
    })
}

pub(super) fn check_held_targets<const N: usize>(
    config: &Config<N>,
    target_rad: &Vector<N>,
) -> Result<(), Refusal> {
    for (role, value) in config.roles.iter().zip(target_rad) {
        if let Role::Held { position_rad, .. } = role
            && !(0.0..=HELD_TOLERANCE_RAD).contains(&abs(value - position_rad))
        {
            return Err(Refusal::Value {
                entry: "target_rad of a held joint",
                value: *value,
                limit: *position_rad,
            });
        }
    }
    Ok(())
}

pub(super) fn check_position_limits<const N: usize>(
    config: &Config<N>,
    target_rad: &Vector<N>,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    for joint in 0..N {
        let value_rad = target_rad[joint];
        let (lower, upper) = (
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
        );
        if !(lower..=upper).contains(&value_rad) {
            return Err(Refusal::BeyondJointStop { joint, value_rad });
        }
    }
    Ok(())
}

/// Checks the peak speed, acceleration and jerk of a minimum-jerk move. `speed_share` is the fraction of the joints' speed
/// limits that applies.
pub(super) fn check_joint_move<const N: usize>(
    config: &Config<N>,
    speed_share: f64,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
    duration_s: f64,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    if !(duration_s.is_finite() && duration_s > 0.0) {
        return Err(Refusal::Value {
            entry: "duration_s",
            value: duration_s,
            limit: f64::MAX,
        });
    }
    for joint in 0..N {
        let displacement_rad = abs(to_rad[joint] - from_rad[joint]);
        let value_rad_per_s = MINIMUM_JERK_SPEED * displacement_rad / duration_s;
        let limit_rad_per_s = speed_share * limits.joint_speed_rad_per_s[joint];
        if value_rad_per_s > limit_rad_per_s || value_rad_per_s.is_nan() {
            return Err(Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
        let per_s2 = displacement_rad / (duration_s * duration_s);
        for (entry, value, limit) in [
            (
                "peak joint acceleration of the move [rad/s^2]",
                MINIMUM_JERK_ACCELERATION * per_s2,
                limits.joint_acceleration_rad_per_s2[joint],
            ),
            (
                "peak joint jerk of the move [rad/s^3]",
                MINIMUM_JERK_JERK * per_s2 / duration_s,
                limits.joint_jerk_rad_per_s3[joint],
            ),
        ] {
            if value > limit || value.is_nan() {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit,
                });
            }
        }
    }
    Ok(())
}
