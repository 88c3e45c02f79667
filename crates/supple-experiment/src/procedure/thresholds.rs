//! The thresholds at which the arm stops while its model is unknown.
//!
//! Motors that give a share of the commanded torque, and masses that are off, make an error that grows with gravity. Arms
//! without brakes also keep their pose by position loops in gravity hold, since the model alone would let them sink.

use super::error::ProcedureError;
use super::motions::RAMP_LIMIT_NM;
use supple_core::dynamics::gravity;
use supple_core::{Config, Vector};
use supple_model::{Description, WideThresholds};

/// Load at the tip at rest \[N\].
const LOAD_N: f64 = 40.0;
/// Load and force at the tip that no arm reaches \[N\]: neither is checked.
const UNCHECKED_N: f64 = 1e4;
/// Error of the model as a share of gravity: 30 % of a joint's gravity and motors that give 1/1.5 of what is commanded make
/// 2.0 to 2.1 times the gravity of the model.
const GRAVITY_ERROR: f64 = 1.1;
/// Breakaway torques in the error: friction acts either way.
const FRICTION_ERROR: f64 = 2.0;
/// What inertia and other terms add \[N m\].
const MARGIN_NM: f64 = 1.0;
/// Maximum of a threshold as a share of the joint's torque limit.
const LIMIT_SHARE: f64 = 0.9;
/// With a model of the first fit, whose motors share no common scale: collision thresholds as a share of those of the
/// description, and torque that may oppose the acceleration of a joint as a share of its limit.
const FIRST_MODEL_SHARE: f64 = 2.0;
const FIRST_MODEL_AGAINST: f64 = 0.35;
/// Poses at which gravity is evaluated: levels of each joint.
const LEVELS: usize = 5;

/// Thresholds for `model`; `unknown` before a first fit is in use.
///
/// # Errors
/// A description that is not valid.
pub fn wide_thresholds<const N: usize>(
    model: &Description,
    unknown: bool,
) -> Result<WideThresholds, ProcedureError> {
    let falls = model.bus().is_some();
    let wide = WideThresholds {
        move_share: 1.0,
        joint_torque_nm: None,
        tip_force_n: 0.0,
        hold_pose: falls,
        load_n: LOAD_N,
        // As in the description: motion against its torque is what a motor of the wrong sign makes.
        against_share: 0.0,
    };
    match (falls, unknown) {
        (false, _) => return Ok(wide),
        (true, false) => {
            return Ok(WideThresholds {
                move_share: FIRST_MODEL_SHARE,
                against_share: FIRST_MODEL_AGAINST,
                ..wide
            });
        }
        (true, true) => {}
    }
    let config = model.config::<N>()?;
    let most_nm = most_gravity_nm(&config);
    let limits_nm = &config.limits.joint_torque_nm;
    let threshold_nm = Vector::<N>::from_fn(|joint, _| {
        let error_nm = GRAVITY_ERROR * most_nm[joint]
            + FRICTION_ERROR * config.friction[joint].breakaway_nm
            + RAMP_LIMIT_NM.min(limits_nm[joint])
            + MARGIN_NM;
        error_nm.min(LIMIT_SHARE * limits_nm[joint])
    });
    let shares = threshold_nm.component_div(limits_nm);
    Ok(WideThresholds {
        joint_torque_nm: Some(threshold_nm.iter().copied().collect()),
        tip_force_n: UNCHECKED_N,
        load_n: UNCHECKED_N,
        against_share: shares.max(),
        ..wide
    })
}

/// Greatest gravity torque of each joint over its range and that of all others \[N m\].
fn most_gravity_nm<const N: usize>(config: &Config<N>) -> Vector<N> {
    let (lower, upper) = (
        &config.limits.position_lower_rad,
        &config.limits.position_upper_rad,
    );
    let mut most_nm = Vector::<N>::zeros();
    for number in 0..LEVELS.pow(N as u32) {
        let mut rest = number;
        let q = Vector::from_fn(|joint, _| {
            let level = rest % LEVELS;
            rest /= LEVELS;
            lower[joint] + (upper[joint] - lower[joint]) * level as f64 / (LEVELS - 1) as f64
        });
        most_nm = most_nm.sup(&gravity(&config.arm, &q).abs());
    }
    most_nm
}
