//! Rotation of the tip about a fixed axis, from rest to rest.

use super::reference::{MINIMUM_JERK_SPEED, TrajectoryError, finite, positive};
use crate::math::{Matrix3, Vector3, abs, sin_cos, skew, smooth_step, sqrt};
use core::f64::consts::PI;

/// Maximum deviation of the axis from unit length; the rotation uses only the direction of the axis.
const UNIT_TOLERANCE: f64 = 1e-6;

/// A rotation about a fixed axis with a minimum-jerk profile of its angle; afterwards the orientation is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Axis in base coordinates, a unit vector.
    pub axis: Vector3<f64>,
    /// Angle \[rad\], from -pi to pi.
    pub angle_rad: f64,
    /// Duration \[s\], positive.
    pub duration_s: f64,
}

/// Reference of the tip's orientation in base coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientationReference {
    /// Columns are the axes of the tip.
    pub base_from_tip: Matrix3<f64>,
    /// Angular velocity \[rad/s\].
    pub velocity_rad_per_s: Vector3<f64>,
    /// Angular acceleration \[rad/s^2\].
    pub acceleration_rad_per_s2: Vector3<f64>,
}

impl Rotation {
    /// Keeps the orientation.
    pub const NONE: Rotation = Rotation {
        axis: Vector3::new(0.0, 0.0, 1.0),
        angle_rad: 0.0,
        duration_s: 1.0,
    };

    /// Returns the reference `time_s` after the start, rotated from `start`; before the start it is `start`.
    pub fn at(&self, start: &Matrix3<f64>, time_s: f64) -> OrientationReference {
        let axis = self.axis / sqrt(self.axis.dot(&self.axis));
        let (share, rate, second_derivative) = smooth_step(time_s / self.duration_s);
        let (sine, cosine) = sin_cos(self.angle_rad * share);
        let cross = skew(&axis);
        let turn = Matrix3::identity() + cross * sine + cross * cross * (1.0 - cosine);
        let per_s = self.angle_rad / self.duration_s;
        OrientationReference {
            base_from_tip: turn * start,
            velocity_rad_per_s: axis * (per_s * rate),
            acceleration_rad_per_s2: axis * (per_s / self.duration_s * second_derivative),
        }
    }

    /// Returns the peak angular speed \[rad/s\].
    pub fn peak_rad_per_s(&self) -> f64 {
        MINIMUM_JERK_SPEED * abs(self.angle_rad) / self.duration_s
    }

    /// Rejects an axis that is not a unit vector, an angle beyond half a turn and a duration that is not positive.
    ///
    /// # Errors
    /// The first invalid entry.
    pub fn validate(&self) -> Result<(), TrajectoryError> {
        finite("rotation axis", &self.axis)?;
        let length = sqrt(self.axis.dot(&self.axis));
        if !(0.0..=UNIT_TOLERANCE).contains(&abs(length - 1.0)) {
            return Err(TrajectoryError {
                entry: "length of the rotation axis",
                value: length,
                must: "1",
            });
        }
        if !(0.0..=PI).contains(&abs(self.angle_rad)) {
            return Err(TrajectoryError {
                entry: "rotation angle_rad",
                value: self.angle_rad,
                must: "from -pi to pi",
            });
        }
        positive("rotation duration_s", self.duration_s)
    }
}
