//! References of the tip: position, velocity and acceleration as pure functions of time.
//!
//! Every trajectory starts from rest. If its path does not, time scaling is applied: the path speed
//! rises smoothly from zero to its nominal value. If the velocity jumps by design (at the corners
//! of the quadrant), the acceleration is that of the piece, without the jump.

mod arc;
mod fourier;
mod line;
mod probe;
mod quadrant;
mod rotation;
mod segment;
mod sinusoid;

pub use arc::Arc;
pub use fourier::{Fourier, HARMONICS, JointReference, LimitViolation};
pub use line::Line;
pub use probe::{Probe, ProbePhase};
pub use quadrant::{Piece, Quadrant};
pub use rotation::{OrientationReference, Rotation};
pub use segment::{Segment, SegmentPeaks};
pub use sinusoid::Sinusoid;

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
    /// A reference at rest at `position` \[m\].
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

/// A trajectory of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trajectory {
    /// Stays at a point \[m\].
    Hold(Vector3<f64>),
    /// Straight line from rest to rest.
    Line(Line),
    /// Oscillation along a line, figure 3a.
    Sinusoid(Sinusoid),
    /// Oscillation on a circle about the base axis.
    Arc(Arc),
    /// Quarter ellipse and its two straight edges, figure 3b.
    Quadrant(Quadrant),
    /// Down, up, out, figures 5 and 6.
    Probe(Probe),
}

impl Trajectory {
    /// Reference at `time_s` since the start; before the start it is the start.
    pub fn at(&self, time_s: f64) -> Reference {
        let time_s = time_s.max(0.0);
        match self {
            Trajectory::Hold(position) => Reference::at_rest(*position),
            Trajectory::Line(line) => line.at(time_s),
            Trajectory::Sinusoid(sinusoid) => sinusoid.at(time_s),
            Trajectory::Arc(arc) => arc.at(time_s),
            Trajectory::Quadrant(quadrant) => quadrant.at(time_s),
            Trajectory::Probe(probe) => probe.at(time_s),
        }
    }

    /// Upper bounds of speed \[m/s\] and acceleration \[m/s^2\] over the whole length, without
    /// velocity jumps by design.
    pub fn peaks(&self) -> (f64, f64) {
        match self {
            Trajectory::Hold(_) => (0.0, 0.0),
            Trajectory::Line(line) => line.peaks(),
            Trajectory::Sinusoid(sinusoid) => sinusoid.peaks(),
            Trajectory::Arc(arc) => arc.peaks(),
            Trajectory::Quadrant(quadrant) => quadrant.peaks(),
            Trajectory::Probe(probe) => probe.peaks(),
        }
    }

    /// Time after which the trajectory rests or repeats itself \[s\]; for a probe the time of its
    /// first column.
    pub fn length_s(&self) -> f64 {
        match self {
            Trajectory::Hold(_) => 0.0,
            Trajectory::Line(line) => line.duration_s,
            Trajectory::Sinusoid(sinusoid) => {
                sinusoid.ramp_s + core::f64::consts::TAU / sinusoid.angular_frequency_rad_per_s
            }
            Trajectory::Arc(arc) => {
                arc.ramp_s + core::f64::consts::TAU / arc.angular_frequency_rad_per_s
            }
            Trajectory::Quadrant(quadrant) => quadrant.length_s(),
            Trajectory::Probe(probe) => probe.column_s(),
        }
    }

    /// Periods within [`Trajectory::length_s`]: how often a check of equal time intervals has to see the path; for a
    /// probe a quarter of its strokes, each of which is a straight line, and 1 where nothing repeats.
    pub fn periods(&self) -> f64 {
        let of_length = |period_s: f64| self.length_s() / period_s;
        match self {
            Trajectory::Hold(_) | Trajectory::Line(_) => 1.0,
            Trajectory::Sinusoid(sinusoid) => of_length(sinusoid.period_s()),
            Trajectory::Arc(arc) => {
                of_length(core::f64::consts::TAU / arc.angular_frequency_rad_per_s)
            }
            Trajectory::Quadrant(quadrant) => of_length(quadrant.period_s()),
            Trajectory::Probe(probe) => 0.25 * f64::from(probe.strokes),
        }
    }

    /// Rejects a trajectory that cannot be followed: entries that are not finite or have the wrong
    /// sign.
    ///
    /// # Errors
    /// The first invalid entry.
    pub fn validate(&self) -> Result<(), TrajectoryError> {
        match self {
            Trajectory::Hold(position) => finite("position_m", position),
            Trajectory::Line(line) => line.validate(),
            Trajectory::Sinusoid(sinusoid) => sinusoid.validate(),
            Trajectory::Arc(arc) => arc.validate(),
            Trajectory::Quadrant(quadrant) => quadrant.validate(),
            Trajectory::Probe(probe) => probe.validate(),
        }
    }
}

/// Path time for a time scaling that is ramped from rest over `ramp_s`: value, first and second
/// derivative. The path time lags by half the ramp time.
fn time_scaling(time_s: f64, ramp_s: f64) -> (f64, f64, f64) {
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

fn finite(entry: &'static str, v: &Vector3<f64>) -> Result<(), TrajectoryError> {
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

fn positive(entry: &'static str, value: f64) -> Result<(), TrajectoryError> {
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
