//! Reference of the tip's position, minimum-jerk time scaling, and the error type of invalid trajectories.

use crate::math::{Vector3, all_finite, smooth_step};
use core::fmt;

/// Peak speed of a minimum-jerk motion over its mean speed.
pub const MINIMUM_JERK_SPEED: f64 = 1.875;

/// Peak acceleration of a minimum-jerk motion over its distance by its duration squared: 10 /
/// sqrt(3).
pub const MINIMUM_JERK_ACCELERATION: f64 = 5.773_502_691_896_258;

/// Peak jerk of a minimum-jerk motion over its distance by its duration cubed.
pub const MINIMUM_JERK_JERK: f64 = 60.0;

/// Reference of the tip in base coordinates: `Xo`, `Xo'`, `Xo''`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// `Xo` \[m\].
    pub position: Vector3<f64>,
    /// `Xo'` \[m/s\].
    pub velocity: Vector3<f64>,
    /// `Xo''` \[m/s^2\].
    pub acceleration: Vector3<f64>,
}

impl Reference {
    /// Returns a reference at rest at `position` \[m\].
    pub fn at_rest(position: Vector3<f64>) -> Reference {
        Reference {
            position,
            velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        }
    }
}

/// The invalid entry of a trajectory, with its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryError {
    /// Name of the entry.
    pub entry: &'static str,
    /// Value found.
    pub value: f64,
    /// Requirement.
    pub must: &'static str,
}

impl fmt::Display for TrajectoryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "trajectory: {} is {}, it must be {}",
            self.entry, self.value, self.must
        )
    }
}

impl core::error::Error for TrajectoryError {}

/// Returns the path time and its first and second derivative, for a time scaling that is ramped from rest over
/// `ramp_s`. After the ramp the path time lags by half the ramp time.
pub(super) fn time_scaling(time_s: f64, ramp_s: f64) -> (f64, f64, f64) {
    if time_s >= ramp_s {
        return (time_s - 0.5 * ramp_s, 1.0, 0.0);
    }
    let x = time_s / ramp_s;
    let (time_scale, slope, _) = smooth_step(x);
    let x4 = x * x * x * x;
    (
        ramp_s * x4 * (2.5 + x * (x - 3.0)),
        time_scale,
        slope / ramp_s,
    )
}

pub(super) fn finite(entry: &'static str, v: &Vector3<f64>) -> Result<(), TrajectoryError> {
    if all_finite(v) {
        return Ok(());
    }
    let value = v.iter().copied().find(|x| !x.is_finite());
    Err(TrajectoryError {
        entry,
        value: value.unwrap_or(f64::NAN),
        must: "finite",
    })
}

pub(super) fn positive(entry: &'static str, value: f64) -> Result<(), TrajectoryError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(TrajectoryError {
            entry,
            value,
            must: "finite and positive",
        })
    }
}
