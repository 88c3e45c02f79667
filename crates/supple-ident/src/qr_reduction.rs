//! Reduces a least-squares problem to its upper triangular factor by QR.
//!
//! `[A b] = Q R`: `|A x - b|` is `|R_1 x - r|` for every `x`, to rounding and without squaring the condition
//! number. Reduced systems of several joints and logs are weighted, stacked and reduced again.

use nalgebra::{DMatrix, DVector};

/// Number of rows per QR update.
pub(crate) const CHUNK: usize = 512;

/// `[R_1 r]` with at most as many rows as columns, and the number of rows that it represents.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedSystem {
    stacked: DMatrix<f64>,
    rows: usize,
}

impl ReducedSystem {
    /// Returns a system without rows, for `columns` unknowns.
    pub fn empty(columns: usize) -> ReducedSystem {
        ReducedSystem {
            stacked: DMatrix::zeros(0, columns + 1),
            rows: 0,
        }
    }

    /// Adds the rows of `other`, multiplied by `scale`.
    pub fn add(&mut self, other: &ReducedSystem, scale: f64) {
        self.append(&(&other.stacked * scale), other.rows);
    }

    /// Returns the number of rows of the original problem.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns `R_1`.
    pub fn a(&self) -> DMatrix<f64> {
        self.stacked.columns(0, self.unknowns()).into_owned()
    }

    /// Returns `r`.
    pub fn b(&self) -> DVector<f64> {
        self.stacked.column(self.unknowns()).into_owned()
    }

    /// Returns the same problem with some of its unknowns only.
    pub fn select(&self, unknowns: &[usize]) -> ReducedSystem {
        let columns: Vec<usize> = unknowns.iter().copied().chain([self.unknowns()]).collect();
        ReducedSystem {
            stacked: self.stacked.select_columns(&columns),
            rows: self.rows,
        }
    }

    /// Returns the problem with one unknown instead of the last ones, which are this multiple of `direction`.
    pub(crate) fn along(&self, direction: &[f64]) -> ReducedSystem {
        let first = self.unknowns() - direction.len();
        let last = self.stacked.columns(first, direction.len());
        let mut stacked = self.stacked.columns(0, first + 2).into_owned();
        stacked.set_column(first, &(last * DVector::from_column_slice(direction)));
        stacked.set_column(first + 1, &self.stacked.column(self.unknowns()));
        ReducedSystem {
            stacked,
            rows: self.rows,
        }
    }

    /// Returns `|A x - b|^2`.
    pub fn error_squared(&self, x: &DVector<f64>) -> f64 {
        (self.stacked.columns(0, self.unknowns()) * x - self.stacked.column(self.unknowns()))
            .norm_squared()
    }

    /// Returns `|b|^2`.
    pub fn torque_squared(&self) -> f64 {
        self.stacked.column(self.unknowns()).norm_squared()
    }

    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.stacked.ncols() - 1
    }

    pub(crate) fn append(&mut self, rows: &DMatrix<f64>, count: usize) {
        self.rows += count;
        let (above, width) = (self.stacked.nrows(), self.stacked.ncols());
        let mut all = DMatrix::zeros(above + rows.nrows(), width);
        all.rows_mut(0, above).copy_from(&self.stacked);
        all.rows_mut(above, rows.nrows()).copy_from(rows);
        self.stacked = if all.nrows() > width {
            all.qr().r()
        } else {
            all
        };
    }
}
