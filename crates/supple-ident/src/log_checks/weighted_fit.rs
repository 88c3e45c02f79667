//! Fast fit of a model with free link parameters, with which the checks of a log compare corrections.
//!
//! The fit is a weighted least-squares problem over all joints. Its unknowns are viscous and Coulomb friction and rotor inertia
//! (not negative), torque offsets, and the parameters of the links with a wide prior about the given arm. It takes milliseconds;
//! the identified model comes from [`crate::procedure`].

use crate::cancellation::Cancellation;
use crate::columns::{Column, Columns, FrictionColumns};
use crate::error::IdentError;
use crate::model;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::{Cholesky, DMatrix, DVector};
use supple_core::{Arm, Vector};

/// Standard deviation of the prior of a link's parameters, relative to the mass of the link or, if greater, to a tenth of
/// the mean mass.
const PRIOR: f64 = 0.7;
/// Standard deviation of the prior for the comparison of gravity torques, which a short log determines badly.
const TIGHT_PRIOR: f64 = 0.1;
/// Length by which first moments are scaled, as a fraction of the arm's reach.
const LENGTH: f64 = 0.15;
/// Number of iterations of the weights.
const ITERATIONS: usize = 4;
/// Minimum relative residual of a joint; smaller values are rounding errors and are replaced by it.
const MIN_RELATIVE_RESIDUAL: f64 = 2e-3;

/// Arm, columns, prior, and the flag that ends the fits.
pub(crate) struct FitContext<'a, const N: usize> {
    pub arm: &'a Arm<N>,
    pub columns: Columns,
    couplings: Vec<(usize, usize)>,
    cancellation: &'a Cancellation,
    prior: DVector<f64>,
    /// One over the standard deviation of the prior.
    stiffness: DVector<f64>,
}

/// Result of the fit to a motion.
#[derive(Clone, Debug)]
pub(crate) struct FitResult {
    /// RMS residual of each identified joint over the deviation of its torque.
    pub relative: Vec<f64>,
    /// Parameters.
    pub x: DVector<f64>,
}

impl FitResult {
    /// Returns the mean over the joints of the logarithm of the relative residual, by which corrections are compared.
    pub fn score(&self) -> f64 {
        let sum: f64 = self
            .relative
            .iter()
            .map(|e| e.max(MIN_RELATIVE_RESIDUAL).ln())
            .sum();
        sum / self.relative.len() as f64
    }
}

/// `[A b]' [A b]` of each identified joint, with the deviation of its torque and the number of samples.
#[derive(Clone)]
pub(crate) struct GramMatrices {
    of_joint: Vec<(DMatrix<f64>, f64)>,
    samples: usize,
}

impl GramMatrices {
    /// Returns the matrices of the samples of both motions together.
    pub fn plus(mut self, other: GramMatrices) -> GramMatrices {
        for ((gram, deviation), (added, other_deviation)) in
            self.of_joint.iter_mut().zip(other.of_joint)
        {
            *gram += added;
            *deviation = deviation.max(other_deviation);
        }
        self.samples += other.samples;
        self
    }

    /// Sums of squares of each joint's residual and torque.
    pub fn errors(&self, x: &DVector<f64>) -> Vec<[f64; 2]> {
        let of_joint = |(gram, _): &(DMatrix<f64>, f64)| {
            let mut full = DVector::zeros(x.len() + 1);
            full.rows_mut(0, x.len()).copy_from(x);
            full[x.len()] = -1.0;
            let error = (gram * &full).dot(&full).max(0.0);
            [error, gram[(x.len(), x.len())]]
        };
        self.of_joint.iter().map(of_joint).collect()
    }

    /// Returns the matrices of the same motion with the torque of one joint multiplied by a factor.
    pub fn scaled(&self, row: usize, factor: f64) -> GramMatrices {
        let mut of_joint = self.of_joint.clone();
        let (gram, deviation) = &mut of_joint[row];
        let last = gram.nrows() - 1;
        gram.row_mut(last).scale_mut(factor);
        gram.column_mut(last).scale_mut(factor);
        *deviation *= factor.abs();
        GramMatrices {
            of_joint,
            samples: self.samples,
        }
    }
}

impl<'a, const N: usize> FitContext<'a, N> {
    pub fn new(
        arm: &'a Arm<N>,
        identified_joints: &[usize],
        couplings: &[(usize, usize)],
        cancellation: &'a Cancellation,
    ) -> Result<Self, IdentError> {
        Self::with_prior(arm, identified_joints, couplings, PRIOR, cancellation)
    }

    /// Does the same as [`FitContext::new`], with another relative deviation of the links' parameters.
    fn with_prior(
        arm: &'a Arm<N>,
        identified_joints: &[usize],
        couplings: &[(usize, usize)],
        prior_deviation: f64,
        cancellation: &'a Cancellation,
    ) -> Result<Self, IdentError> {
        let columns = Columns::new(
            N,
            identified_joints,
            true,
            FrictionColumns::COULOMB_AND_OFFSET,
            couplings,
        )?;
        let prior = model::prior(arm, &columns);
        let mass = |k: usize| prior[10 * k];
        let mean_mass = (0..N).map(mass).sum::<f64>() / N as f64;
        let reach: f64 = (1..N)
            .map(|k| arm.parent_from_joint(k).translation.norm())
            .sum::<f64>()
            + arm.joint_from_tip().translation.norm();
        let length = (LENGTH * reach).max(0.02);
        let stiffness = columns.list().iter().map(|column| match *column {
            Column::Link { link, entry } => {
                let scale = prior_deviation * mass(link).max(0.1 * mean_mass);
                let unit = match entry {
                    0 => scale,
                    1..=3 => scale * length,
                    _ => scale * length * length,
                };
                1.0 / unit.max(1e-9)
            }
            _ => 0.0,
        });
        let stiffness = DVector::from_iterator(columns.len(), stiffness);
        Ok(FitContext {
            arm,
            columns,
            couplings: couplings.to_vec(),
            cancellation,
            prior,
            stiffness,
        })
    }

    /// Returns the same arm and columns with a narrow prior about the given arm.
    pub fn with_tight_prior(&self) -> Result<Self, IdentError> {
        Self::with_prior(
            self.arm,
            self.columns.identified_joints(),
            &self.couplings,
            TIGHT_PRIOR,
            self.cancellation,
        )
    }

    /// Every fit begins with these matrices, so a cancellation takes effect here.
    pub fn grams(&self, motion: &Motion) -> Result<GramMatrices, IdentError> {
        self.cancellation.check()?;
        let joints = joint_rows(self.arm, &self.columns, motion)?;
        let width = self.columns.len();
        let of_joint = joints.iter().map(|rows| {
            let mut all = DMatrix::zeros(rows.b.len(), width + 1);
            all.columns_mut(0, width).copy_from(&rows.a);
            all.set_column(width, &rows.b);
            let mean = rows.b.mean();
            let deviation = rows.b.map(|b| (b - mean).powi(2)).mean().sqrt();
            (all.tr_mul(&all), deviation.max(f64::MIN_POSITIVE))
        });
        Ok(GramMatrices {
            of_joint: of_joint.collect(),
            samples: motion.samples(),
        })
    }

    pub fn fit(&self, motion: &Motion) -> Result<FitResult, IdentError> {
        Ok(self.solve(&self.grams(motion)?))
    }

    /// Does the same as [`FitContext::fit`], from Gram matrices.
    pub fn solve(&self, grams: &GramMatrices) -> FitResult {
        let width = self.columns.len();
        let joints = grams.of_joint.len();
        let rows = grams.samples as f64;
        let mut noise: Vec<f64> = grams.of_joint.iter().map(|(_, d)| 0.2 * d).collect();
        let mut x = self.prior.clone();
        let signed = |column: &Column| {
            matches!(
                column,
                Column::Rotor(_)
                    | Column::Viscous(_)
                    | Column::Coulomb(_)
                    | Column::CoupledRotor(..)
                    | Column::CoupledViscous(..)
                    | Column::CoupledCoulomb(..)
            )
        };
        let mut relative = vec![1.0; joints];
        for _ in 0..ITERATIONS {
            let mut normal = DMatrix::zeros(width, width);
            let mut right = DVector::zeros(width);
            for ((gram, _), noise) in grams.of_joint.iter().zip(&noise) {
                let weight = 1.0 / (noise * noise);
                normal += gram.view((0, 0), (width, width)) * weight;
                right += gram.view((0, width), (width, 1)).column(0) * weight;
            }
            for i in 0..width {
                let k = self.stiffness[i].powi(2);
                // Columns that the motion does not excite are kept regular.
                let tiny = 1e-9 * normal[(i, i)].max(1e-6);
                normal[(i, i)] += k + tiny;
                right[i] += k * self.prior[i];
            }
            let mut zero: Vec<usize> = Vec::new();
            for _ in 0..4 {
                let Some(found) = solve_without(&normal, &right, &zero) else {
                    break;
                };
                x = found;
                let negative = (0..width)
                    .filter(|i| signed(&self.columns.list()[*i]) && x[*i] < 0.0)
                    .collect::<Vec<_>>();
                if negative.is_empty() {
                    break;
                }
                zero.extend(negative);
            }
            for (row, (gram, deviation)) in grams.of_joint.iter().enumerate() {
                let mut full = DVector::zeros(width + 1);
                full.rows_mut(0, width).copy_from(&x);
                full[width] = -1.0;
                let error = (gram * &full).dot(&full).max(0.0);
                let rms = (error / rows).sqrt();
                relative[row] = rms / deviation;
                noise[row] = rms.max(MIN_RELATIVE_RESIDUAL * deviation);
            }
        }
        FitResult { relative, x }
    }

    /// Returns the gravity torques of the parameters `x` and of the given arm at a pose.
    pub fn gravities(&self, x: &DVector<f64>, q: &Vector<N>) -> [Vector<N>; 2] {
        let still = Vector::zeros();
        let regressor = supple_core::dynamics::regressor(self.arm, q, &still, &still);
        let times = |p: &DVector<f64>| {
            supple_core::dynamics::regressor_times(&regressor, &model::link_parameters::<N>(p))
        };
        [times(x), times(&self.prior)]
    }
}

/// Returns the solution of the normal equations with some unknowns at zero.
fn solve_without(
    normal: &DMatrix<f64>,
    right: &DVector<f64>,
    zero: &[usize],
) -> Option<DVector<f64>> {
    let mut normal = normal.clone();
    let mut right = right.clone();
    for &i in zero {
        normal.row_mut(i).fill(0.0);
        normal.column_mut(i).fill(0.0);
        normal[(i, i)] = 1.0;
        right[i] = 0.0;
    }
    // Scale to a unit diagonal, for which the Cholesky decomposition is more accurate.
    let scale = normal
        .diagonal()
        .map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        normal[(i, j)] * scale[i] * scale[j]
    });
    let found = Cholesky::new(scaled)?.solve(&right.component_mul(&scale));
    Some(found.component_mul(&scale))
}
