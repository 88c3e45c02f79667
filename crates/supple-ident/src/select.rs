//! Which columns and options to use, decided by data that the fit has not seen.
//!
//! The log is cut into consecutive parts; each is predicted from a fit to the others. Of the
//! candidates within a small share of the least error, the one with the fewest columns is taken:
//! columns that do not pay for themselves are left out.

use crate::columns::{Columns, FrictionColumns};
use crate::error::IdentError;
use crate::fit::{Options, Weights, fit_rows};
use crate::motion::Motion;
use crate::regressor::{JointRows, joint_rows};
use std::fmt;
use supple_core::Arm;

/// Candidates that err by so much more than the best are as good.
const TIE: f64 = 0.005;

/// A set of options under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name in the table.
    pub name: String,
    /// What is tried.
    pub options: Options,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The candidate.
    pub candidate: Candidate,
    /// Its columns.
    pub columns: usize,
    /// `|tau - tau_hat| / |tau|` of each part, from a fit to the others; empty if none could be made.
    pub parts: Vec<f64>,
    /// The same over all parts, infinite if a fit could not be made.
    pub total: f64,
}

/// All candidates, and which was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// In the order given.
    pub lines: Vec<Line>,
    /// Position of the choice.
    pub chosen: usize,
}

impl Table {
    /// Options of the choice.
    pub fn options(&self) -> &Options {
        &self.lines[self.chosen].candidate.options
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  columns  held-out error  candidate")?;
        for (i, line) in self.lines.iter().enumerate() {
            let mark = if i == self.chosen { '*' } else { ' ' };
            let (total, name) = (100.0 * line.total, &line.candidate.name);
            writeln!(f, "{mark} {:7}  {total:12.3} %  {name}", line.columns)?;
        }
        Ok(())
    }
}

/// Friction from none to all of it, everything else as in `base`.
pub fn friction_candidates(base: &Options) -> Vec<Candidate> {
    let viscous = FrictionColumns {
        viscous: true,
        ..FrictionColumns::NONE
    };
    let asymmetric = FrictionColumns {
        asymmetry: true,
        ..FrictionColumns::OFFSET
    };
    let mut shapes = vec![
        ("no friction".to_owned(), FrictionColumns::NONE),
        ("viscous".to_owned(), viscous),
        ("viscous, Coulomb".to_owned(), FrictionColumns::COULOMB),
        (
            "viscous, Coulomb, offset".to_owned(),
            FrictionColumns::OFFSET,
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

/// Coulomb friction that does not depend on load, and that does; none where there is no such friction.
pub fn load_candidates(base: &Options) -> Vec<Candidate> {
    if !base.friction.coulomb {
        return Vec::new();
    }
    let candidate = |(name, load): (&str, bool)| Candidate {
        name: name.to_owned(),
        options: Options {
            friction: FrictionColumns {
                load,
                ..base.friction
            },
            ..base.clone()
        },
    };
    [("at any load the same", false), ("growing with load", true)]
        .map(candidate)
        .to_vec()
}

/// Widths of the band around rest, everything else as in `base`.
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

/// Ways to weigh joints and samples, everything else as in `base`.
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
        ("weights by joint", Weights::Noise),
        ("weights by joint, robust", Weights::Huber),
    ]
    .map(candidate)
    .to_vec()
}

/// Weights of the prior from heavy to light, everything else as in `base`.
pub fn prior_candidates(base: &Options) -> Vec<Candidate> {
    let candidate = |weight: f64| Candidate {
        name: format!("prior {weight}"),
        options: Options {
            consistent: Some(weight),
            ..base.clone()
        },
    };
    [1e4, 1e3, 1e2, 1e1, 1.0, 0.1].map(candidate).to_vec()
}

/// Predicts every one of `parts` consecutive parts of each motion from the others.
///
/// # Errors
/// No candidates; fewer than two parts; columns that make no sense. A candidate that cannot be fitted
/// is in the table with an infinite error, and only if that is all of them, the last reason is given.
pub fn compare<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    moving: &[usize],
    candidates: &[Candidate],
    parts: usize,
) -> Result<Table, IdentError> {
    if candidates.is_empty() || parts < 2 {
        return Err(IdentError::Option {
            option: "parts",
            value: parts as f64,
            must: "2 or more, with at least one candidate",
        });
    }
    let mut lines = Vec::new();
    let mut reason = None;
    for candidate in candidates {
        let options = &candidate.options;
        let columns = Columns::new(
            N,
            moving,
            options.rotor,
            options.friction,
            &options.couplings,
        )?;
        let folds = folds(nominal, &columns, motions, parts)?;
        let outcome = held_out(nominal, &columns, &folds, options);
        let (errors, total) = outcome.unwrap_or_else(|error| {
            reason = Some(error);
            (Vec::new(), f64::INFINITY)
        });
        lines.push(Line {
            candidate: candidate.clone(),
            columns: columns.len(),
            parts: errors,
            total,
        });
    }
    let least = lines
        .iter()
        .map(|line| line.total)
        .fold(f64::INFINITY, f64::min);
    if let (false, Some(reason)) = (least.is_finite(), reason) {
        return Err(reason);
    }
    let good = (0..lines.len()).filter(|i| lines[*i].total <= least * (1.0 + TIE));
    let chosen = good.min_by(|a, b| {
        let (a, b) = (&lines[*a], &lines[*b]);
        a.columns.cmp(&b.columns).then(a.total.total_cmp(&b.total))
    });
    Ok(Table {
        chosen: chosen.unwrap_or(0),
        lines,
    })
}

type Fold = Vec<Vec<JointRows>>;

/// For each part, the rows of every motion and joint.
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
    // Reduced here, before the folds are copied: each serves all fits but one.
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
        let wrong: f64 = rows().map(|r| (&r.a * &fit.x - &r.b).norm_squared()).sum();
        let size: f64 = rows().map(|r| r.b.norm_squared()).sum();
        errors.push((wrong / size).sqrt());
        error += wrong;
        torque += size;
    }
    Ok((errors, (error / torque).sqrt()))
}
