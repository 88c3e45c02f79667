//! The rows of one moving joint, and their reduction to a triangular factor.

use crate::qr_reduction::{CHUNK, ReducedSystem};
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;

/// The rows of one moving joint: `a x = b`, one row for each sample.
#[derive(Clone, Debug, PartialEq)]
pub struct JointRows {
    /// Regressor, (samples, columns).
    pub a: DMatrix<f64>,
    /// Torques minus the torque of known rotors \[N m\].
    pub b: DVector<f64>,
    /// Speed of the joint \[rad/s\].
    pub speed: Vec<f64>,
    /// Travel since the last reversal of the joint \[rad\].
    pub travel_since_reversal_rad: Vec<f64>,
    /// Whether the sample is used.
    pub used: Vec<bool>,
    /// Cached QR reduction of the rows above a given speed.
    cached: OnceLock<(f64, ReducedSystem)>,
}

impl JointRows {
    /// Rows of one joint in steady sliding.
    pub fn new(a: DMatrix<f64>, b: DVector<f64>, speed: Vec<f64>) -> JointRows {
        JointRows {
            travel_since_reversal_rad: vec![f64::INFINITY; speed.len()],
            used: vec![true; speed.len()],
            a,
            b,
            speed,
            cached: OnceLock::new(),
        }
    }

    /// [`JointRows::reduced`] without weights, cached for the first speed.
    pub fn block(&self, slow_rad_per_s: f64) -> ReducedSystem {
        let make = || (slow_rad_per_s, self.reduced(slow_rad_per_s, None));
        let (speed, block) = self.cached.get_or_init(make);
        if *speed == slow_rad_per_s {
            return block.clone();
        }
        make().1
    }

    /// `a x - b` of the samples that are used.
    pub fn residual(&self, x: &DVector<f64>) -> Vec<f64> {
        let all = &self.a * x - &self.b;
        let pairs = all.iter().zip(&self.used);
        pairs.filter(|(_, used)| **used).map(|(r, _)| *r).collect()
    }

    /// `b` of the samples that are used.
    pub fn torques(&self) -> Vec<f64> {
        let pairs = self.b.iter().zip(&self.used);
        pairs.filter(|(_, used)| **used).map(|(b, _)| *b).collect()
    }

    /// Samples `range`.
    pub fn part(&self, range: std::ops::Range<usize>) -> JointRows {
        JointRows {
            a: self.a.rows_range(range.clone()).into_owned(),
            b: self.b.rows_range(range.clone()).into_owned(),
            speed: self.speed[range.clone()].to_vec(),
            travel_since_reversal_rad: self.travel_since_reversal_rad[range.clone()].to_vec(),
            used: self.used[range].to_vec(),
            cached: OnceLock::new(),
        }
    }

    /// Reduces the rows above `slow_rad_per_s`, each multiplied by the square root of its weight.
    pub fn reduced(&self, slow_rad_per_s: f64, weights: Option<&[f64]>) -> ReducedSystem {
        let kept: Vec<usize> = (0..self.b.len())
            .filter(|i| self.used[*i] && self.speed[*i] >= slow_rad_per_s)
            .collect();
        let columns = self.a.ncols();
        let mut block = ReducedSystem::empty(columns);
        for chunk in kept.chunks(CHUNK) {
            let rows = DMatrix::from_fn(chunk.len(), columns + 1, |i, c| {
                let sample = chunk[i];
                let value = if c < columns {
                    self.a[(sample, c)]
                } else {
                    self.b[sample]
                };
                weights.map_or(1.0, |w| w[sample].sqrt()) * value
            });
            block.append(&rows, chunk.len());
        }
        block
    }
}
