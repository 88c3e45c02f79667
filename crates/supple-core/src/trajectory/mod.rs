//! References of the tip: position, velocity and acceleration as pure functions of time.
//!
//! Every trajectory starts from rest. If its path does not, time scaling is applied: the path speed
//! rises smoothly from zero to its nominal value. If the velocity jumps by design (at the corners
//! of the quadrant), the acceleration is that of the path segment, without the jump.

mod arc;
mod fourier;
mod line;
mod probe;
mod quadrant;
mod reference;
mod rotation;
mod segment;
mod sinusoid;

use reference::finite;
pub use reference::{
    MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_JERK, MINIMUM_JERK_SPEED, Reference, TrajectoryError,
};

pub use arc::Arc;
pub use fourier::{Fourier, HARMONICS, JointReference, LimitViolation};
pub use line::Line;
pub use probe::{Probe, ProbePhase};
pub use quadrant::{PathSegment, Quadrant};
pub use rotation::{OrientationReference, Rotation};
pub use segment::{Segment, SegmentPeaks};
pub use sinusoid::Sinusoid;

use crate::math::Vector3;

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
    /// Returns the reference at `time_s` since the start; before the start it is the start.
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

    /// Returns the upper bounds of speed \[m/s\] and acceleration \[m/s^2\] over the whole length, without
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

    /// Returns the time after which the trajectory rests or repeats itself \[s\]; for a probe the duration of its
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

    /// Returns the number of periods within [`Trajectory::length_s`], which sets the number of samples of a check; for a
    /// probe a quarter of its strokes, because each stroke is a straight line; 1 for a path that does not repeat.
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
