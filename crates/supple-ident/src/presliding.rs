//! Presliding: the travel over which dry friction reverses after a reversal of motion.
//!
//! Within this travel a joint does not slide: its bearings and cables act as a spring, and the friction follows `p' = v (1 - p
//! sign(v)) / d` (Dahl 1968) rather than the sign of the velocity. For each joint, `d` is selected from a list, and between its values, such
//! that the model best explains the torque around every second reversal of the logs. It is accepted if it also explains the remaining
//! reversals, which were not used for the selection, much better than a model without presliding. All of the dry friction reverses over
//! `d`, that of the load too: with a part that reverses at once, the other would seem to take longer.

use crate::columns::Column;
use crate::error::IdentError;
use crate::filter::LowPass;
use crate::fit::Fit;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::DVector;
use supple_core::{Friction, Vector};

/// Candidate travels \[rad\].
const TRAVELS_RAD: [f64; 12] = [
    1.5e-4, 2.5e-4, 3.5e-4, 5e-4, 7e-4, 1e-3, 1.4e-3, 2e-3, 2.8e-3, 4e-3, 5.6e-3, 8e-3,
];
/// Travel before and after a reversal that is evaluated \[rad\].
const WINDOW_RAD: f64 = 0.01;
/// Maximum ratio of the errors with and without presliding, over the reversals that were not used for the selection.
const IMPROVEMENT: f64 = 0.7;
/// Minimum number of reversals, and of samples around each.
const REVERSALS: usize = 4;
const SAMPLES: usize = 8;

/// Samples around one reversal of a joint.
struct Reversal {
    motion: usize,
    samples: core::ops::Range<usize>,
}

/// Identifies the travel of each joint of the arm over which its dry friction reverses \[rad\]; zero if it is not determined.
///
/// # Errors
/// As [`joint_rows`].
pub fn presliding_rad<const N: usize>(
    fit: &Fit<N>,
    motions: &[Motion],
) -> Result<Vec<f64>, IdentError> {
    let mut found = vec![0.0; N];
    let parts = motions
        .iter()
        .map(|motion| joint_rows(fit.nominal(), &fit.columns, motion));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    let friction = fit.friction();
    let loaded = friction.iter().any(|joint| joint.load_coefficient > 0.0);
    let loads = motions
        .iter()
        .map(|motion| loaded.then(|| loads_nm(fit, motion)));
    let loads: Vec<Option<Vec<Vector<N>>>> = loads.collect();
    for (row, &joint) in fit.columns.identified_joints().iter().enumerate() {
        let dry = [
            Column::Coulomb(joint),
            Column::Stribeck(joint),
            Column::Load(joint),
        ];
        let mut smooth = fit.x.clone();
        for position in dry
            .iter()
            .filter_map(|column| fit.columns.position(*column))
        {
            smooth[position] = 0.0;
        }
        // Torque that dry friction has to explain.
        let rest: Vec<DVector<f64>> = parts
            .iter()
            .map(|part| &part[row].b - &part[row].a * &smooth)
            .collect();
        let reversals = reversals(motions, joint);
        // The friction of motors is part of the rest of the model.
        let [coulomb_nm, dip_nm, _] = dry.map(|column| fit.value(column));
        let of_joint = friction[joint];
        let coulomb_nm = coulomb_nm + of_joint.load_coefficient * of_joint.coulomb_at_nm;
        if reversals.len() < REVERSALS || coulomb_nm <= 0.0 {
            continue;
        }
        let errors = |travel_rad: f64| -> Result<[f64; 2], IdentError> {
            let law = Friction {
                coulomb_nm,
                breakaway_nm: coulomb_nm + dip_nm,
                presliding_rad: travel_rad,
                ..of_joint
            };
            let dry = motions.iter().zip(&loads);
            let dry = dry.map(|(motion, loads)| dry_nm(&law, motion, joint, loads.as_deref()));
            let dry = dry.collect::<Result<Vec<_>, _>>()?;
            let mut sums = [0.0; 2];
            for (k, reversal) in reversals.iter().enumerate() {
                let of = |i: usize| rest[reversal.motion][i] - dry[reversal.motion][i];
                // Subtract the mean: slow changes are not caused by the reversal.
                let mean =
                    reversal.samples.clone().map(of).sum::<f64>() / reversal.samples.len() as f64;
                let square: f64 = reversal
                    .samples
                    .clone()
                    .map(|i| (of(i) - mean).powi(2))
                    .sum();
                sums[k % 2] += square / reversal.samples.len() as f64;
            }
            Ok(sums)
        };
        let without = errors(0.0)?;
        let tried = TRAVELS_RAD.map(|travel_rad| errors(travel_rad).map(|sums| sums[0]));
        let tried = tried.into_iter().collect::<Result<Vec<_>, _>>()?;
        let best = (0..tried.len()).min_by(|a, b| tried[*a].total_cmp(&tried[*b]));
        let Some(best) = best.filter(|best| tried[*best] < without[0]) else {
            continue;
        };
        let travel_rad = between_candidates(&tried, best);
        if errors(travel_rad)?[1] <= IMPROVEMENT * IMPROVEMENT * without[1] {
            found[joint] = travel_rad;
        }
    }
    Ok(found)
}

/// Returns the travel at which the parabola through the errors of the best candidate and its neighbours, over the logarithm of the travel,
/// is least \[rad\]; the best candidate if it is the first or the last.
fn between_candidates(errors: &[f64], best: usize) -> f64 {
    if best == 0 || best + 1 == errors.len() {
        return TRAVELS_RAD[best];
    }
    let log = |candidate: usize| TRAVELS_RAD[candidate].ln();
    let (left, right) = (log(best - 1) - log(best), log(best + 1) - log(best));
    let (left_rise, right_rise) = (
        errors[best - 1] - errors[best],
        errors[best + 1] - errors[best],
    );
    // Error above that of the best candidate: slope * x + curve * x^2, with the logarithm's change x.
    let curve = (right_rise / right - left_rise / left) / (right - left);
    let slope = right_rise / right - curve * right;
    if curve > 0.0 {
        (log(best) - 0.5 * slope / curve).exp()
    } else {
        TRAVELS_RAD[best]
    }
}

/// Returns the torque that the joints carry at rest along a motion, without their friction: the load by which the controller computes their
/// friction. The columns of the fit have the load of the motion itself.
fn loads_nm<const N: usize>(fit: &Fit<N>, motion: &Motion) -> Vec<Vector<N>> {
    let rest = Vector::<N>::zeros();
    let offset_nm = Vector::<N>::from_fn(|j, _| {
        fit.value(Column::Offset(j)) + fit.value(Column::StribeckOffset(j))
    });
    let at = |i: usize| {
        let q = Vector::from_fn(|j, _| motion.q[(i, j)]);
        fit.predict(&q, &rest, &rest) - offset_nm
    };
    (0..motion.samples()).map(at).collect()
}

/// Returns the dry friction along a motion in which the joints carry `loads_nm`, filtered like its torques.
fn dry_nm<const N: usize>(
    law: &Friction,
    motion: &Motion,
    joint: usize,
    loads_nm: Option<&[Vector<N>]>,
) -> Result<Vec<f64>, IdentError> {
    let step_s = 1.0 / motion.rate_hz;
    let mut direction = 0.0;
    let speeds = motion.qd.column(joint);
    let along = speeds.iter().enumerate().map(|(i, v)| {
        let loaded = loads_nm.map_or(*law, |loads_nm| law.at_load(loads_nm[i][joint]));
        direction = match loaded.presliding_rad > 0.0 {
            true => loaded.direction_after(direction, v * step_s),
            false => loaded.direction(*v),
        };
        loaded.dry_size_nm(*v) * direction + (loaded.offset_nm - law.offset_nm)
    });
    let along: Vec<f64> = along.collect();
    match motion.cutoff_hz {
        Some(cutoff_hz) => LowPass::butterworth4(cutoff_hz, motion.rate_hz)?.zero_phase(&along),
        None => Ok(along),
    }
}

/// Finds the reversals of a joint with a travel of at least [`WINDOW_RAD`] in one direction before and after.
fn reversals(motions: &[Motion], joint: usize) -> Vec<Reversal> {
    let mut all = Vec::new();
    for (number, motion) in motions.iter().enumerate() {
        let (q, qd) = (motion.q.column(joint), motion.qd.column(joint));
        for at in 1..motion.samples() {
            if qd[at - 1] * qd[at] >= 0.0 {
                continue;
            }
            let near = |i: &usize| (q[*i] - q[at]).abs() < WINDOW_RAD;
            let before = (0..at).rev().take_while(near).count();
            let after = (at..motion.samples()).take_while(near).count();
            let (from, to) = (at - before, at + after);
            let whole = from > 0 && to < motion.samples();
            let steady = (from + 1..to).filter(|i| qd[*i - 1] * qd[*i] < 0.0).count() == 1;
            if whole && steady && to - from >= SAMPLES && motion.used(at, joint) {
                all.push(Reversal {
                    motion: number,
                    samples: from..to,
                });
            }
        }
    }
    all
}
