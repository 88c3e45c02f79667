//! Delay between the angles and the torques of a log, estimated by cross-validation.
//!
//! For each candidate delay the torques are shifted, the log is divided into parts, and each part is predicted from a fit to the
//! others. The delay with the minimum held-out error, over all joints relative to their own torques, is refined by a parabola
//! through its neighbours.

use crate::cancellation::Cancellation;
use crate::error::IdentError;
use crate::log::Log;
use crate::log_checks::resample_to_800;
use crate::log_checks::weighted_fit::{FitContext, GramMatrices};
use crate::motion::Preparation;
use supple_core::Arm;

/// Maximum delay of the search, for either sign \[s\].
pub const MAX_DELAY_S: f64 = 0.06;
/// Steps of the search \[s\], from coarse to fine.
const STEPS_S: [f64; 3] = [0.012, 0.004, 0.001];
/// Number of parts of the log.
const PARTS: usize = 4;
/// Minimum gain of the score; below it the log does not distinguish the delay from zero.
const MIN_GAIN: f64 = 1e-3;

/// Estimated delay of a log's torques after its angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayEstimate {
    /// Time from a logged torque to its action \[s\], as [`Preparation::torque_delay_s`]: negative if the torques lag.
    pub delay_s: f64,
    /// Held-out error, geometric mean of the joints' relative errors, without compensation.
    pub error_without: f64,
    /// Held-out error with the delay compensated.
    pub error_with: f64,
}

/// Estimates the delay of `log`. Rate, filter and delay of `preparation` are replaced; the search is centred on zero.
///
/// # Errors
/// A log that is too short for its filter; [`IdentError::Cancelled`].
pub fn estimate_delay<const N: usize>(
    nominal: &Arm<N>,
    log: &Log,
    identified_joints: &[usize],
    couplings: &[(usize, usize)],
    preparation: &Preparation,
    cancellation: &Cancellation,
) -> Result<DelayEstimate, IdentError> {
    let context = FitContext::new(nominal, identified_joints, couplings, cancellation)?;
    let mut known: Vec<(f64, f64)> = Vec::new();
    let mut score = |delay_s: f64| -> Result<f64, IdentError> {
        let same = |(d, _): &&(f64, f64)| (d - delay_s).abs() < 1e-9;
        if let Some((_, score)) = known.iter().find(same) {
            return Ok(*score);
        }
        let shifted = Preparation {
            torque_delay_s: delay_s,
            ..*preparation
        };
        let motion = resample_to_800(log, &shifted)?;
        let parts: Vec<GramMatrices> = (0..PARTS)
            .map(|p| {
                let n = motion.samples();
                context.grams(&motion.part(p * n / PARTS..(p + 1) * n / PARTS))
            })
            .collect::<Result<_, _>>()?;
        let value = held_out(&context, &parts);
        known.push((delay_s, value));
        Ok(value)
    };
    let origin = score(0.0)?;
    let mut best = (0.0, origin);
    let mut reach_s = MAX_DELAY_S;
    for step_s in STEPS_S {
        let centre: f64 = best.0;
        let count = (reach_s / step_s).round() as i32;
        for k in -count..=count {
            let delay_s = centre + step_s * f64::from(k);
            if delay_s.abs() <= MAX_DELAY_S + 1e-9 {
                let value = score(delay_s)?;
                if value < best.1 {
                    best = (delay_s, value);
                }
            }
        }
        reach_s = step_s;
    }
    let step_s = STEPS_S[STEPS_S.len() - 1];
    let [before, after] = [score(best.0 - step_s)?, score(best.0 + step_s)?];
    let bend = before - 2.0 * best.1 + after;
    let shift = if bend > 0.0 {
        0.5 * (before - after) / bend
    } else {
        0.0
    };
    let found_s = best.0 + step_s * shift.clamp(-0.5, 0.5);
    let is_found = origin - best.1 > MIN_GAIN;
    Ok(DelayEstimate {
        delay_s: if is_found { found_s } else { 0.0 },
        error_without: origin.exp(),
        error_with: if is_found { best.1.exp() } else { origin.exp() },
    })
}

/// Returns the mean over the joints of the logarithm of the held-out error.
fn held_out<const N: usize>(context: &FitContext<'_, N>, parts: &[GramMatrices]) -> f64 {
    let joints = context.columns.identified_joints().len();
    let mut errors = vec![[0.0, 0.0]; joints];
    for (p, part) in parts.iter().enumerate() {
        let others = parts.iter().enumerate().filter(|(other, _)| *other != p);
        let Some(sum) = others
            .map(|(_, grams)| grams.clone())
            .reduce(GramMatrices::plus)
        else {
            continue;
        };
        let fitted = context.solve(&sum);
        for (joint, [error, torque]) in part.errors(&fitted.x).into_iter().enumerate() {
            errors[joint][0] += error;
            errors[joint][1] += torque;
        }
    }
    let logarithms = errors
        .iter()
        .map(|[error, torque]| 0.5 * (error / torque).max(1e-12).ln());
    logarithms.sum::<f64>() / joints as f64
}
