//! Torque of each motor over what it was commanded, relative to the other motors.
//!
//! ```text
//! minimise sum_j |A_j x exp(-s_j) - b_j|^2 / n_j^2 + f sum_j (s_j / 0.10)^2,   sum_j s_j = 0
//! ```
//!
//! `b_j` are commanded torques, `exp(s_j)` is the scale of motor `j`, `x` the parameters of the links and joints, `f` the
//! number of samples per independent one. Links act on several joints: their parameters cannot take up scales that
//! differ. A common scale of all motors is taken up by masses, inertias and friction; only a known weight would tell it, so
//! the geometric mean of the scales is one. Solved by variable projection: `x` is eliminated, Gauss-Newton on `s`.

use crate::base::{RANK_TOLERANCE, pivot_order};
use crate::columns::Columns;
use crate::error::{IdentError, shape_error};
use crate::estimate::{nearest, noise_nm, weighted_least_squares};
use crate::model;
use crate::motion::Motion;
use crate::options::Options;
use crate::qr_reduction::ReducedSystem;
use crate::regressor::joint_rows;
use nalgebra::{Cholesky, DMatrix, DVector};
use supple_core::Arm;

/// Standard deviation of the prior of a scale's logarithm: motors of one make.
const PRIOR: f64 = 0.10;
/// Maximum number of Gauss-Newton steps, and the change that ends them.
const STEPS: (usize, f64) = (30, 1e-6);

/// Relative torque scales.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueScales {
    /// Torque over command of each moving joint's motor; the geometric mean is one.
    pub scale: Vec<f64>,
    /// Standard deviation of the logarithm of each; that of the prior where the motion tells nothing.
    pub deviation: Vec<f64>,
}

/// Estimates the scales from `motions` of an arm whose motors move one joint each.
///
/// # Errors
/// Invalid columns or shapes; singular data.
pub fn torque_scales<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    moving: &[usize],
    options: &Options,
) -> Result<TorqueScales, IdentError> {
    let columns = Columns::new(
        N,
        moving,
        options.rotor,
        options.friction,
        &options.couplings,
    )?;
    let mut blocks = vec![ReducedSystem::empty(columns.len()); moving.len()];
    for motion in motions {
        for (block, rows) in blocks
            .iter_mut()
            .zip(joint_rows(nominal, &columns, motion)?)
        {
            block.add(&rows.block(options.slow_rad_per_s), 1.0);
        }
    }
    if blocks.iter().any(|block| block.rows() == 0) {
        return Err(shape_error("log", "samples of every joint", "none"));
    }
    let fractions = motions.iter().map(|motion| motion.independent_fraction);
    let per_independent = 1.0 / fractions.fold(1.0, f64::min);
    Problem {
        blocks,
        prior: model::prior(nominal, &columns),
        prior_weight: per_independent / (PRIOR * PRIOR),
        per_independent,
    }
    .solve()
}

struct Problem {
    blocks: Vec<ReducedSystem>,
    prior: DVector<f64>,
    prior_weight: f64,
    per_independent: f64,
}

impl Problem {
    fn solve(&self) -> Result<TorqueScales, IdentError> {
        let joints = self.blocks.len();
        let (x, mut noise) = weighted_least_squares(&self.blocks, &self.prior)?;
        noise.clone_from(&noise_nm(&self.blocks, &x));
        let mut log_scale = DVector::zeros(joints);
        let mut information = DMatrix::identity(joints, joints);
        let (steps, settled) = STEPS;
        for _ in 0..steps {
            let (gradient, hessian) = self.normal(&log_scale, &mut noise)?;
            information = hessian;
            // The sum of the logarithms stays zero.
            let gauge = DMatrix::from_element(joints, joints, information.trace());
            let bound = &information + gauge;
            let Some(root) = Cholesky::new(bound) else {
                return Err(shape_error("log", "finite torques", "none"));
            };
            let step = root.solve(&gradient);
            log_scale += &step;
            let mean = log_scale.mean();
            log_scale.add_scalar_mut(-mean);
            if step.amax() < settled {
                break;
            }
        }
        let gauge = DMatrix::from_element(joints, joints, information.trace());
        let covariance = Cholesky::new(information + gauge).map(|root| root.inverse());
        let deviation = |j: usize| {
            let variance = covariance.as_ref().map_or(0.0, |all| all[(j, j)]);
            (variance * self.per_independent).sqrt()
        };
        Ok(TorqueScales {
            scale: log_scale.iter().map(|s| s.exp()).collect(),
            deviation: (0..joints).map(deviation).collect(),
        })
    }

    /// Descent direction and Gauss-Newton matrix of the problem without `x`, prior included. Updates the noise.
    fn normal(
        &self,
        log_scale: &DVector<f64>,
        noise: &mut [f64],
    ) -> Result<(DVector<f64>, DMatrix<f64>), IdentError> {
        let joints = self.blocks.len();
        let unknowns = self.prior.len();
        let scaled = |j: usize| self.blocks[j].a() * (-log_scale[j]).exp();
        let rows: usize = self.blocks.iter().map(|block| block.a().nrows()).sum();
        let mut stacked = DMatrix::zeros(rows, unknowns + 1);
        let mut starts = Vec::new();
        let mut row = 0;
        for (j, noise) in noise.iter().enumerate() {
            let (a, b) = (scaled(j) / *noise, self.blocks[j].b() / *noise);
            stacked
                .view_mut((row, 0), (a.nrows(), unknowns))
                .copy_from(&a);
            stacked
                .view_mut((row, unknowns), (b.len(), 1))
                .copy_from(&b);
            starts.push(row);
            row += a.nrows();
        }
        starts.push(row);
        let mut system = ReducedSystem::empty(unknowns);
        system.append(&stacked, rows);
        let x = nearest(&system, &self.prior)?;
        let a = stacked.columns(0, unknowns).into_owned();
        let explained = &a * &x;
        let residual = stacked.column(unknowns) - &explained;
        let mut slopes = DMatrix::zeros(rows, joints);
        for j in 0..joints {
            let part = starts[j]..starts[j + 1];
            slopes
                .view_mut((part.start, j), (part.len(), 1))
                .copy_from(&-explained.rows(part.start, part.len()));
        }
        // What a change of x could do as well tells nothing of the scales.
        let q = a.select_columns(&pivot_order(&a, RANK_TOLERANCE)).qr().q();
        let free = &slopes - &q * q.tr_mul(&slopes);
        let gradient = free.tr_mul(&residual) - log_scale * self.prior_weight;
        let hessian =
            free.tr_mul(&free) + DMatrix::from_diagonal_element(joints, joints, self.prior_weight);
        for j in 0..joints {
            let count = self.blocks[j].rows().max(1) as f64;
            let part = residual.rows(starts[j], starts[j + 1] - starts[j]);
            // The reduction keeps the part of the torques that no column explains in its last row.
            noise[j] *= (part.norm_squared() / count).sqrt().clamp(0.1, 10.0);
            noise[j] = noise[j].max(1e-9);
        }
        Ok((gradient, hessian))
    }
}
