//! The probing cycle of the paper: down, up, out; at the end of a column the base advances. A dwell at the bottom of the
//! stroke, which the paper's cycle does not have, shows the force while pressing.
//!
//! The stroke goes vertically down, rests there for the dwell, and goes up again at a constant speed
//! with smooth ramps at its ends; then the tip steps out along the radius, from rest to rest. After the last stroke of a column
//! the base rotates by one step while the tip returns to the first radius, and the next column
//! begins.

use super::reference::{
    MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_SPEED, Reference, TrajectoryError, finite, positive,
    time_scaling,
};
use crate::math::{Vector3, sin_cos, smooth_step};

/// Ratio of peak speed to mean speed of a minimum-jerk move.
const MINIMUM_JERK_PEAK: f64 = 1.875;

/// Phase of the probing cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProbePhase {
    /// Moving down.
    Down,
    /// At rest at the bottom of the stroke.
    Dwell,
    /// Moving up.
    Up,
    /// Stepping out along the radius.
    Out,
    /// Rotating the base and returning to the first radius.
    Advance,
}

/// The probing cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// First distance from the base axis \[m\], positive.
    pub radius_m: f64,
    /// Strokes in a column, at least one.
    pub strokes: u32,
    /// Radial step between strokes \[m\], positive; the paper's is 6.67 mm.
    pub radial_step_m: f64,
    /// Height of the top of the stroke above the base frame \[m\].
    pub top_m: f64,
    /// Length of the stroke \[m\], positive; the paper's is 0.1 m.
    pub stroke_m: f64,
    /// Azimuth of the first column \[rad\].
    pub azimuth_rad: f64,
    /// Azimuth step between columns \[rad\].
    pub azimuth_step_rad: f64,
    /// Speed of the stroke and peak speed of the steps \[m/s\], positive.
    pub speed_m_per_s: f64,
    /// Ramp time of the stroke's speed \[s\], positive.
    pub ramp_s: f64,
    /// Rest at the bottom of the stroke \[s\], zero or more; the paper's cycle has none.
    pub dwell_s: f64,
}

impl Probe {
    /// Returns the duration of the stroke down, and of the stroke up \[s\].
    pub fn stroke_s(&self) -> f64 {
        self.stroke_m / self.speed_m_per_s + self.ramp_s
    }

    fn step_s(&self, way_m: f64) -> f64 {
        (MINIMUM_JERK_PEAK * way_m / self.speed_m_per_s).max(2.0 * self.ramp_s)
    }

    fn advance_s(&self) -> f64 {
        let sweep = libm::fabs(self.azimuth_step_rad) * self.last_radius();
        self.step_s(sweep + self.radial_step_m * self.last_stroke())
    }

    fn last_radius(&self) -> f64 {
        self.radius_m + self.radial_step_m * self.last_stroke()
    }

    fn last_stroke(&self) -> f64 {
        f64::from(self.strokes.saturating_sub(1))
    }

    /// Returns the time of one down, dwell, up and out \[s\].
    pub fn cycle_s(&self) -> f64 {
        self.retreated_s() + self.step_s(self.radial_step_m)
    }

    /// Returns the time from the start of a stroke until the tip is up again \[s\].
    fn retreated_s(&self) -> f64 {
        2.0 * self.stroke_s() + self.dwell_s
    }

    /// Returns the time of one column with the base advance that ends it \[s\].
    pub fn column_s(&self) -> f64 {
        self.cycle_s() * f64::from(self.strokes) - self.step_s(self.radial_step_m)
            + self.advance_s()
    }

    /// Returns the phase, time into it \[s\], stroke within the column and column at `time_s`.
    pub fn phase_at(&self, time_s: f64) -> (ProbePhase, f64, u32, u32) {
        let column = libm::floor(time_s.max(0.0) / self.column_s());
        let in_column = time_s.max(0.0) - column * self.column_s();
        let stroke = libm::floor(in_column / self.cycle_s()).min(self.last_stroke());
        let t = in_column - stroke * self.cycle_s();
        let (stroke, column) = (stroke as u32, column as u32);
        let stroke_s = self.stroke_s();
        let (rises_s, retreated_s) = (stroke_s + self.dwell_s, self.retreated_s());
        if t < stroke_s {
            (ProbePhase::Down, t, stroke, column)
        } else if t < rises_s {
            (ProbePhase::Dwell, t - stroke_s, stroke, column)
        } else if t < retreated_s {
            (ProbePhase::Up, t - rises_s, stroke, column)
        } else if stroke + 1 < self.strokes {
            (ProbePhase::Out, t - retreated_s, stroke, column)
        } else {
            (ProbePhase::Advance, t - retreated_s, stroke, column)
        }
    }

    pub(super) fn at(&self, time_s: f64) -> Reference {
        let (phase, t, stroke, column) = self.phase_at(time_s);
        let radius = self.radius_m + self.radial_step_m * f64::from(stroke);
        let azimuth = self.azimuth_rad + self.azimuth_step_rad * f64::from(column);
        let still = (0.0, 0.0, 0.0);
        let (r, phi, z) = match phase {
            ProbePhase::Down => (still, still, self.stroke(t)),
            ProbePhase::Dwell => (still, still, (-self.stroke_m, 0.0, 0.0)),
            ProbePhase::Up => {
                let (z, velocity, acceleration) = self.stroke(t);
                (still, still, (-self.stroke_m - z, -velocity, -acceleration))
            }
            ProbePhase::Out => (
                step(t, self.step_s(self.radial_step_m), self.radial_step_m),
                still,
                still,
            ),
            ProbePhase::Advance => (
                step(t, self.advance_s(), self.radius_m - radius),
                step(t, self.advance_s(), self.azimuth_step_rad),
                still,
            ),
        };
        cylindrical(
            (radius + r.0, r.1, r.2),
            (azimuth + phi.0, phi.1, phi.2),
            (self.top_m + z.0, z.1, z.2),
        )
    }

    /// Returns the height below the top during the stroke down, zero to `-stroke_m`.
    fn stroke(&self, t: f64) -> (f64, f64, f64) {
        let v = self.speed_m_per_s;
        let stroke_s = self.stroke_s();
        if t <= 0.5 * stroke_s {
            let (s, time_scale, rate) = time_scaling(t, self.ramp_s);
            (-v * s, -v * time_scale, -v * rate)
        } else {
            let (s, time_scale, rate) = time_scaling((stroke_s - t).max(0.0), self.ramp_s);
            (-self.stroke_m + v * s, -v * time_scale, v * rate)
        }
    }

    /// As [`super::Trajectory::peaks`].
    pub(super) fn peaks(&self) -> (f64, f64) {
        let speed = self.speed_m_per_s;
        // The peak speed fixes the duration T of a step of length L, so L / T^2 is proportional to
        // speed^2 / L.
        let shortest = self.radial_step_m;
        let steps = speed * MINIMUM_JERK_ACCELERATION / (MINIMUM_JERK_SPEED * MINIMUM_JERK_SPEED);
        let turning = if self.azimuth_step_rad == 0.0 {
            0.0
        } else {
            3.0 * speed / self.radius_m
        };
        let stroke = MINIMUM_JERK_SPEED / self.ramp_s;
        (speed, speed * stroke.max(steps / shortest + turning))
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        positive("radius_m", self.radius_m)?;
        positive("strokes", f64::from(self.strokes))?;
        positive("radial_step_m", self.radial_step_m)?;
        positive("stroke_m", self.stroke_m)?;
        positive("speed_m_per_s", self.speed_m_per_s)?;
        positive("ramp_s", self.ramp_s)?;
        if self.dwell_s < 0.0 || !self.dwell_s.is_finite() {
            return Err(TrajectoryError {
                entry: "dwell_s",
                value: self.dwell_s,
                must: "finite and not negative",
            });
        }
        if self.ramp_s * self.speed_m_per_s > self.stroke_m {
            return Err(TrajectoryError {
                entry: "ramp_s",
                value: self.ramp_s,
                must: "at most stroke_m / speed_m_per_s",
            });
        }
        finite(
            "top_m, azimuth_rad, azimuth_step_rad",
            &Vector3::new(self.top_m, self.azimuth_rad, self.azimuth_step_rad),
        )
    }
}

fn step(t: f64, duration: f64, displacement: f64) -> (f64, f64, f64) {
    let (share, first_derivative, second_derivative) = smooth_step(t / duration);
    (
        displacement * share,
        displacement * first_derivative / duration,
        displacement * second_derivative / (duration * duration),
    )
}

/// Returns the base coordinates of radius, azimuth and height, each with its first two derivatives.
fn cylindrical(r: (f64, f64, f64), phi: (f64, f64, f64), z: (f64, f64, f64)) -> Reference {
    let (sin, cos) = sin_cos(phi.0);
    let radial = Vector3::new(cos, sin, 0.0);
    let tangent = Vector3::new(-sin, cos, 0.0);
    let up = Vector3::new(0.0, 0.0, 1.0);
    Reference {
        position: radial * r.0 + up * z.0,
        velocity: radial * r.1 + tangent * (r.0 * phi.1) + up * z.1,
        acceleration: radial * (r.2 - r.0 * phi.1 * phi.1)
            + tangent * (r.0 * phi.2 + 2.0 * r.1 * phi.1)
            + up * z.2,
    }
}
