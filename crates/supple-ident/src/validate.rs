//! Validation of a fit on held-out data.

use crate::error::IdentError;
use crate::fit::Fit;
use crate::log::Log;
use crate::model::mass_matrix;
use crate::motion::Motion;
use crate::random::Random;
use crate::regressor::joint_rows;
use nalgebra::{Cholesky, DMatrix};
use std::f64::consts::PI;
use supple_core::Vector;

/// Number of random poses.
pub const POSES: usize = 2000;

/// Prediction errors of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Validation {
    /// RMS error of each identified joint \[N m\].
    pub rms_nm: Vec<f64>,
    /// Greatest error of each identified joint \[N m\].
    pub peak_nm: Vec<f64>,
    /// `|tau - tau_hat| / |tau|` of each identified joint.
    pub relative: Vec<f64>,
    /// RMS error of each identified joint divided by the standard deviation of its own torque; at 1 the model explains no more
    /// than the mean torque.
    pub of_deviation: Vec<f64>,
    /// Relative error over all identified joints.
    pub total_relative: f64,
    /// Fraction of random poses, all angles within half a turn, with a positive definite mass matrix.
    pub positive_definite: f64,
}

impl<const N: usize> Fit<N> {
    /// Prepares `log` like the fitted logs, predicts its torques and compares.
    ///
    /// # Errors
    /// A log that [`Log::check`] rejects.
    pub fn validate(&self, log: &Log) -> Result<Validation, IdentError> {
        let identified_joints = self.columns.identified_joints();
        let (motion, _) = Motion::prepare(log, N, identified_joints, &self.preparation)?;
        self.validate_motion(&motion)
    }

    /// Predicts the torques of `motion` and compares; uses every sample.
    ///
    /// # Errors
    /// [`IdentError::Shape`] if the motion has another number of joints.
    pub fn validate_motion(&self, motion: &Motion) -> Result<Validation, IdentError> {
        let joints = joint_rows(self.nominal(), &self.columns, motion)?;
        let (mut rms_nm, mut peak_nm, mut relative) = (Vec::new(), Vec::new(), Vec::new());
        let (mut error, mut torque) = (0.0, 0.0);
        let mut of_deviation = Vec::new();
        for joint in &joints {
            let errors = joint.residual(&self.x);
            let squared = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
            let wrong = squared(&errors);
            peak_nm.push(errors.iter().map(|e| e.abs()).fold(0.0, f64::max));
            let torques = joint.torques();
            let size = squared(&torques);
            let count = torques.len().max(1) as f64;
            let mean = torques.iter().sum::<f64>() / count;
            let deviation = (size / count - mean * mean).max(0.0).sqrt();
            of_deviation.push((wrong / count).sqrt() / deviation.max(f64::MIN_POSITIVE));
            rms_nm.push((wrong / (errors.len().max(1) as f64)).sqrt());
            relative.push((wrong / size).sqrt());
            error += wrong;
            torque += size;
        }
        Ok(Validation {
            rms_nm,
            peak_nm,
            relative,
            of_deviation,
            total_relative: (error / torque).sqrt(),
            positive_definite: self.positive_definite_fraction()?,
        })
    }

    /// Returns the predicted torques of the identified joints, (samples, identified joints), with dry friction filtered like the
    /// measured torques \[N m\].
    ///
    /// # Errors
    /// [`IdentError::Shape`] if the motion has another number of joints.
    pub fn predict_motion(&self, motion: &Motion) -> Result<DMatrix<f64>, IdentError> {
        let joints = joint_rows(self.nominal(), &self.columns, motion)?;
        let mut predicted = DMatrix::zeros(motion.samples(), joints.len());
        for (row, (joint, measured)) in joints
            .iter()
            .zip(self.columns.identified_joints())
            .enumerate()
        {
            // Add the torque of known rotors, which the rows do not include.
            let known = motion.tau.column(*measured) - &joint.b;
            predicted.set_column(row, &(joint.predicted(&self.x) + known));
        }
        Ok(predicted)
    }

    fn positive_definite_fraction(&self) -> Result<f64, IdentError> {
        let mut random = Random::new(1);
        let mut positive_definite = 0;
        for _ in 0..POSES {
            let q = Vector::<N>::from_fn(|_, _| PI * random.signed());
            let mass = mass_matrix(self.nominal(), &self.columns, &self.x, &q)?;
            positive_definite += usize::from(Cholesky::new(mass).is_some());
        }
        Ok(positive_definite as f64 / POSES as f64)
    }
}

/// Torque error relative to the torque above which a model is poor.
const POOR: f64 = 0.2;
/// Torque error relative to the torque up to which a model is good.
const GOOD: f64 = 0.05;
/// Ratio of a joint's error to the deviation of its torque above which its model counts as poor.
const POOR_JOINT: f64 = 0.5;

/// Returns the verdict over all held-out logs as text: the worst log and the worst joint decide. `joints` names the identified
/// joints.
pub fn verdict(held_out: &[(String, &Validation)], joints: &[String]) -> String {
    let worst_log = held_out
        .iter()
        .max_by(|a, b| a.1.total_relative.total_cmp(&b.1.total_relative));
    let Some((name, worst)) = worst_log else {
        return "not validated".to_owned();
    };
    let all = held_out.iter().flat_map(|(log, v)| {
        let errors = v.of_deviation.iter().zip(joints);
        errors.map(move |(error, joint)| (log, joint, *error))
    });
    let Some((log, joint, error)) = all.max_by(|a, b| a.2.total_cmp(&b.2)) else {
        return "not validated".to_owned();
    };
    let plain = worst.verdict();
    let percent = 100.0 * error;
    if worst.positive_definite < 1.0 || worst.total_relative > POOR {
        return format!("{plain} (log {name})");
    }
    if error > POOR_JOINT {
        return format!(
            "poor for {joint}: its error is {percent:.0} % of the deviation of its own torque in {log}, {:.1} % of all joints' \
             torque; excite this joint more, or check its torque",
            100.0 * worst.total_relative
        );
    }
    format!(
        "{plain}; worst log {name}, worst joint {joint}: {percent:.0} % of the deviation of its own torque"
    )
}

impl Validation {
    /// Returns the verdict as text: whether a controller can use the model, and if not, why.
    pub fn verdict(&self) -> String {
        let percent = 100.0 * self.positive_definite;
        let error = 100.0 * self.total_relative;
        if self.positive_definite < 1.0 {
            return format!(
                "not usable: the mass matrix is positive definite in {percent:.1} % of poses; \
                 use the physically consistent method"
            );
        }
        if self.total_relative > POOR {
            return format!(
                "poor: {error:.1} % torque error on held-out data; \
                 check the signs and scales of the torques, and the columns"
            );
        }
        let grade = match self.total_relative <= GOOD {
            true => "good",
            false => "fair",
        };
        format!(
            "{grade}: {error:.2} % torque error on held-out data, positive definite in all poses tried"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_grades_the_unexplained_torque() {
        let of = |total_relative: f64, positive_definite: f64| {
            let validation = Validation {
                rms_nm: vec![0.1],
                peak_nm: vec![0.3],
                relative: vec![total_relative],
                of_deviation: vec![total_relative],
                total_relative,
                positive_definite,
            };
            verdict(&[("log".to_owned(), &validation)], &["joint1".to_owned()])
        };
        for (total_relative, positive_definite, grade) in [
            (0.03, 1.0, "good: 3.00 %"),
            (0.103, 1.0, "fair: 10.30 %"),
            (0.3, 1.0, "poor: 30.0 %"),
            (0.03, 0.99, "not usable"),
        ] {
            let found = of(total_relative, positive_definite);
            assert!(found.starts_with(grade), "{found}");
        }
    }
}
