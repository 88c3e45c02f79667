//! Oscillation on a horizontal circle about the base axis; it moves the base joint, which the
//! sinusoid does not.

use super::reference::{MINIMUM_JERK_SPEED, Reference, TrajectoryError, positive, time_scaling};
use crate::math::{Vector3, abs, sin_cos};

/// Azimuth `centre + amplitude sin(omega s(t))` at constant radius and height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Distance from the base axis \[m\], positive.
    pub radius_m: f64,
    /// Height above the base frame \[m\].
    pub height_m: f64,
    /// Azimuth at the start \[rad\].
    pub centre_rad: f64,
    /// Amplitude of the azimuth \[rad\], positive.
    pub amplitude_rad: f64,
    /// `omega` \[rad/s\], positive.
    pub angular_frequency_rad_per_s: f64,
    /// Ramp time of the time scaling from zero to one \[s\], positive.
    pub ramp_s: f64,
}

impl Arc {
    pub(super) fn at(&self, time_s: f64) -> Reference {
        let (s, time_scale, time_scale_rate) = time_scaling(time_s, self.ramp_s);
        let w = self.angular_frequency_rad_per_s;
        let (sin, cos) = sin_cos(w * s);
        let azimuth = self.centre_rad + self.amplitude_rad * sin;
        let angular_velocity = self.amplitude_rad * w * cos * time_scale;
        let angular_acceleration = self.amplitude_rad
            * (w * cos * time_scale_rate - w * w * sin * time_scale * time_scale);
        let (sin, cos) = sin_cos(azimuth);
        let radial = Vector3::new(cos, sin, 0.0) * self.radius_m;
        let tangent = Vector3::new(-sin, cos, 0.0) * self.radius_m;
        Reference {
            position: radial + Vector3::new(0.0, 0.0, self.height_m),
            velocity: tangent * angular_velocity,
            acceleration: tangent * angular_acceleration
                - radial * (angular_velocity * angular_velocity),
        }
    }

    /// As [`super::Trajectory::peaks`].
    pub(super) fn peaks(&self) -> (f64, f64) {
        let w = self.angular_frequency_rad_per_s;
        let rate = abs(self.amplitude_rad) * w;
        let speed = self.radius_m * rate;
        (speed, speed * (MINIMUM_JERK_SPEED / self.ramp_s + w + rate))
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        positive("radius_m", self.radius_m)?;
        super::finite(
            "height_m, centre_rad",
            &Vector3::new(self.height_m, self.centre_rad, 0.0),
        )?;
        positive("amplitude_rad", self.amplitude_rad)?;
        positive(
            "angular_frequency_rad_per_s",
            self.angular_frequency_rad_per_s,
        )?;
        positive("ramp_s", self.ramp_s)
    }
}
