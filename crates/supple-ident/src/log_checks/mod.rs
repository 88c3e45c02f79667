//! Checks of a log against the physics of the given arm, before a fit.
//!
//! Four groups of checks, in this order; an error that one of them finds can hide errors from the next:
//! - `sampling`: checks of single columns, without a model. Errors are: a moving joint whose angle stops
//!   within one sample, all joints that jump at once, a torque that stays at its maximum.
//! - `velocity`: measured velocities against the slopes of the angles, without a model.
//! - `corrections`: whether a column has the wrong sign, unit, order, zero or clock. A model of the arm with free link inertias is
//!   fitted to the log as given, and to the log with each error corrected. If a correction reduces the residual by far, the
//!   log has that error. Gravity determines the time scale and the zeros of the angles; friction, which only dissipates power,
//!   determines the signs.
//! - `unexplained_torque`: residual torques at some times (contact), or in all poses (torques in another unit, a payload, an offset).
//!
//! No threshold depends on the arm: each is relative to the data of the log itself, or to the gravity torques of the given arm.

mod corrections;
mod equal_values;
pub(crate) mod finding;
mod gravity;
mod sampling;
mod unexplained_torque;
mod velocity;
pub(crate) mod weighted_fit;

pub use finding::{Consequence, Finding, Problem};

use crate::cancellation::Cancellation;
use crate::error::IdentError;
use crate::filter::LowPass;
use crate::log::{Log, MAX_ANGLE_RAD};
use crate::motion::{Motion, Preparation};
use supple_core::Arm;

/// Maximum number of samples of a log to which the corrections are fitted.
const CORRECTION_SAMPLES: f64 = 300.0;
/// Minimum number of reversals of each identified joint in a log that is compared with a model.
const MIN_REVERSALS: usize = 3;
/// Minimum speed, as a fraction of the joint's peak speed, at which its direction counts.
const DIRECTION_SPEED_FRACTION: f64 = 0.1;
/// Maximum cutoff frequency of the filter for these checks, and the one of `sampling` if none is given \[Hz\].
const MAX_CUTOFF_HZ: f64 = 8.0;

/// Checks `log` against `arm`, for the joints `identified_joints`. `couplings` and the torque's delay are those of the fit.
///
/// # Errors
/// Shapes that do not agree, values that are not finite, times that do not increase; [`IdentError::Cancelled`].
pub fn check_log<const N: usize>(
    arm: &Arm<N>,
    log: &Log,
    identified_joints: &[usize],
    couplings: &[(usize, usize)],
    preparation: &Preparation,
    cancellation: &Cancellation,
) -> Result<Vec<Finding>, IdentError> {
    log.check_table(N, identified_joints)?;
    let cutoff_hz = preparation.cutoff_hz.unwrap_or(MAX_CUTOFF_HZ);
    let mut findings = sampling::check(log, identified_joints, cutoff_hz);
    if findings.iter().any(|f| f.problem == Problem::TimeUnit) {
        return Ok(findings);
    }
    if findings
        .iter()
        .all(|f| f.consequence != Consequence::Reject)
    {
        findings.extend(velocity::check(log, identified_joints));
    }
    let rejected = |findings: &[Finding]| {
        let rejects = |f: &Finding| f.consequence == Consequence::Reject;
        findings.iter().any(rejects)
    };
    if rejected(&findings) {
        return Ok(findings);
    }
    let whole = resample_whole(log, preparation)?;
    if identified_joints
        .iter()
        .any(|&joint| !reverses_often(&whole, joint))
    {
        findings.extend(many_revolutions(log, &findings));
        return Ok(findings);
    }
    let middle = resample_middle(log, preparation)?;
    let context = weighted_fit::FitContext::new(arm, identified_joints, couplings, cancellation)?;
    findings.extend(corrections::check(&context, &middle)?);
    findings.extend(many_revolutions(log, &findings));
    if !rejected(&findings) {
        findings.extend(unexplained_torque::check(&context, &whole)?);
    }
    Ok(findings)
}

/// Returns whether a joint reverses its direction at least [`MIN_REVERSALS`] times. A motion in one direction does not
/// distinguish an offset from dry friction.
fn reverses_often(motion: &Motion, joint: usize) -> bool {
    let speeds = motion.qd.column(joint);
    let min = DIRECTION_SPEED_FRACTION * speeds.amax();
    let mut reversals = 0;
    let mut forward = None;
    for &speed in speeds.iter().filter(|speed| speed.abs() > min) {
        let now = speed > 0.0;
        reversals += usize::from(forward.is_some_and(|before| before != now));
        forward = Some(now);
    }
    reversals >= MIN_REVERSALS
}

/// Reports angles of several revolutions at joints without another finding, which may be their cause.
fn many_revolutions(log: &Log, findings: &[Finding]) -> Vec<Finding> {
    let mut found = Vec::new();
    for (joint, column) in log.q_rad.column_iter().enumerate() {
        let largest = column.amax();
        let concerned = |f: &Finding| f.joints.is_empty() || f.joints.contains(&joint);
        if largest > MAX_ANGLE_RAD && !findings.iter().any(concerned) {
            found.push(Finding::reject(
                Problem::Degrees,
                &[joint],
                "q",
                format!("reaches {largest:.1}, which looks like degrees, or the angle of a motor"),
                "give radians of the joint: multiply degrees by pi / 180, divide angles of motors by the gear ratio",
            ));
        }
    }
    found
}

/// Returns the middle of the log, at most [`CORRECTION_SAMPLES`] samples, resampled at 20 Hz to 100 Hz but not above its own
/// rate.
fn resample_middle(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    let rate_hz = (CORRECTION_SAMPLES / span_s).clamp(20.0, 100.0).min(own_hz);
    let motion = resample(log, preparation, rate_hz)?;
    let samples = motion.samples();
    let kept = samples.min(CORRECTION_SAMPLES as usize);
    let first = (samples - kept) / 2;
    Ok(motion.part(first..first + kept))
}

/// Returns the whole log resampled at 50 Hz at most.
fn resample_whole(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    resample(log, preparation, own_hz.min(50.0))
}

/// Returns the whole log resampled to about 800 samples, at 20 Hz to 100 Hz.
pub(crate) fn resample_to_800(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    resample(log, preparation, (800.0 / span_s).clamp(20.0, 100.0))
}

fn resample(log: &Log, preparation: &Preparation, rate_hz: f64) -> Result<Motion, IdentError> {
    // The filter acts at the log's own rate; at the reduced rate its cutoff must stay below half of it.
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    let decimation_factor = (own_hz / rate_hz).floor().max(1.0) as usize;
    let cutoff_hz = MAX_CUTOFF_HZ.min(0.4 * own_hz / decimation_factor as f64);
    // Reports a cutoff that is not possible at this rate before the log is filtered.
    LowPass::butterworth4(cutoff_hz, own_hz)?;
    let preparation = Preparation {
        rate_hz: None,
        cutoff_hz: Some(cutoff_hz),
        decimation_factor,
        ..*preparation
    };
    Motion::from_checked_log(log, &preparation)
}
