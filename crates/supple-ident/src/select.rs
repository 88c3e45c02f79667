//! Model selection by cross-validation.
//!
//! The log is divided into consecutive parts, the folds; each fold is predicted from a fit to the others. Among the candidates
//! within a tolerance of the smallest error, the one with the fewest columns is selected.

use crate::columns::{Columns, FrictionColumns};
use crate::effects::Effects;
use crate::error::IdentError;
use crate::fit::fit_rows;
use crate::joint_rows::JointRows;
use crate::motion::Motion;
use crate::options::{Options, Weights};
use crate::regressor::joint_rows;
pub use crate::selection_result::{Candidate, CandidateResult, SelectionTable};
use supple_core::Arm;
use supple_core::friction::LoadTorque;

/// Relative tolerance within which candidates count as equally good.
const TIE: f64 = 0.005;

/// Returns the friction models from none to the richest, with all other options as in `base`.
pub fn friction_candidates(base: &Options) -> Vec<Candidate> {
    let viscous = FrictionColumns {
        viscous: true,
        ..FrictionColumns::NONE
    };
    let asymmetric = FrictionColumns {
        asymmetry: true,
        ..FrictionColumns::COULOMB_AND_OFFSET
    };
    let mut shapes = vec![
        ("no friction".to_owned(), FrictionColumns::NONE),
        ("viscous".to_owned(), viscous),
        ("viscous, Coulomb".to_owned(), FrictionColumns::COULOMB),
        (
            "viscous, Coulomb, offset".to_owned(),
            FrictionColumns::COULOMB_AND_OFFSET,
        ),
        (
            "viscous by direction, Coulomb, offset".to_owned(),
            asymmetric,
        ),
    ];
    for speed in [0.05, 0.2, 0.5, 1.0, 1.5, 2.0] {
        let shape = FrictionColumns {
            stribeck_rad_per_s: Some(speed),
            ..FrictionColumns::COULOMB
        };
        shapes.push((format!("viscous, Coulomb, Stribeck {speed} rad/s"), shape));
    }
    let candidate = |(name, friction)| Candidate {
        name,
        options: Options {
            friction,
            ..base.clone()
        },
    };
    shapes.into_iter().map(candidate).collect()
}

/// Returns the Coulomb friction independent of load, growing with the joint's load, and growing with the motor's torque; empty
/// without Coulomb friction.
pub fn load_candidates(base: &Options) -> Vec<Candidate> {
    if !base.friction.coulomb {
        return Vec::new();
    }
    let candidate = |(name, load): (&str, Option<LoadTorque>)| Candidate {
        name: name.to_owned(),
        options: Options {
            friction: FrictionColumns {
                load,
                ..base.friction
            },
            ..base.clone()
        },
    };
    [
        ("independent of load", None),
        (
            "growing with the load of the joint",
            Some(LoadTorque::Joint),
        ),
        ("growing with the motor's torque", Some(LoadTorque::Motor)),
    ]
    .map(candidate)
    .to_vec()
}

/// Widths of the band around standstill, with all other options as in `base`.
pub fn band_candidates(base: &Options) -> Vec<Candidate> {
    let candidate = |band_rad_per_s: f64| Candidate {
        name: format!("band {band_rad_per_s} rad/s"),
        options: Options {
            friction: FrictionColumns {
                band_rad_per_s,
                ..base.friction
            },
            ..base.clone()
        },
    };
    [0.005, 0.01, 0.015, 0.02, 0.03, 0.05]
        .map(candidate)
        .to_vec()
}

/// Weightings of joints and samples, with all other options as in `base`.
pub fn weights_candidates(base: &Options) -> Vec<Candidate> {
    let candidate = |(name, weights): (&str, Weights)| Candidate {
        name: name.to_owned(),
        options: Options {
            weights,
            ..base.clone()
        },
    };
    [
        ("equal weights", Weights::Equal),
        ("weights by joint", Weights::ByJointResidual),
        ("weights by joint, robust", Weights::Huber),
    ]
    .map(candidate)
    .to_vec()
}

/// No effects besides friction, those of `effects` without compliance, and all of `effects`.
pub fn effects_candidates(base: &Options, effects: &Effects) -> Vec<Candidate> {
    let rigid = Effects {
        compliance: false,
        ..effects.clone()
    };
    let candidate = |(name, effects): (&str, Effects)| Candidate {
        name: name.to_owned(),
        options: Options {
            effects,
            ..base.clone()
        },
    };
    [
        ("friction alone", Effects::default()),
        ("effects without compliance", rigid),
        ("all effects", effects.clone()),
    ]
    .map(candidate)
    .to_vec()
}

/// Returns the weights of the prior from large to small, with all other options as in `base`.
pub fn prior_candidates(base: &Options) -> Vec<Candidate> {
    let candidate = |weight: f64| Candidate {
        name: format!("prior {weight}"),
        options: Options {
            consistent_prior_weight: Some(weight),
            ..base.clone()
        },
    };
    [1e4, 1e3, 1e2, 1e1, 1.0, 0.1].map(candidate).to_vec()
}

/// Cross-validates the candidates: predicts each of `parts` consecutive parts of every motion from the others.
///
/// # Errors
/// No candidates; fewer than two parts; invalid columns. A candidate whose fit fails has an infinite error in
/// the table; if all fail, the last error is returned.
pub fn compare<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    candidates: &[Candidate],
    parts: usize,
) -> Result<SelectionTable, IdentError> {
    if candidates.is_empty() || parts < 2 {
        return Err(IdentError::Option {
            option: "parts",
            value: parts as f64,
            must: "2 or more, with at least one candidate",
        });
    }
    let mut results = Vec::new();
    let mut reason = None;
    for candidate in candidates {
        let options = &candidate.options;
        let columns = Columns::new(
            N,
            identified_joints,
            options.rotor,
            options.friction,
            &options.couplings,
        )?
        .with_effects(&options.effects);
        let folds = folds(nominal, &columns, motions, parts)?;
        let outcome = held_out(nominal, &columns, &folds, options);
        // A cancelled comparison has no result, even if a candidate failed for another reason.
        options.cancellation.check()?;
        let (errors, total) = outcome.unwrap_or_else(|error| {
            reason = Some(error);
            (Vec::new(), f64::INFINITY)
        });
        results.push(CandidateResult {
            candidate: candidate.clone(),
            columns: columns.len(),
            parts: errors,
            total,
        });
    }
    let lowest = results
        .iter()
        .map(|line| line.total)
        .fold(f64::INFINITY, f64::min);
    if let (false, Some(reason)) = (lowest.is_finite(), reason) {
        return Err(reason);
    }
    let good = (0..results.len()).filter(|i| results[*i].total <= lowest * (1.0 + TIE));
    let chosen = good.min_by(|a, b| {
        let (a, b) = (&results[*a], &results[*b]);
        a.columns.cmp(&b.columns).then(a.total.total_cmp(&b.total))
    });
    Ok(SelectionTable {
        chosen: chosen.unwrap_or(0),
        candidates: results,
    })
}

type Fold = Vec<Vec<JointRows>>;

/// Returns for each fold the rows of every motion and joint.
fn folds<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    motions: &[Motion],
    parts: usize,
) -> Result<Vec<Fold>, IdentError> {
    let mut folds = vec![Vec::new(); parts];
    for motion in motions {
        let joints = joint_rows(nominal, columns, motion)?;
        let samples = motion.samples();
        for (p, fold) in folds.iter_mut().enumerate() {
            let range = p * samples / parts..(p + 1) * samples / parts;
            fold.push(
                joints
                    .iter()
                    .map(|joint| joint.part(range.clone()))
                    .collect(),
            );
        }
    }
    Ok(folds)
}

fn held_out<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    folds: &[Fold],
    options: &Options,
) -> Result<(Vec<f64>, f64), IdentError> {
    let (mut errors, mut error, mut torque) = (Vec::new(), 0.0, 0.0);
    // Reduce the rows before the folds are copied: each fold is used by all fits but one.
    for rows in folds.iter().flatten().flatten() {
        rows.block(options.slow_rad_per_s);
    }
    for (p, fold) in folds.iter().enumerate() {
        let others: Fold = (0..folds.len())
            .filter(|other| *other != p)
            .flat_map(|other| folds[other].clone())
            .collect();
        let fit = fit_rows(nominal, columns.clone(), &others, 1.0, options)?;
        let rows = || fold.iter().flatten();
        let squared = |values: Vec<f64>| values.iter().map(|v| v * v).sum::<f64>();
        let residual: f64 = rows().map(|r| squared(r.residual(&fit.x))).sum();
        let scale: f64 = rows().map(|r| squared(r.torques())).sum();
        errors.push((residual / scale).sqrt());
        error += residual;
        torque += scale;
    }
    Ok((errors, (error / torque).sqrt()))
}
