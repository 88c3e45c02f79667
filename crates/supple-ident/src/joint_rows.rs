//! The rows of one identified joint, and their reduction to a triangular factor.

use crate::qr_reduction::{CHUNK, ReducedSystem};
use core::ops::RangeInclusive;
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;
use supple_core::friction::MAX_LOAD_COEFFICIENT;

/// Travel after a reversal from which friction is in steady sliding \[rad\]; bristle deflection is about 1
/// mrad.
pub const STEADY_SLIDING_RAD: f64 = 4e-3;

/// Data for predicting friction that grows with the motor's torque. The column of this friction contains the measured torque,
/// which a prediction must not use.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorLoad {
    /// Index of the column of this friction.
    pub column: usize,
    /// Values of the column for a motor torque of 1 N m, -1 to 1.
    pub direction: Vec<f64>,
    /// Torque of a known rotor, which `b` does not contain \[N m\].
    pub rotor_nm: Vec<f64>,
}

/// The rows of one identified joint: `a x = b`, one row for each sample.
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
    /// Whether a reversal of the joint is so near that the step of its dry friction reaches the sample through the filter.
    pub is_near_reversal: Vec<bool>,
    /// Whether the sample is used.
    pub used: Vec<bool>,
    /// Friction that grows with the torque of the motor, if there is a column for it.
    pub motor_load: Option<MotorLoad>,
    /// Cached QR reduction of the rows above a given speed.
    cached: OnceLock<(f64, ReducedSystem)>,
}

impl JointRows {
    /// Returns the rows of one joint in steady sliding.
    pub fn new(a: DMatrix<f64>, b: DVector<f64>, speed: Vec<f64>) -> JointRows {
        JointRows {
            travel_since_reversal_rad: vec![f64::INFINITY; speed.len()],
            is_near_reversal: vec![false; speed.len()],
            used: vec![true; speed.len()],
            motor_load: None,
            a,
            b,
            speed,
            cached: OnceLock::new(),
        }
    }

    /// Returns [`JointRows::reduced`] without weights, cached for the first speed.
    pub fn block(&self, slow_rad_per_s: f64) -> ReducedSystem {
        let make = || (slow_rad_per_s, self.reduced(slow_rad_per_s, None));
        let (speed, block) = self.cached.get_or_init(make);
        if *speed == slow_rad_per_s {
            return block.clone();
        }
        make().1
    }

    /// Returns the torques predicted from the motion alone, without those of known rotors \[N m\].
    pub fn predicted(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut torque = &self.a * x;
        let Some(load) = &self.motor_load else {
            return torque;
        };
        let coefficient = x[load.column];
        for (i, torque) in torque.iter_mut().enumerate() {
            let rest = *torque - self.a[(i, load.column)] * coefficient + load.rotor_nm[i];
            // The torque t of the motor fulfils t = rest + coefficient direction |t|, and has the sign of the rest.
            let share = coefficient * load.direction[i] * rest.signum();
            *torque = rest / (1.0 - share.min(MAX_LOAD_COEFFICIENT)) - load.rotor_nm[i];
        }
        torque
    }

    /// Returns whether a sample is of slow, steady sliding, with a speed in this range.
    pub(crate) fn is_slow_sliding(&self, sample: usize, rad_per_s: &RangeInclusive<f64>) -> bool {
        self.used[sample]
            && rad_per_s.contains(&self.speed[sample])
            && self.travel_since_reversal_rad[sample] >= STEADY_SLIDING_RAD
            && !self.is_near_reversal[sample]
    }

    /// Returns the predicted minus measured torques of the samples that are used \[N m\].
    pub fn residual(&self, x: &DVector<f64>) -> Vec<f64> {
        let all = self.predicted(x) - &self.b;
        let pairs = all.iter().zip(&self.used);
        pairs.filter(|(_, used)| **used).map(|(r, _)| *r).collect()
    }

    /// Returns `b` of the samples that are used.
    pub fn torques(&self) -> Vec<f64> {
        let pairs = self.b.iter().zip(&self.used);
        pairs.filter(|(_, used)| **used).map(|(b, _)| *b).collect()
    }

    /// Returns the samples `range`.
    pub fn part(&self, range: std::ops::Range<usize>) -> JointRows {
        JointRows {
            a: self.a.rows_range(range.clone()).into_owned(),
            b: self.b.rows_range(range.clone()).into_owned(),
            speed: self.speed[range.clone()].to_vec(),
            travel_since_reversal_rad: self.travel_since_reversal_rad[range.clone()].to_vec(),
            is_near_reversal: self.is_near_reversal[range.clone()].to_vec(),
            used: self.used[range.clone()].to_vec(),
            motor_load: self.motor_load.as_ref().map(|load| MotorLoad {
                column: load.column,
                direction: load.direction[range.clone()].to_vec(),
                rotor_nm: load.rotor_nm[range].to_vec(),
            }),
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
