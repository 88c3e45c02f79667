//! Straight line from rest to rest with minimum jerk.

use super::reference::{
    MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_SPEED, Reference, TrajectoryError, finite, positive,
};
use crate::math::{Vector3, smooth_step, sqrt};

/// Line from one point to another in a given time; afterwards the reference stays at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Start \[m\], base axes.
    pub from_m: Vector3<f64>,
    /// End \[m\], base axes.
    pub to_m: Vector3<f64>,
    /// Duration \[s\], positive.
    pub duration_s: f64,
}

impl Line {
    pub(super) fn at(&self, time_s: f64) -> Reference {
        let (share, first_derivative, second_derivative) = smooth_step(time_s / self.duration_s);
        let displacement = self.to_m - self.from_m;
        Reference {
            position: self.from_m + displacement * share,
            velocity: displacement * (first_derivative / self.duration_s),
            acceleration: displacement * (second_derivative / (self.duration_s * self.duration_s)),
        }
    }

    /// As [`super::Trajectory::peaks`].
    pub(super) fn peaks(&self) -> (f64, f64) {
        let displacement = self.to_m - self.from_m;
        let mean = sqrt(displacement.dot(&displacement)) / self.duration_s;
        (
            MINIMUM_JERK_SPEED * mean,
            MINIMUM_JERK_ACCELERATION * mean / self.duration_s,
        )
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        finite("from_m", &self.from_m)?;
        finite("to_m", &self.to_m)?;
        positive("duration_s", self.duration_s)
    }
}
