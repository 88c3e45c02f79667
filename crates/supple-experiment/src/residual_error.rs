//! Tracking error that the residuals of a model imply, from logs that were not fitted.
//!
//! A model whose torques are wrong by `r` lets the tip deviate until the stiffness holds the difference: by `F / K` with
//! the force `F` at the tip that has the torques `J' F = r` at the joints that move the tip. What the residual is made of
//! does not matter: noise averages out over the time that the tip needs to move, structure over joint angle and direction
//! does not. So the residuals are averaged over cells of angle and direction of each joint first; what the cells keep
//! beyond their own noise counts.
//!
//! The factor to the upper bound is that which covers nine tenths of the calibrations of simulated arms with random effects
//! of real ones (`docs/verdict.md`).

use crate::start::active_joints;
use nalgebra::DMatrix;
use serde::Serialize;
use supple_core::dynamics::jacobian;
use supple_core::{Config, Vector};
use supple_ident::estimate::pseudo_inverse;
use supple_ident::{DMatrix as Matrix, Motion};

/// Cells of angle over the range of a joint.
const CELLS: usize = 6;
/// Fewest samples of a cell.
const MIN_SAMPLES: usize = 8;
/// Samples that one independent one stands for: residuals are smooth.
const CORRELATED_S: f64 = 0.24;
/// Number of poses at which forces are computed.
const POSES: usize = 200;
/// Upper bound over the estimate.
pub const UPPER_FACTOR: f64 = 1.0;
/// Lower bound over the estimate.
pub const LOWER_FACTOR: f64 = 0.1;

/// Interval that contains the tracking error in nine of ten cases.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorInterval {
    /// Lower bound \[m\].
    pub lower_m: f64,
    /// Upper bound \[m\].
    pub upper_m: f64,
    /// Log and joint that contribute most: index of the log, joint.
    pub worst: (usize, usize),
    /// Residual of each moving joint that counts, in the worst log \[N m\].
    pub structure_nm: Vec<f64>,
}

/// RMS over cells of angle and direction of the mean residual, without what noise leaves of it \[N m\].
///
/// `residual` belongs to joint `joint` and has one value for each sample of `motion`.
pub fn structure_nm(motion: &Motion, joint: usize, residual: &[f64]) -> f64 {
    let angles = motion.q.column(joint);
    let (low, high) = (angles.min(), angles.max());
    let width = ((high - low) / CELLS as f64).max(f64::MIN_POSITIVE);
    let mut cells = vec![[0.0_f64; 3]; 2 * CELLS];
    for (i, r) in residual.iter().enumerate() {
        if !motion.used(i, joint) {
            continue;
        }
        let cell = (((angles[i] - low) / width) as usize).min(CELLS - 1);
        let forward = usize::from(motion.qd[(i, joint)] > 0.0);
        let sums = &mut cells[2 * cell + forward];
        sums[0] += 1.0;
        sums[1] += r;
        sums[2] += r * r;
    }
    let independent = 1.0 / (CORRELATED_S * motion.rate_hz).max(1.0);
    let (mut count, mut square) = (0.0, 0.0);
    for [n, sum, squares] in cells {
        if n >= MIN_SAMPLES as f64 {
            let mean = sum / n;
            let noise = (squares / n - mean * mean).max(0.0) / (n * independent).max(1.0);
            count += n;
            square += n * (mean * mean - noise).max(0.0);
        }
    }
    (square / f64::max(count, 1.0)).sqrt()
}

/// The interval of the tracking error at a stiffness, from held-out motions and their residuals, (samples, moving joints);
/// the worst motion decides. `None` without motions, or if no joint that moves the tip is among `moving`.
pub fn error_interval<const N: usize>(
    config: &Config<N>,
    moving: &[usize],
    held_out: &[(&Motion, &Matrix<f64>)],
    stiffness_n_per_m: f64,
) -> Option<ErrorInterval> {
    let mut worst: Option<ErrorInterval> = None;
    for (log, (motion, residuals)) in held_out.iter().enumerate() {
        let structure: Vec<f64> = moving
            .iter()
            .enumerate()
            .map(|(row, &joint)| {
                structure_nm(
                    motion,
                    joint,
                    residuals.column(row).clone_owned().as_slice(),
                )
            })
            .collect();
        let lever = forces_per_nm(config, moving, motion)?;
        let parts: Vec<f64> = structure
            .iter()
            .zip(&lever)
            .map(|(r, l)| (r * l).powi(2))
            .collect();
        let error_m = parts.iter().sum::<f64>().sqrt() / stiffness_n_per_m;
        let (row, _) = parts.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        let interval = ErrorInterval {
            lower_m: LOWER_FACTOR * error_m,
            upper_m: UPPER_FACTOR * error_m,
            worst: (log, moving[row]),
            structure_nm: structure,
        };
        if worst.as_ref().is_none_or(|w| interval.upper_m > w.upper_m) {
            worst = Some(interval);
        }
    }
    worst
}

/// Force at the tip for each newton metre at a moving joint, the median over poses \[1/m\]; zero for joints outside the
/// law.
fn forces_per_nm<const N: usize>(
    config: &Config<N>,
    moving: &[usize],
    motion: &Motion,
) -> Option<Vec<f64>> {
    let active = active_joints(config);
    let every = (motion.samples() / POSES).max(1);
    let mut all = vec![Vec::new(); active.len()];
    for i in (0..motion.samples()).step_by(every) {
        let q = Vector::<N>::from_fn(|j, _| motion.q[(i, j)]);
        let columns = jacobian(&config.arm, &q);
        let transposed = DMatrix::from_fn(active.len(), 3, |a, axis| columns[(axis, active[a])]);
        let Ok(inverse) = pseudo_inverse(&transposed, 1e-6) else {
            continue;
        };
        for (a, sizes) in all.iter_mut().enumerate() {
            sizes.push(inverse.column(a).norm());
        }
    }
    if all.iter().any(Vec::is_empty) || active.is_empty() {
        return None;
    }
    let median = |sizes: &mut Vec<f64>| {
        sizes.sort_by(f64::total_cmp);
        sizes[sizes.len() / 2]
    };
    let medians: Vec<f64> = all.iter_mut().map(median).collect();
    let lever = |joint: &usize| {
        let place = active.iter().position(|j| j == joint);
        place.map_or(0.0, |place| medians[place])
    };
    Some(moving.iter().map(lever).collect())
}
