//! Lower bounds of the collision and plausibility thresholds during a calibration, so that errors of the model cause no faults.
//!
//! Motors that give only a fraction of the commanded torque, and wrong masses, cause an error proportional to gravity. Arms
//! without brakes also hold their pose by position loops in gravity hold, because with a wrong model they would sink otherwise.

use super::error::ProcedureError;
use super::motions::RAMP_LIMIT_NM;
use crate::breakaway::JointBreakaway;
use supple_core::config::JointGains;
use supple_core::dynamics::gravity;
use supple_core::{Config, Vector};
use supple_model::{Description, MinimumThresholds};

/// Minimum of `plausible.load_n`, the unmodelled load at the tip at rest that causes no fault \[N\].
const LOAD_N: f64 = 40.0;
/// Value of `plausible.load_n` and `collision.tip_force_n` that no arm reaches \[N\]: it disables both checks.
const UNCHECKED_N: f64 = 1e4;
/// Minimum of `collision.tip_force_n` before the first fit, for an arm with brakes \[N\]: a torque ramp, and gravity that is wrong by some
/// N m, are observed as forces of up to 70 N where the lever of a joint is short; the thresholds of the joints stay.
const START_TIP_FORCE_N: f64 = 90.0;
/// Error of the model, as a fraction of its gravity: with an error of 30 % in a joint's gravity, and motors that give 1/1.5 of
/// the commanded torque, the true gravity takes 2.0 to 2.1 times the model's torque.
const GRAVITY_ERROR_SHARE: f64 = 1.1;
/// Error by friction, in breakaway torques: friction acts in either direction.
const FRICTION_ERROR_RATIO: f64 = 2.0;
/// `plausible.stiction_factor` before the first fit: friction may be twice that of the model, and grows with the load besides.
const STICTION_FACTOR: f64 = 3.0;
/// The same with the model of the first fit, which knows friction that grows with the load from short motions only.
const FIRST_FIT_STICTION_FACTOR: f64 = 2.0;
/// Error by inertia and other terms \[N m\].
const MARGIN_NM: f64 = 1.0;
/// Maximum threshold as a fraction of the joint's torque limit.
const MAX_LIMIT_FRACTION: f64 = 0.9;
/// `collision.move_share` and `plausible.against_share` with the model of the first fit, in which the torque scale may still
/// differ from motor to motor.
const FIRST_FIT_MOVE_SHARE: f64 = 2.0;
const FIRST_FIT_AGAINST_SHARE: f64 = 0.35;
/// `limits.joint_tracking_error_rad` before the first fit, as a multiple of the error at which a position loop reaches its torque limit.
const SATURATED_LOOP_RATIO: f64 = 1.25;
/// Maximum of `limits.joint_tracking_error_rad` that friction may make necessary \[rad\].
const MAX_TRACKING_ERROR_RAD: f64 = 0.5;
/// Number of angles per joint of the grid of poses at which gravity is evaluated.
const ANGLES_PER_JOINT: usize = 5;

/// Returns the minimum thresholds for `model`, which is the model of the description (`before_first_fit`) or of the first fit.
///
/// # Errors
/// A description that is not valid.
pub fn minimum_thresholds<const N: usize>(
    model: &Description,
    before_first_fit: bool,
) -> Result<MinimumThresholds, ProcedureError> {
    let has_no_brakes = model.falls_without_torque();
    let minimum = MinimumThresholds {
        move_share: 1.0,
        joint_torque_nm: None,
        tip_force_n: 0.0,
        hold_pose: has_no_brakes,
        load_n: LOAD_N,
        // Not raised for an arm with brakes: motion against the torque reveals a motor of the wrong sign.
        stiction_factor: 1.0,
        against_share: 0.0,
        joint_tracking_error_rad: 0.0,
    };
    match (has_no_brakes, before_first_fit) {
        (false, false) => return Ok(minimum),
        (false, true) => {
            return Ok(MinimumThresholds {
                tip_force_n: START_TIP_FORCE_N,
                ..minimum
            });
        }
        (true, false) => {
            return Ok(MinimumThresholds {
                move_share: FIRST_FIT_MOVE_SHARE,
                against_share: FIRST_FIT_AGAINST_SHARE,
                stiction_factor: FIRST_FIT_STICTION_FACTOR,
                ..minimum
            });
        }
        (true, true) => {}
    }
    let config = model.config::<N>()?;
    let max_nm = max_gravity_nm(&config);
    let limits_nm = &config.limits.joint_torque_nm;
    let threshold_nm = Vector::<N>::from_fn(|joint, _| {
        let error_nm = GRAVITY_ERROR_SHARE * max_nm[joint]
            + FRICTION_ERROR_RATIO * config.friction[joint].breakaway_nm
            // A torque ramp on a joint adds this torque at most.
            + RAMP_LIMIT_NM.min(limits_nm[joint])
            + MARGIN_NM;
        error_nm.min(MAX_LIMIT_FRACTION * limits_nm[joint])
    });
    let shares = threshold_nm.component_div(limits_nm);
    let saturated_rad = limits_nm.component_div(&config.move_gains.stiffness_nm_per_rad);
    let tracking_error_rad = SATURATED_LOOP_RATIO * saturated_rad.max();
    Ok(MinimumThresholds {
        joint_torque_nm: Some(threshold_nm.iter().copied().collect()),
        tip_force_n: UNCHECKED_N,
        load_n: UNCHECKED_N,
        stiction_factor: STICTION_FACTOR,
        against_share: shares.max(),
        joint_tracking_error_rad: tracking_error_rad.min(MAX_TRACKING_ERROR_RAD),
        ..minimum
    })
}

/// Returns the error of position loops with these gains that friction causes, if its feed-forward has the wrong sign \[rad\]: the
/// largest of all joints, at most 0.5 rad.
pub fn friction_error_rad<const N: usize>(
    gains: &JointGains<N>,
    breakaway: &[JointBreakaway],
) -> f64 {
    let joints = breakaway.iter().zip(gains.stiffness_nm_per_rad.iter());
    let errors =
        joints.map(|(found, stiffness)| FRICTION_ERROR_RATIO * found.breakaway_nm() / stiffness);
    errors.fold(0.0, f64::max).min(MAX_TRACKING_ERROR_RAD)
}

/// Returns the maximum gravity torque of each joint over a grid of poses within the joint limits \[N m\].
fn max_gravity_nm<const N: usize>(config: &Config<N>) -> Vector<N> {
    let (lower, upper) = (
        &config.limits.position_lower_rad,
        &config.limits.position_upper_rad,
    );
    let mut max_nm = Vector::<N>::zeros();
    for number in 0..ANGLES_PER_JOINT.pow(N as u32) {
        let mut rest = number;
        let q = Vector::from_fn(|joint, _| {
            let level = rest % ANGLES_PER_JOINT;
            rest /= ANGLES_PER_JOINT;
            lower[joint]
                + (upper[joint] - lower[joint]) * level as f64 / (ANGLES_PER_JOINT - 1) as f64
        });
        max_nm = max_nm.sup(&gravity(&config.arm, &q).abs());
    }
    max_nm
}
