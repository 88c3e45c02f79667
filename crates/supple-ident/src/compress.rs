//! A least-squares problem reduced to a triangle of its own width, whatever its length.
//!
//! `[A b] = Q R`: `|A x - b|` is `|R_1 x - r|` for every `x`, to rounding and without squaring the
//! condition number. Blocks of several joints and logs are stacked, weighted and reduced again.

use crate::regressor::JointRows;
use nalgebra::{DMatrix, DVector};

/// Rows that are reduced at once.
const CHUNK: usize = 512;

/// `[R_1 r]` with as many rows as columns at most, and the number of rows it stands for.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    stacked: DMatrix<f64>,
    rows: usize,
}

impl Block {
    /// No rows at all, for `columns` unknowns.
    pub fn empty(columns: usize) -> Block {
        Block {
            stacked: DMatrix::zeros(0, columns + 1),
            rows: 0,
        }
    }

    /// Rows of one joint above `slow_rad_per_s`, each multiplied by the square root of its weight.
    pub fn of(joint: &JointRows, slow_rad_per_s: f64, weights: Option<&[f64]>) -> Block {
        let kept: Vec<usize> = (0..joint.b.len())
            .filter(|i| joint.speed[*i] >= slow_rad_per_s)
            .collect();
        let columns = joint.a.ncols();
        let mut block = Block::empty(columns);
        for chunk in kept.chunks(CHUNK) {
            let rows = DMatrix::from_fn(chunk.len(), columns + 1, |i, c| {
                let sample = chunk[i];
                let value = if c < columns {
                    joint.a[(sample, c)]
                } else {
                    joint.b[sample]
                };
                weights.map_or(1.0, |w| w[sample].sqrt()) * value
            });
            block.append(&rows, chunk.len());
        }
        block
    }

    /// Adds the rows of `other`, multiplied by `scale`.
    pub fn add(&mut self, other: &Block, scale: f64) {
        self.append(&(&other.stacked * scale), other.rows);
    }

    /// Number of rows of the uncompressed problem.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// `R_1`.
    pub fn a(&self) -> DMatrix<f64> {
        self.stacked.columns(0, self.unknowns()).into_owned()
    }

    /// `r`.
    pub fn b(&self) -> DVector<f64> {
        self.stacked.column(self.unknowns()).into_owned()
    }

    /// The same problem with some of its unknowns only.
    pub fn select(&self, unknowns: &[usize]) -> Block {
        let columns: Vec<usize> = unknowns.iter().copied().chain([self.unknowns()]).collect();
        Block {
            stacked: self.stacked.select_columns(&columns),
            rows: self.rows,
        }
    }

    /// `|A x - b|^2`.
    pub fn error_squared(&self, x: &DVector<f64>) -> f64 {
        (self.stacked.columns(0, self.unknowns()) * x - self.stacked.column(self.unknowns()))
            .norm_squared()
    }

    /// `|b|^2`.
    pub fn torque_squared(&self) -> f64 {
        self.stacked.column(self.unknowns()).norm_squared()
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.stacked.ncols() - 1
    }

    fn append(&mut self, rows: &DMatrix<f64>, count: usize) {
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
