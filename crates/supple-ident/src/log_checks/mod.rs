//! Checks of a log against the physics of the given arm, before a fit.
//!
//! Three groups, in this order; each finds only what the one before lets it see:
//! - `sampling`: what the columns show by themselves. An encoder cannot stop within a sample, time cannot jump for all
//!   joints at once, a torque does not rest on its largest value.
//! - `remedies`: what would be right if a column had another sign, unit, order, zero or clock. The torques of an arm
//!   whose links may have any inertia are computed for the log as given and for the log with each remedy. If the remedy
//!   explains them far better, the log has that error. Gravity fixes the time scale and the zeros, the friction that must
//!   dissipate power fixes the signs.
//! - `excess`: what the arm does not explain at some times (contact), or at all poses (torques in another unit, a
//!   payload, an offset).
//!
//! Nothing here depends on an arm: every threshold is a ratio to what the log itself shows, or to the gravity of the given arm.

mod excess;
pub(crate) mod explained;
pub(crate) mod finding;
mod gravity;
mod remedies;
mod runs;
mod sampling;
mod velocity;

pub use finding::{Consequence, Finding, Problem};

use crate::error::IdentError;
use crate::filter::LowPass;
use crate::log::{Log, MAX_ANGLE_RAD};
use crate::motion::{Motion, Preparation};
use supple_core::Arm;

/// Number of samples of a log that are used to compare remedies.
const SAMPLES: f64 = 300.0;
/// Least number of reversals of every joint in a motion that is compared with the arm.
const REVERSALS: usize = 3;
/// Speed, as a fraction of the greatest, above which a joint has a direction.
const REVERSING_SHARE: f64 = 0.1;
/// Highest cutoff of the filter for these checks \[Hz\].
const CUTOFF_HZ: f64 = 8.0;

/// Checks `log` against `arm`, of which `moving` joints move. `couplings` and the torque's delay are those of the fit.
///
/// # Errors
/// Shapes that do not agree, values that are not finite, times that do not increase.
pub fn check_log<const N: usize>(
    arm: &Arm<N>,
    log: &Log,
    moving: &[usize],
    couplings: &[(usize, usize)],
    preparation: &Preparation,
) -> Result<Vec<Finding>, IdentError> {
    log.check_table(N, moving)?;
    let cutoff_hz = preparation.cutoff_hz.unwrap_or(CUTOFF_HZ);
    let mut findings = sampling::check(log, moving, cutoff_hz);
    if findings.iter().any(|f| f.problem == Problem::TimeUnit) {
        return Ok(findings);
    }
    if findings.iter().all(|f| f.consequence != Consequence::Stop) {
        findings.extend(velocity::check(log, moving));
    }
    let stopped = |findings: &[Finding]| {
        let stops = |f: &Finding| f.consequence == Consequence::Stop;
        findings.iter().any(stops)
    };
    if stopped(&findings) {
        return Ok(findings);
    }
    let whole = fine(log, preparation)?;
    if moving.iter().any(|&joint| !turns_around(&whole, joint)) {
        findings.extend(turns(log, &findings));
        return Ok(findings);
    }
    let motion = coarse(log, preparation)?;
    let context = explained::Context::new(arm, moving, couplings)?;
    findings.extend(remedies::check(&context, &motion)?);
    findings.extend(turns(log, &findings));
    if !stopped(&findings) {
        findings.extend(excess::check(&context, &whole)?);
    }
    Ok(findings)
}

/// Whether a joint reverses its direction at least [`REVERSALS`] times: in a motion to one side an offset looks like dry
/// friction, and much else explains the torques as well.
fn turns_around(motion: &Motion, joint: usize) -> bool {
    let speeds = motion.qd.column(joint);
    let min = REVERSING_SHARE * speeds.amax();
    let mut reversals = 0;
    let mut forward = None;
    for &speed in speeds.iter().filter(|speed| speed.abs() > min) {
        let now = speed > 0.0;
        reversals += usize::from(forward.is_some_and(|before| before != now));
        forward = Some(now);
    }
    reversals >= REVERSALS
}

/// Angles of many turns that no remedy explains.
fn turns(log: &Log, findings: &[Finding]) -> Vec<Finding> {
    let mut found = Vec::new();
    for (joint, column) in log.q_rad.column_iter().enumerate() {
        let largest = column.amax();
        let named = |f: &Finding| f.joints.is_empty() || f.joints.contains(&joint);
        if largest > MAX_ANGLE_RAD && !findings.iter().any(named) {
            found.push(Finding::stop(
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

/// The log at a rate of a few samples per period of the cutoff, at most [`SAMPLES`] from its middle.
fn coarse(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    let rate_hz = (SAMPLES / span_s).clamp(20.0, 100.0).min(own_hz);
    let motion = at_rate(log, preparation, rate_hz)?;
    let samples = motion.samples();
    let kept = samples.min(SAMPLES as usize);
    let first = (samples - kept) / 2;
    Ok(motion.part(first..first + kept))
}

/// The whole log at some 50 samples per second.
fn fine(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    at_rate(log, preparation, own_hz.min(50.0))
}

/// The whole log at 30 samples per second, or more if it is short.
pub(crate) fn reduced(log: &Log, preparation: &Preparation) -> Result<Motion, IdentError> {
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    at_rate(log, preparation, (800.0 / span_s).clamp(20.0, 100.0))
}

fn at_rate(log: &Log, preparation: &Preparation, rate_hz: f64) -> Result<Motion, IdentError> {
    // The filter acts at the log's own rate; at the reduced rate its cutoff must stay below half of it.
    let span_s = log.t_s[log.t_s.len() - 1] - log.t_s[0];
    let own_hz = (log.t_s.len() - 1) as f64 / span_s;
    let keep_every = (own_hz / rate_hz).floor().max(1.0) as usize;
    let cutoff_hz = CUTOFF_HZ.min(0.4 * own_hz / keep_every as f64);
    LowPass::butterworth4(cutoff_hz, own_hz)?;
    let preparation = Preparation {
        rate_hz: None,
        cutoff_hz: Some(cutoff_hz),
        keep_every,
        ..*preparation
    };
    Motion::of_checked(log, &preparation)
}
