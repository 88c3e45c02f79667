//! Model selection by cross-validation.
//!
//! The logs are divided into folds: with three logs of the same kind or more, whole logs, otherwise consecutive parts of each. Each
//! fold is predicted from a fit to the others. Among the candidates that are at most a standard error worse than the best one, the
//! one with the fewest columns is selected; among those, the one with the smallest rank; among those, the best one.

use crate::columns::{Columns, FrictionColumns};
use crate::effects::Effects;
use crate::error::IdentError;
use crate::fit::fit_rows;
use crate::joint_rows::JointRows;
use crate::motion::Motion;
use crate::options::{Options, Weights};
use crate::regressor::joint_rows;
pub use crate::selection_result::{Candidate, CandidateResult, SelectionTable};
use std::ops::Range;
use supple_core::Arm;
use supple_core::friction::LoadTorque;

/// Ratio of the accelerations of two motions above which they are not of the same kind.
const SAME_KIND: f64 = 3.0;

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
        rank: 0,
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
        rank: 0,
    };
    let candidates = [
        ("independent of load", None),
        (
            "growing with the load of the joint",
            Some(LoadTorque::Joint),
        ),
        ("growing with the motor's torque", Some(LoadTorque::Motor)),
    ]
    .map(candidate)
    .to_vec();
    ranked(candidates)
}

/// Returns the candidates ranked in this order.
fn ranked(mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    for (rank, candidate) in candidates.iter_mut().enumerate() {
        candidate.rank = rank;
    }
    candidates
}

/// Widths of the band around standstill, the default first, with all other options as in `base`.
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
        rank: 0,
    };
    let candidates = [0.01, 0.005, 0.015, 0.02, 0.03, 0.05, 0.1]
        .map(candidate)
        .to_vec();
    ranked(candidates)
}

/// Weightings of joints and samples, the default first, with all other options as in `base`.
pub fn weights_candidates(base: &Options) -> Vec<Candidate> {
    let candidate = |(name, weights): (&str, Weights)| Candidate {
        name: name.to_owned(),
        options: Options {
            weights,
            ..base.clone()
        },
        rank: 0,
    };
    let candidates = [
        ("weights by joint", Weights::ByJointResidual),
        ("weights by joint, robust", Weights::Huber),
        ("equal weights", Weights::Equal),
    ]
    .map(candidate)
    .to_vec();
    ranked(candidates)
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
        rank: 0,
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
        rank: 0,
    };
    ranked([1e4, 1e3, 1e2, 1e1, 1.0, 0.1].map(candidate).to_vec())
}

/// Relative tolerance within which effects count as equally good.
const EFFECTS_TIE: f64 = 0.005;

/// Cross-validates the candidates: predicts each fold from the others, and chooses by the rule of one standard error.
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
    let folds = fold_ranges(motions, parts);
    let candidates = results(nominal, motions, identified_joints, candidates, &folds)?;
    let best = best(&candidates, |result| result.total);
    let chosen = simplest(&candidates, |result| {
        result.is_as_good_as(&candidates[best])
    });
    Ok(SelectionTable {
        chosen: chosen.unwrap_or(best),
        candidates,
    })
}

/// Does the same as [`compare`] for effects: by the relative error of all joints together, within [`EFFECTS_TIE`], over parts of each
/// motion. With the rule of one standard error one of ten simulated arms got effects that it does not have, because a gain that is the same
/// in a few folds may be chance, and arms with effects got no better models.
pub(crate) fn compare_effects<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    candidates: &[Candidate],
    parts: usize,
) -> Result<SelectionTable, IdentError> {
    let folds = parts_of_each(motions, parts);
    let candidates = results(nominal, motions, identified_joints, candidates, &folds)?;
    let best = best(&candidates, |result| result.relative);
    let within = candidates[best].relative * (1.0 + EFFECTS_TIE);
    let chosen = simplest(&candidates, |result| result.relative <= within);
    Ok(SelectionTable {
        chosen: chosen.unwrap_or(best),
        candidates,
    })
}

/// Returns the result of each candidate.
fn results<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    candidates: &[Candidate],
    folds: &[Vec<(usize, Range<usize>)>],
) -> Result<Vec<CandidateResult>, IdentError> {
    if candidates.is_empty() || folds.len() < 2 {
        return Err(IdentError::Option {
            option: "parts",
            value: folds.len() as f64,
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
        let folds = rows_of_folds(nominal, &columns, motions, folds)?;
        let outcome = held_out(nominal, &columns, &folds, options);
        // A cancelled comparison has no result, even if a candidate failed for another reason.
        options.cancellation.check()?;
        let (squares, relative) = outcome.unwrap_or_else(|error| {
            reason = Some(error);
            (Vec::new(), f64::INFINITY)
        });
        results.push(CandidateResult {
            candidate: candidate.clone(),
            columns: columns.len(),
            total: match squares.is_empty() {
                true => f64::INFINITY,
                false => mean(&squares).sqrt(),
            },
            folds: squares.into_iter().map(f64::sqrt).collect(),
            relative,
        });
    }
    match reason {
        Some(reason) if results.iter().all(|result| !result.total.is_finite()) => Err(reason),
        _ => Ok(results),
    }
}

/// Returns the index of the candidate with the smallest error.
fn best(results: &[CandidateResult], error: impl Fn(&CandidateResult) -> f64) -> usize {
    let indices = 0..results.len();
    let best = indices.min_by(|a, b| error(&results[*a]).total_cmp(&error(&results[*b])));
    best.unwrap_or(0)
}

/// Returns the index of the simplest of the candidates that are good.
fn simplest(results: &[CandidateResult], good: impl Fn(&CandidateResult) -> bool) -> Option<usize> {
    let rank = |i: &usize| (results[*i].columns, results[*i].candidate.rank);
    (0..results.len())
        .filter(|i| good(&results[*i]))
        .min_by(|a, b| {
            let by_error = results[*a].total.total_cmp(&results[*b].total);
            rank(a).cmp(&rank(b)).then(by_error)
        })
}

type Fold = Vec<Vec<JointRows>>;

/// Returns for each fold the samples of each motion that it contains. With three motions of the same kind or more, a fold contains
/// whole motions, so that a model is judged on logs that it was not fitted to; otherwise a part of each motion.
fn fold_ranges(motions: &[Motion], parts: usize) -> Vec<Vec<(usize, Range<usize>)>> {
    let rms = |m: &Motion| (m.qdd.norm_squared() / m.qdd.len().max(1) as f64).sqrt();
    let (least, greatest) = motions
        .iter()
        .map(rms)
        .fold((f64::INFINITY, 0.0_f64), |(least, greatest), rms| {
            (least.min(rms), greatest.max(rms))
        });
    if motions.len() >= 3 && greatest < SAME_KIND * least {
        let folds = motions.len().min(parts);
        let mut ranges = vec![Vec::new(); folds];
        for (i, motion) in motions.iter().enumerate() {
            ranges[i % folds].push((i, 0..motion.samples()));
        }
        return ranges;
    }
    parts_of_each(motions, parts)
}

/// Returns for each fold one of as many consecutive parts of each motion.
fn parts_of_each(motions: &[Motion], parts: usize) -> Vec<Vec<(usize, Range<usize>)>> {
    let of_fold = |p: usize| {
        let part = |(i, motion): (usize, &Motion)| {
            let samples = motion.samples();
            (i, p * samples / parts..(p + 1) * samples / parts)
        };
        motions.iter().enumerate().map(part).collect()
    };
    (0..parts).map(of_fold).collect()
}

/// Returns for each fold the rows of every motion and joint.
fn rows_of_folds<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    motions: &[Motion],
    folds: &[Vec<(usize, Range<usize>)>],
) -> Result<Vec<Fold>, IdentError> {
    let all: Vec<Vec<JointRows>> = motions
        .iter()
        .map(|motion| joint_rows(nominal, columns, motion))
        .collect::<Result<_, _>>()?;
    let part = |(i, range): &(usize, Range<usize>)| {
        all[*i]
            .iter()
            .map(|joint| joint.part(range.clone()))
            .collect()
    };
    Ok(folds
        .iter()
        .map(|fold| fold.iter().map(part).collect())
        .collect())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Returns for each joint the square of the torque by which its residuals are divided: its own variance of torque times the mean
/// variance of all joints, square root. With its own alone the weak joints of the wrist decide, with the mean alone the shoulder.
fn scales_nm2(folds: &[Fold]) -> Vec<f64> {
    let joints = folds[0].first().map_or(0, Vec::len);
    let variance = |j: usize| {
        let rows = folds.iter().flatten();
        let torques: Vec<f64> = rows.flat_map(|rows| rows[j].torques()).collect();
        let middle = mean(&torques);
        let squares: Vec<f64> = torques.iter().map(|tau| (tau - middle).powi(2)).collect();
        mean(&squares).max(f64::EPSILON)
    };
    let own: Vec<f64> = (0..joints).map(variance).collect();
    let all = mean(&own);
    own.iter().map(|own| (own * all).sqrt()).collect()
}

/// Returns for each fold the mean over the joints of the squared residual divided by the joint's scale, and `|tau - tau_hat| / |tau|` of
/// all joints and folds.
fn held_out<const N: usize>(
    nominal: &Arm<N>,
    columns: &Columns,
    folds: &[Fold],
    options: &Options,
) -> Result<(Vec<f64>, f64), IdentError> {
    // Reduce the rows before the folds are copied: each fold is used by all fits but one.
    for rows in folds.iter().flatten().flatten() {
        rows.block(options.slow_rad_per_s);
    }
    let scales_nm2 = scales_nm2(folds);
    let (mut errors, mut residual_nm2, mut torque_nm2) = (Vec::new(), 0.0, 0.0);
    for (p, fold) in folds.iter().enumerate() {
        let others: Fold = (0..folds.len())
            .filter(|other| *other != p)
            .flat_map(|other| folds[other].clone())
            .collect();
        let fit = fit_rows(nominal, columns.clone(), &others, 1.0, options)?;
        let sum = |values: Vec<f64>| values.iter().map(|nm| nm * nm).sum::<f64>();
        for rows in fold.iter().flatten() {
            residual_nm2 += sum(rows.residual(&fit.x));
            torque_nm2 += sum(rows.torques());
        }
        let of_joint = |(j, scale_nm2): (usize, &f64)| {
            let residuals = fold.iter().flat_map(|rows| rows[j].residual(&fit.x));
            let squares: Vec<f64> = residuals.map(|nm| nm * nm).collect();
            mean(&squares) / scale_nm2
        };
        let of_joints: Vec<f64> = scales_nm2.iter().enumerate().map(of_joint).collect();
        errors.push(mean(&of_joints));
    }
    Ok((errors, (residual_nm2 / torque_nm2).sqrt()))
}
