//! Torque ripple: harmonics of the motor angle in the residual of a model, best identified at constant low
//! speed.
//!
//! The difference between received and commanded joint torque, transformed to the motors by `m2jp^T`, is fitted
//! by sines and cosines of the motor angle, constant (cogging) and in proportion to the motor's torque (a torque constant
//! that varies with the angle). Nuisance columns (constant, direction, speed, angle) absorb other slow residuals and are
//! discarded. All columns pass the filter of the torques. The largest significant harmonics are kept.

use crate::error::{IdentError, positive};
use crate::filter::LowPass;
use crate::fit::Fit;
use crate::joint_rows::STEADY_SLIDING_RAD;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::{DMatrix, DVector};
use supple_core::math::{cos, sin};
use supple_core::ripple::{Harmonic, LINES, MAX_SHARE};
use supple_core::{Matrix, RippleTable, Vector};

/// Minimum amplitude of a significant harmonic, in standard deviations.
const SIGNIFICANT: f64 = 4.0;
/// Minimum amplitude of a significant harmonic proportional to the torque, in standard deviations.
const SIGNIFICANT_SHARE: f64 = 3.0;
/// Lowest harmonic of a torque constant: motors have at least two pole pairs, and at one period per revolution an error of
/// the friction over the angle cannot be distinguished from it.
const FIRST_OF_CONSTANT: u32 = 2;
/// Number of nuisance columns.
const NUISANCE: usize = 5;

/// Options of the ripple fit.
#[derive(Clone, Debug, PartialEq)]
pub struct RippleSearch {
    /// Harmonics of a motor revolution, each 1 or more.
    pub harmonics: Vec<u32>,
    /// Faster samples are excluded, since the filter removes their ripple \[rad/s\].
    pub fast_rad_per_s: f64,
}

impl Default for RippleSearch {
    /// Returns default options: the first eight harmonics, joints below 0.2 rad/s.
    fn default() -> Self {
        RippleSearch {
            harmonics: (1..=8).collect(),
            fast_rad_per_s: 0.2,
        }
    }
}

/// Identifies the ripple of every motor from the residual of `fit` over `motions`. All joints must have been identified,
/// because a motor may drive several joints.
///
/// # Errors
/// Options out of range; fewer slow samples than columns.
pub fn fit_ripple<const N: usize>(
    fit: &Fit<N>,
    motions: &[Motion],
    motor_from_joint: &Matrix<N, N>,
    search: &RippleSearch,
) -> Result<[RippleTable; N], IdentError> {
    positive("fast_rad_per_s", search.fast_rad_per_s)?;
    if fit.columns.identified_joints().len() != N {
        return Err(crate::error::shape_error(
            "moving",
            format!("all {N} joints, since motors may share them"),
            format!("{:?}", fit.columns.identified_joints()),
        ));
    }
    let mut tables = [RippleTable::NONE; N];
    let width = 4 * search.harmonics.len() + NUISANCE;
    for (motor, table) in tables.iter_mut().enumerate() {
        let mut all = Vec::new();
        for motion in motions {
            all.push(motor_rows(fit, motion, motor_from_joint, motor, search)?);
        }
        let samples: usize = all.iter().map(|(a, _)| a.nrows()).sum();
        if samples < 2 * width {
            return Err(IdentError::Singular {
                problem: format!("motor {motor} has {samples} slow samples, {width} columns"),
                remedy: "record slow motion of every joint",
            });
        }
        let (mut a, mut b) = (DMatrix::zeros(samples, width), DVector::zeros(samples));
        let mut at = 0;
        for (rows, torques) in &all {
            a.rows_mut(at, rows.nrows()).copy_from(rows);
            b.rows_mut(at, rows.nrows()).copy_from(torques);
            at += rows.nrows();
        }
        let independent_fraction = motions
            .iter()
            .map(|m| m.independent_fraction)
            .fold(1.0, f64::min);
        *table = significant(&a, &b, search, independent_fraction)?;
    }
    Ok(tables)
}

/// Returns columns and torques of one motor.
fn motor_rows<const N: usize>(
    fit: &Fit<N>,
    motion: &Motion,
    motor_from_joint: &Matrix<N, N>,
    motor: usize,
    search: &RippleSearch,
) -> Result<(DMatrix<f64>, DVector<f64>), IdentError> {
    let joints = joint_rows(fit.nominal(), &fit.columns, motion)?;
    let joint_from_motor = motor_from_joint
        .try_inverse()
        .unwrap_or_else(Matrix::identity);
    let samples = motion.samples();
    // Required torque minus commanded torque.
    let missing: Vec<DVector<f64>> = joints.iter().map(|j| &j.a * &fit.x - &j.b).collect();
    let torque = DVector::from_fn(samples, |i, _| {
        (0..N)
            .map(|j| joint_from_motor[(j, motor)] * missing[j][i])
            .sum()
    });
    let angle = |i: usize| -> f64 {
        let q = Vector::<N>::from_fn(|j, _| motion.q[(i, j)]);
        (motor_from_joint * q)[motor]
    };
    let speed = |i: usize| -> f64 {
        let qd = Vector::<N>::from_fn(|j, _| motion.qd[(i, j)]);
        (motor_from_joint * qd)[motor]
    };
    let commanded = |i: usize| -> f64 {
        (0..N)
            .map(|j| joint_from_motor[(j, motor)] * joints[j].b[i])
            .sum()
    };
    let lines = search.harmonics.len();
    let mut columns = DMatrix::zeros(samples, 4 * lines + NUISANCE);
    for i in 0..samples {
        let (p, v, tau) = (angle(i), speed(i), commanded(i));
        for (k, harmonic) in search.harmonics.iter().enumerate() {
            let phase = f64::from(*harmonic) * p;
            columns[(i, 2 * k)] = sin(phase);
            columns[(i, 2 * k + 1)] = cos(phase);
            columns[(i, 2 * (lines + k))] = tau * sin(phase);
            columns[(i, 2 * (lines + k) + 1)] = tau * cos(phase);
        }
        let rest = [1.0, v.signum(), v, p, p * p];
        for (k, value) in rest.into_iter().enumerate() {
            columns[(i, 4 * lines + k)] = value;
        }
    }
    if let Some(cutoff_hz) = motion.cutoff_hz {
        columns = LowPass::butterworth4(cutoff_hz, motion.rate_hz)?.zero_phase_columns(&columns)?;
    }
    // Uses samples in which all joints that the motor drives are in slow, steady sliding.
    let slides = |i: usize| {
        (0..N)
            .filter(|j| joint_from_motor[(*j, motor)] != 0.0)
            .all(|j| {
                joints[j].travel_since_reversal_rad[i] >= STEADY_SLIDING_RAD
                    && joints[j].speed[i] <= search.fast_rad_per_s
            })
    };
    let kept: Vec<usize> = (0..samples).filter(|i| slides(*i)).collect();
    Ok((columns.select_rows(&kept), torque.select_rows(&kept)))
}

/// A least-squares solution with its standard deviations.
struct Solution {
    x: Vec<f64>,
    deviation: Vec<f64>,
}

fn least_squares(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    independent_fraction: f64,
) -> Result<Solution, IdentError> {
    let singular = || IdentError::Singular {
        problem: "the slow motion does not distinguish the harmonics".to_owned(),
        remedy: "move every joint over several turns of its motor",
    };
    // Columns are scaled to unit length, so that squared angles do not dominate.
    let lengths: Vec<f64> = a
        .column_iter()
        .map(|c| c.norm().max(f64::MIN_POSITIVE))
        .collect();
    let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] / lengths[j]);
    let mut gram = scaled.tr_mul(&scaled);
    for i in 0..gram.nrows() {
        gram[(i, i)] += 1e-12;
    }
    let root = nalgebra::Cholesky::new(gram).ok_or_else(singular)?;
    let solution = root.solve(&scaled.tr_mul(b));
    let freedom = (a.nrows() - a.ncols()) as f64 * independent_fraction;
    let noise = (&scaled * &solution - b).norm() / freedom.max(1.0).sqrt();
    let inverse = root.inverse();
    let columns = 0..a.ncols();
    Ok(Solution {
        x: columns.clone().map(|j| solution[j] / lengths[j]).collect(),
        deviation: columns
            .map(|j| noise * inverse[(j, j)].sqrt() / lengths[j])
            .collect(),
    })
}

/// Returns sine, cosine and amplitude of the harmonic whose columns begin at `first`, and the amplitude in standard deviations.
fn harmonic_at(solution: &Solution, first: usize) -> (f64, f64, f64, f64) {
    let (sine, cosine) = (solution.x[first], solution.x[first + 1]);
    let deviation = solution.deviation[first].max(solution.deviation[first + 1]);
    let amplitude = sine.hypot(cosine);
    (sine, cosine, amplitude, amplitude / deviation)
}

/// Returns the largest significant harmonics. Harmonics proportional to the torque are tested first, in a fit with all columns;
/// insignificant ones are removed, because a nearly constant torque does not distinguish them from cogging.
fn significant(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    search: &RippleSearch,
    independent_fraction: f64,
) -> Result<RippleTable, IdentError> {
    let lines = search.harmonics.len();
    let all = least_squares(a, b, independent_fraction)?;
    let scaling: Vec<usize> = (0..lines)
        .filter(|k| {
            let (sine, cosine, _, deviations) = harmonic_at(&all, 2 * (lines + k));
            search.harmonics[*k] >= FIRST_OF_CONSTANT
                && deviations > SIGNIFICANT_SHARE
                && sine.abs().max(cosine.abs()) <= MAX_SHARE
        })
        .collect();
    let kept: Vec<usize> = (0..2 * lines)
        .chain(
            scaling
                .iter()
                .flat_map(|k| [2 * (lines + k), 2 * (lines + k) + 1]),
        )
        .chain(4 * lines..a.ncols())
        .collect();
    let found = least_squares(&a.select_columns(&kept), b, independent_fraction)?;
    let mut harmonics: Vec<(f64, Harmonic)> = Vec::new();
    for (k, harmonic) in search.harmonics.iter().enumerate() {
        let (sine_nm, cosine_nm, amplitude_nm, deviations) = harmonic_at(&found, 2 * k);
        let mut line = Harmonic {
            harmonic: *harmonic,
            sine_nm,
            cosine_nm,
            ..Harmonic::default()
        };
        let mut size_nm = amplitude_nm;
        if let Some(at) = scaling.iter().position(|of| *of == k) {
            let first = 2 * (lines + at);
            let (sine, cosine, amplitude, _) = harmonic_at(&found, first);
            line.sine_share = sine.clamp(-MAX_SHARE, MAX_SHARE);
            line.cosine_share = cosine.clamp(-MAX_SHARE, MAX_SHARE);
            let torques = pair_norm(a, 2 * (lines + k)) / pair_norm(a, 2 * k);
            size_nm += amplitude * torques;
        } else if deviations.is_nan() || deviations <= SIGNIFICANT {
            continue;
        }
        harmonics.push((size_nm, line));
    }
    harmonics.sort_by(|x, y| y.0.total_cmp(&x.0));
    harmonics.truncate(LINES);
    let harmonics: Vec<Harmonic> = harmonics.into_iter().map(|(_, line)| line).collect();
    RippleTable::new(&harmonics).ok_or_else(|| IdentError::Singular {
        problem: "a harmonic of the ripple is not finite".to_owned(),
        remedy: "move every joint over several turns of its motor",
    })
}

/// Returns the norm of two adjacent columns together.
fn pair_norm(a: &DMatrix<f64>, first: usize) -> f64 {
    let square = a.columns(first, 2).norm_squared();
    square.sqrt().max(f64::MIN_POSITIVE)
}
