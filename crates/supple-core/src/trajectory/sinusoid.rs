//! Sinusoid along a line: the paper's `x(t) = 0.6 + 0.2 sin(pi t / 4)`.

use super::reference::{
    MINIMUM_JERK_SPEED, Reference, TrajectoryError, finite, positive, time_scaling,
};
use crate::math::{Vector3, sin_cos, sqrt};

/// `Xo = centre + amplitude sin(omega s(t))`, with the rate of `s` ramped from rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sinusoid {
    /// Centre, where it starts \[m\], base axes.
    pub centre_m: Vector3<f64>,
    /// Direction and amplitude \[m\], base axes.
    pub amplitude_m: Vector3<f64>,
    /// `omega` \[rad/s\], positive.
    pub angular_frequency_rad_per_s: f64,
    /// Ramp time of the time scaling from zero to one \[s\], positive.
    pub ramp_s: f64,
}

impl Sinusoid {
    /// Returns the paper's trajectory in the plane `y = z = 0`, at `speed` times its speed.
    pub fn paper(speed: f64) -> Sinusoid {
        Sinusoid {
            centre_m: Vector3::new(0.6, 0.0, 0.0),
            amplitude_m: Vector3::new(0.2, 0.0, 0.0),
            angular_frequency_rad_per_s: core::f64::consts::FRAC_PI_4 * speed,
            ramp_s: 1.0 / speed,
        }
    }

    /// Returns the period at full speed \[s\].
    pub fn period_s(&self) -> f64 {
        core::f64::consts::TAU / self.angular_frequency_rad_per_s
    }

    pub(super) fn at(&self, time_s: f64) -> Reference {
        let (s, time_scale, time_scale_rate) = time_scaling(time_s, self.ramp_s);
        let w = self.angular_frequency_rad_per_s;
        let (sin, cos) = sin_cos(w * s);
        Reference {
            position: self.centre_m + self.amplitude_m * sin,
            velocity: self.amplitude_m * (w * cos * time_scale),
            acceleration: self.amplitude_m
                * (w * cos * time_scale_rate - w * w * sin * time_scale * time_scale),
        }
    }

    /// As [`super::Trajectory::peaks`].
    pub(super) fn peaks(&self) -> (f64, f64) {
        let w = self.angular_frequency_rad_per_s;
        let speed = sqrt(self.amplitude_m.dot(&self.amplitude_m)) * w;
        (speed, speed * (MINIMUM_JERK_SPEED / self.ramp_s + w))
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        finite("centre_m", &self.centre_m)?;
        finite("amplitude_m", &self.amplitude_m)?;
        positive(
            "angular_frequency_rad_per_s",
            self.angular_frequency_rad_per_s,
        )?;
        positive("ramp_s", self.ramp_s)
    }
}
