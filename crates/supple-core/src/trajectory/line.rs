//! Straight line from rest to rest with minimum jerk.

use super::{Reference, TrajectoryError, finite, positive};
use crate::math::{Vector3, smooth_step};

/// From one point to another in a given time; it stays at the end.
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
        let (x, rate, rate_rate) = smooth_step(time_s / self.duration_s);
        let way = self.to_m - self.from_m;
        Reference {
            position: self.from_m + way * x,
            velocity: way * (rate / self.duration_s),
            acceleration: way * (rate_rate / (self.duration_s * self.duration_s)),
        }
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        finite("from_m", &self.from_m)?;
        finite("to_m", &self.to_m)?;
        positive("duration_s", self.duration_s)
    }
}
