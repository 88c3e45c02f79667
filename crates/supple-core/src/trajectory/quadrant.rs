//! Quarter ellipse with unequal semi-axes and the two straight edges that close it, figure 3b.
//!
//! The path starts at the centre, runs out along the first semi-axis, along the quarter ellipse,
//! and back along the second semi-axis; then it repeats. Speed is constant on each segment, so the
//! velocity jumps at the three corners, where the acceleration stays that of the segment. With a corner
//! ramp the speed rises from zero and falls to zero on each segment, so that no velocity jumps.

use super::reference::{
    MINIMUM_JERK_SPEED, Reference, TrajectoryError, finite, positive, time_scaling,
};
use crate::math::{Vector3, abs, sin_cos, sqrt};

/// Knots of the arc-length table.
const KNOTS: usize = 9;
/// Five-point Gauss-Legendre rule on (-1, 1).
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Segment of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathSegment {
    /// From the centre out along the first semi-axis.
    Out,
    /// The quarter ellipse.
    Ellipse,
    /// Back to the centre along the second semi-axis.
    Back,
}

/// A position on the path, and the time scaling there.
struct PathPosition {
    segment: PathSegment,
    lap: u32,
    /// Distance from the start of the segment \[m\].
    along_m: f64,
    time_scale: f64,
    /// \[1/s\]
    time_scale_rate: f64,
}

/// Quarter ellipse and edges, followed at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadrant {
    centre_m: Vector3<f64>,
    first_m: Vector3<f64>,
    second_m: Vector3<f64>,
    speed_m_per_s: f64,
    ramp_s: f64,
    corner_ramp_s: f64,
    /// Arc length of the ellipse from the first semi-axis at evenly spaced parameters.
    arc_length_m: [f64; KNOTS],
}

impl Quadrant {
    /// Creates a quadrant; `centre_m` is the corner between the edges, `first_m` and `second_m` the semi-axes
    /// (orthogonal vectors in base axes, they span the plane), `speed_m_per_s` the speed on every
    /// segment, `ramp_s` the ramp time of the time scaling from zero to one at the start.
    pub fn new(
        centre_m: Vector3<f64>,
        first_m: Vector3<f64>,
        second_m: Vector3<f64>,
        speed_m_per_s: f64,
        ramp_s: f64,
    ) -> Quadrant {
        let mut quadrant = Quadrant {
            centre_m,
            first_m,
            second_m,
            speed_m_per_s,
            ramp_s,
            corner_ramp_s: 0.0,
            arc_length_m: [0.0; KNOTS],
        };
        for k in 1..KNOTS {
            quadrant.arc_length_m[k] =
                quadrant.arc_length_m[k - 1] + quadrant.arc_between(knot(k - 1), knot(k));
        }
        quadrant
    }

    /// Returns the same path with a speed that rises from zero and falls to zero on every segment, each in
    /// `corner_ramp_s`, with minimum jerk; zero: the velocity jumps at the corners. A segment must be
    /// at least as long as its two ramps at that speed.
    pub fn with_corner_ramp(self, corner_ramp_s: f64) -> Quadrant {
        Quadrant {
            corner_ramp_s,
            ..self
        }
    }

    /// In the vertical plane `y = 0`: centre (0.48, 0, -0.06) m, 0.26 m along x, 0.32 m along z.
    pub fn vertical(speed_m_per_s: f64) -> Quadrant {
        Quadrant::new(
            Vector3::new(0.48, 0.0, -0.06),
            Vector3::new(0.26, 0.0, 0.0),
            Vector3::new(0.0, 0.0, 0.32),
            speed_m_per_s,
            0.5,
        )
    }

    /// Returns the corner between the edges \[m\].
    pub fn centre_m(&self) -> Vector3<f64> {
        self.centre_m
    }

    /// Returns the first semi-axis \[m\].
    pub fn first_m(&self) -> Vector3<f64> {
        self.first_m
    }

    /// Returns the second semi-axis \[m\].
    pub fn second_m(&self) -> Vector3<f64> {
        self.second_m
    }

    /// Returns the speed on every segment \[m/s\].
    pub fn speed_m_per_s(&self) -> f64 {
        self.speed_m_per_s
    }

    /// Returns the ramp time of the time scaling from zero to one \[s\].
    pub fn ramp_s(&self) -> f64 {
        self.ramp_s
    }

    /// Returns the time in which the speed rises or falls at a corner \[s\]; zero where the velocity jumps.
    pub fn corner_ramp_s(&self) -> f64 {
        self.corner_ramp_s
    }

    /// Lengths of the segments in order \[m\].
    pub fn lengths_m(&self) -> [f64; 3] {
        [
            norm(&self.first_m),
            self.arc_length_m[KNOTS - 1],
            norm(&self.second_m),
        ]
    }

    /// Returns the time of one lap at full speed, with the ramps at its corners \[s\].
    pub fn period_s(&self) -> f64 {
        self.lengths_m().iter().sum::<f64>() / self.speed_m_per_s + 3.0 * self.corner_ramp_s
    }

    /// Returns the segment, covered fraction of it (0 to 1), and completed laps at `time_s`.
    pub fn segment_at(&self, time_s: f64) -> (PathSegment, f64, u32) {
        let (s, _, _) = time_scaling(time_s.max(0.0), self.ramp_s);
        let at = self.locate(s);
        let lengths = self.lengths_m();
        (
            at.segment,
            at.along_m / lengths[at.segment as usize],
            at.lap,
        )
    }

    fn locate(&self, path_time_s: f64) -> PathPosition {
        let lengths = self.lengths_m();
        let whole = lengths[0] + lengths[1] + lengths[2];
        // With ramps, a time on the path becomes the distance that the full speed covers in it.
        let ramp_m = self.corner_ramp_s * self.speed_m_per_s;
        let whole = whole + 3.0 * ramp_m;
        let distance = path_time_s * self.speed_m_per_s;
        let lap = libm::floor(distance / whole);
        let along = distance - lap * whole;
        let out = lengths[0] + ramp_m;
        let ellipse = out + lengths[1] + ramp_m;
        let (segment, along) = if along < out {
            (PathSegment::Out, along)
        } else if along < ellipse {
            (PathSegment::Ellipse, along - out)
        } else {
            (PathSegment::Back, along - out - (lengths[1] + ramp_m))
        };
        let (along_m, time_scale, time_scale_rate) =
            self.corner_scaling(along, lengths[segment as usize]);
        PathPosition {
            segment,
            lap: lap as u32,
            along_m,
            time_scale,
            time_scale_rate,
        }
    }

    /// Returns the distance along a segment, time scale and its rate \[1/s\], `distance_m` after the corner at full speed.
    fn corner_scaling(&self, distance_m: f64, length_m: f64) -> (f64, f64, f64) {
        let ramp_s = self.corner_ramp_s;
        if ramp_s <= 0.0 {
            return (distance_m, 1.0, 0.0);
        }
        let speed = self.speed_m_per_s;
        let time_s = distance_m / speed;
        let left_s = (length_m / speed + ramp_s - time_s).max(0.0);
        if time_s <= left_s {
            let (s, scale, rate) = time_scaling(time_s, ramp_s);
            (speed * s, scale, rate)
        } else {
            let (s, scale, rate) = time_scaling(left_s, ramp_s);
            (length_m - speed * s, scale, -rate)
        }
    }

    pub(super) fn at(&self, time_s: f64) -> Reference {
        let (s, start_scale, start_rate) = time_scaling(time_s, self.ramp_s);
        let at = self.locate(s);
        let (position, tangent, curvature) = match at.segment {
            PathSegment::Out => {
                let tangent = self.first_m / norm(&self.first_m);
                (
                    self.centre_m + tangent * at.along_m,
                    tangent,
                    Vector3::zeros(),
                )
            }
            PathSegment::Ellipse => self.on_ellipse(at.along_m),
            PathSegment::Back => {
                let tangent = -self.second_m / norm(&self.second_m);
                let position = self.centre_m + self.second_m + tangent * at.along_m;
                (position, tangent, Vector3::zeros())
            }
        };
        let speed = self.speed_m_per_s * start_scale * at.time_scale;
        let rate = start_rate * at.time_scale + start_scale * start_scale * at.time_scale_rate;
        Reference {
            position,
            velocity: tangent * speed,
            acceleration: curvature * (speed * speed) + tangent * (self.speed_m_per_s * rate),
        }
    }

    /// Returns the position, unit tangent and curvature vector \[1/m\] at an arc length from the first semi-axis.
    fn on_ellipse(&self, along: f64) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
        let k = self.arc_length_m[1..KNOTS - 1]
            .iter()
            .take_while(|length| **length <= along)
            .count();
        let mut u = knot(k);
        for _ in 0..6 {
            let error = self.arc_length_m[k] + self.arc_between(knot(k), u) - along;
            let step = error / self.arc_length_rate(u);
            u -= step;
            if abs(step) < 1e-15 {
                break;
            }
        }
        let (sin, cos) = sin_cos(u);
        let first_derivative = self.second_m * cos - self.first_m * sin;
        let second_derivative = -(self.first_m * cos + self.second_m * sin);
        let arc_length_rate2 = first_derivative.dot(&first_derivative);
        let tangent = first_derivative / sqrt(arc_length_rate2);
        let curvature =
            (second_derivative - tangent * tangent.dot(&second_derivative)) / arc_length_rate2;
        let position = self.centre_m + self.first_m * cos + self.second_m * sin;
        (position, tangent, curvature)
    }

    fn arc_length_rate(&self, u: f64) -> f64 {
        let (sin, cos) = sin_cos(u);
        norm(&(self.second_m * cos - self.first_m * sin))
    }

    fn arc_between(&self, from: f64, to: f64) -> f64 {
        let (mid, half) = (0.5 * (from + to), 0.5 * (to - from));
        let sum: f64 = GAUSS
            .iter()
            .map(|(x, weight)| weight * self.arc_length_rate(mid + half * x))
            .sum();
        sum * half
    }

    /// As [`super::Trajectory::peaks`]; the curvature of the ellipse is largest at the end of its
    /// longer semi-axis.
    pub(super) fn peaks(&self) -> (f64, f64) {
        let (first, second) = (norm(&self.first_m), norm(&self.second_m));
        let (long, short) = (first.max(second), first.min(second));
        let speed = self.speed_m_per_s;
        let bend = speed * long / (short * short);
        let corner = if self.corner_ramp_s > 0.0 {
            MINIMUM_JERK_SPEED / self.corner_ramp_s
        } else {
            0.0
        };
        let start = MINIMUM_JERK_SPEED / self.ramp_s;
        (speed, speed * (start + bend + corner))
    }

    /// Returns the time of the ramp and one lap \[s\].
    pub(super) fn length_s(&self) -> f64 {
        self.ramp_s + self.period_s()
    }

    pub(super) fn validate(&self) -> Result<(), TrajectoryError> {
        finite("centre_m", &self.centre_m)?;
        finite("first_m", &self.first_m)?;
        finite("second_m", &self.second_m)?;
        positive("length of first_m", norm(&self.first_m))?;
        positive("length of second_m", norm(&self.second_m))?;
        let cosine =
            self.first_m.dot(&self.second_m) / (norm(&self.first_m) * norm(&self.second_m));
        if abs(cosine) > 1e-9 {
            return Err(TrajectoryError {
                entry: "cosine between first_m and second_m",
                value: cosine,
                must: "zero: the semi-axes are orthogonal",
            });
        }
        positive("speed_m_per_s", self.speed_m_per_s)?;
        positive("ramp_s", self.ramp_s)?;
        let shortest_m = self.lengths_m().into_iter().fold(f64::INFINITY, f64::min);
        let corner_m = self.corner_ramp_s * self.speed_m_per_s;
        if (0.0..=shortest_m).contains(&corner_m) {
            return Ok(());
        }
        Err(TrajectoryError {
            entry: "corner_ramp_s",
            value: self.corner_ramp_s,
            must: "zero, or at most the time of the shortest segment at full speed",
        })
    }
}

fn knot(k: usize) -> f64 {
    core::f64::consts::FRAC_PI_2 * k as f64 / (KNOTS - 1) as f64
}

fn norm(v: &Vector3<f64>) -> f64 {
    sqrt(v.dot(v))
}
