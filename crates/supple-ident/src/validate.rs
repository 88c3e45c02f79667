//! A fit against data it has not seen.

use crate::error::IdentError;
use crate::fit::Fit;
use crate::model::mass_matrix;
use crate::motion::Motion;
use crate::regressor::joint_rows;
use nalgebra::Cholesky;
use std::f64::consts::PI;
use supple_core::Vector;

/// Random poses tried.
pub const POSES: usize = 2000;

/// How well torques are predicted.
#[derive(Clone, Debug, PartialEq)]
pub struct Validation {
    /// RMS error of each moving joint \[N m\].
    pub rms_nm: Vec<f64>,
    /// `|tau - tau_hat| / |tau|` of each moving joint.
    pub relative: Vec<f64>,
    /// The same over all moving joints.
    pub total_relative: f64,
    /// Share of random poses, all angles within half a turn, with a positive definite mass matrix.
    pub positive_definite: f64,
}

impl<const N: usize> Fit<N> {
    /// Predicts the torques of `motion` and compares; nothing is left out.
    ///
    /// # Errors
    /// [`IdentError::Shape`] if the motion has another number of joints.
    pub fn validate(&self, motion: &Motion) -> Result<Validation, IdentError> {
        let joints = joint_rows(self.nominal(), &self.columns, motion)?;
        let samples = motion.samples() as f64;
        let (mut rms_nm, mut relative) = (Vec::new(), Vec::new());
        let (mut error, mut torque) = (0.0, 0.0);
        for joint in &joints {
            let wrong = (&joint.a * &self.x - &joint.b).norm_squared();
            let size = joint.b.norm_squared();
            rms_nm.push((wrong / samples).sqrt());
            relative.push((wrong / size).sqrt());
            error += wrong;
            torque += size;
        }
        Ok(Validation {
            rms_nm,
            relative,
            total_relative: (error / torque).sqrt(),
            positive_definite: self.positive_definite_share()?,
        })
    }

    fn positive_definite_share(&self) -> Result<f64, IdentError> {
        let mut state = 1_u64;
        let mut sound = 0;
        for _ in 0..POSES {
            let q = Vector::<N>::from_fn(|_, _| PI * uniform(&mut state));
            let mass = mass_matrix(self.nominal(), &self.columns, &self.x, &q)?;
            sound += usize::from(Cholesky::new(mass).is_some());
        }
        Ok(sound as f64 / POSES as f64)
    }
}

impl Validation {
    /// In plain words whether a controller can use the model, and why not.
    pub fn verdict(&self) -> String {
        let share = 100.0 * self.positive_definite;
        let error = 100.0 * self.total_relative;
        if self.positive_definite < 1.0 {
            return format!(
                "not usable: the mass matrix is positive definite in {share:.1} % of poses; \
                 use the physically consistent method"
            );
        }
        if self.total_relative > 0.2 {
            return format!(
                "poor: {error:.1} % torque error on held-out data; \
                 check the signs and scales of the torques, and the columns"
            );
        }
        format!(
            "sound: {error:.2} % torque error on held-out data, positive definite everywhere tried"
        )
    }
}

/// Uniform in (-1, 1), splitmix64.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as f64 / (1_u64 << 63) as f64 - 1.0
}
