//! Normal equations of one joint: the information that its samples contain about the unknowns.

use crate::prior::unknowns::{ALL, COULOMB, OFFSET};
use crate::rows::Row;
use nalgebra::{DMatrix, DVector};

/// Sums over samples, each divided by the variance of its noise.
#[derive(Clone, Debug)]
pub struct Information {
    /// `sum a a^T`, (ALL, ALL).
    pub gram: DMatrix<f64>,
    /// `sum a e`.
    pub right: DVector<f64>,
    /// `sum e^2`.
    pub square: f64,
    /// Sum of the weights.
    pub weight: f64,
    /// Sum of the weights of the samples in which the joint creeps on.
    pub creeping_weight: f64,
}

impl Information {
    /// Creates the sums of no samples.
    pub fn empty() -> Information {
        Information {
            gram: DMatrix::zeros(ALL, ALL),
            right: DVector::zeros(ALL),
            square: 0.0,
            weight: 0.0,
            creeping_weight: 0.0,
        }
    }

    /// Returns whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.weight == 0.0
    }

    /// Returns the weight of the samples in the direction of motion that has less of it; less, if dry friction has not turned
    /// completely in some samples. The columns are the direction, -1 to 1, and one.
    pub fn weight_in_rarer_direction(&self) -> f64 {
        0.5 * (self.gram[(COULOMB, COULOMB)] - self.gram[(COULOMB, OFFSET)].abs())
    }

    /// Adds an equation of a joint that creeps on, or not.
    pub fn add(&mut self, row: &Row, weight: f64, creeps: bool) {
        let a = DVector::from_column_slice(&row.columns);
        self.gram.ger(weight, &a, &a, 1.0);
        self.right.axpy(weight * row.error_nm, &a, 1.0);
        self.square += weight * row.error_nm * row.error_nm;
        self.weight += weight;
        if creeps {
            self.creeping_weight += weight;
        }
    }

    /// Adds the samples of `other`.
    pub fn merge(&mut self, other: &Information) {
        self.gram += &other.gram;
        self.right += &other.right;
        self.square += other.square;
        self.weight += other.weight;
        self.creeping_weight += other.creeping_weight;
    }

    /// Multiplies the weight of all samples by `kept`.
    pub fn forget(&mut self, kept: f64) {
        self.gram *= kept;
        self.right *= kept;
        self.square *= kept;
        self.weight *= kept;
        self.creeping_weight *= kept;
    }

    /// Returns the mean square of the error that remains with these `unknowns` \[N^2 m^2\].
    pub fn mean_square(&self, unknowns: &DVector<f64>) -> f64 {
        let sum =
            self.square - 2.0 * self.right.dot(unknowns) + unknowns.dot(&(&self.gram * unknowns));
        (sum / self.weight).max(0.0)
    }

    /// Returns the mean square of the torque uncertainty that follows from the `covariance` of the unknowns \[N^2 m^2\].
    pub fn mean_variance(&self, covariance: &DMatrix<f64>) -> f64 {
        (self.gram.component_mul(covariance)).sum() / self.weight
    }
}
