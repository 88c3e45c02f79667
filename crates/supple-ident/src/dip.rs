//! The Stribeck speed: the one whose dip, fitted in the second stage, leaves the least of slow motion.

use crate::columns::FrictionColumns;
use crate::error::IdentError;
use crate::fit::{Fit, STEADY_RAD, fit};
use crate::motion::Motion;
use crate::procedure::{FrictionChoice, Procedure};
use crate::regressor::joint_rows;
use supple_core::Arm;

/// Speeds tried \[rad/s\].
const SPEEDS_RAD_PER_S: [f64; 7] = [0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15];
/// Motion slower than this judges them \[rad/s\].
const SLOW_RAD_PER_S: f64 = 0.15;

/// Fits viscous and Coulomb friction with offset from fast samples, and the dip that explains the slow
/// ones best, one Stribeck speed for all joints. `procedure` gives everything else.
///
/// # Errors
/// As [`crate::identify_motions`].
pub fn fit_with_dip<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    moving: &[usize],
    procedure: &Procedure,
) -> Result<Fit<N>, IdentError> {
    let mut best: Option<(Fit<N>, f64)> = None;
    for speed in SPEEDS_RAD_PER_S {
        let columns = match procedure.friction {
            FrictionChoice::Auto => FrictionColumns::OFFSET,
            FrictionChoice::Columns(columns) => columns,
        };
        let given = Procedure {
            friction: FrictionChoice::Columns(FrictionColumns {
                stribeck_rad_per_s: Some(speed),
                ..columns
            }),
            ..procedure.clone()
        };
        let options = given.options(nominal, motions, moving)?.0;
        let mut found = fit(nominal, motions, moving, &options)?;
        found.preparation = procedure.preparation;
        let left = slow_error(&found, motions)?;
        if best.as_ref().is_none_or(|(_, least)| left < *least) {
            best = Some((found, left));
        }
    }
    best.map(|(found, _)| found)
        .ok_or_else(|| crate::error::shape_error("motions", "at least one", "none"))
}

/// Squares of what is left of slow, steady sliding outside the band, each joint by its mean.
fn slow_error<const N: usize>(found: &Fit<N>, motions: &[Motion]) -> Result<f64, IdentError> {
    let slow = found.columns.friction().band_rad_per_s..=SLOW_RAD_PER_S;
    let mut total = 0.0;
    for motion in motions {
        for joint in joint_rows(found.nominal(), &found.columns, motion)? {
            let residual = &joint.a * &found.x - &joint.b;
            let kept: Vec<f64> = (0..residual.len())
                .filter(|i| slow.contains(&joint.speed[*i]) && joint.slid_rad[*i] >= STEADY_RAD)
                .map(|i| residual[i])
                .collect();
            let mean = kept.iter().sum::<f64>() / kept.len().max(1) as f64;
            total += kept.iter().map(|r| (r - mean).powi(2)).sum::<f64>();
        }
    }
    Ok(total)
}
