//! Finds the Stribeck speed for which the second-stage fit has the smallest residual in slow motion.

use crate::columns::FrictionColumns;
use crate::error::IdentError;
use crate::fit::{Fit, fit};
use crate::motion::Motion;
use crate::presliding::presliding_rad;
use crate::procedure::{FrictionChoice, Procedure};
use crate::regressor::joint_rows;
use crate::slow_motion::speed_weights;
use supple_core::Arm;

/// Candidate Stribeck speeds \[rad/s\].
const SPEEDS_RAD_PER_S: [f64; 7] = [0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15];
/// Maximum speed of the samples used to compare the candidates \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.15;

/// Fits viscous and Coulomb friction with offset to the fast samples and the Stribeck effect to the slow ones,
/// with one Stribeck speed for all joints. `procedure` sets all other options.
///
/// # Errors
/// As [`crate::identify_motions`].
pub fn fit_with_stribeck<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    let (procedure, effects) =
        procedure.with_chosen_effects(nominal, motions, identified_joints)?;
    let mut best: Option<(Fit<N>, f64)> = None;
    for speed in SPEEDS_RAD_PER_S {
        let columns = match procedure.friction {
            FrictionChoice::Auto => FrictionColumns::COULOMB_AND_OFFSET,
            FrictionChoice::Columns(columns) => columns,
        };
        let candidate = Procedure {
            friction: FrictionChoice::Columns(FrictionColumns {
                stribeck_rad_per_s: Some(speed),
                ..columns
            }),
            ..procedure.clone()
        };
        let options = candidate.options(nominal, motions, identified_joints)?.0;
        let mut found = fit(nominal, motions, identified_joints, &options)?;
        found.preparation = procedure.preparation;
        let residual = slow_error(&found, motions)?;
        if best.as_ref().is_none_or(|(_, lowest)| residual < *lowest) {
            best = Some((found, residual));
        }
    }
    let best = best.map(|(found, _)| found);
    let mut found =
        best.ok_or_else(|| crate::error::shape_error("motions", "at least one", "none"))?;
    found.presliding_rad = presliding_rad(&found, motions)?;
    found.choices.extend(effects);
    Ok(found)
}

/// Returns the sum of squared residuals of slow, steady sliding outside the band, after subtraction of each joint's mean.
fn slow_error<const N: usize>(found: &Fit<N>, motions: &[Motion]) -> Result<f64, IdentError> {
    let slow = found.columns.friction().band_rad_per_s..=SLOW_RAD_PER_S;
    let mut total = 0.0;
    for motion in motions {
        for joint in joint_rows(found.nominal(), &found.columns, motion)? {
            let residual = &joint.a * &found.x - &joint.b;
            let (kept, speeds): (Vec<f64>, Vec<f64>) = (0..residual.len())
                .filter(|i| joint.is_slow_sliding(*i, &slow))
                .map(|i| (residual[i], joint.speed[i]))
                .unzip();
            let weights = speed_weights(&speeds, SLOW_RAD_PER_S);
            let weighted = || kept.iter().zip(&weights);
            let mean = weighted().map(|(r, w)| w * r).sum::<f64>() / kept.len().max(1) as f64;
            total += weighted().map(|(r, w)| w * (r - mean).powi(2)).sum::<f64>();
        }
    }
    Ok(total)
}
