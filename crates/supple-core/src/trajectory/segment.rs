//! Segment of a motion given by successive set-points: from the present reference to the newest set-point,
//! then to rest.

use super::reference::Reference;
use crate::math::{Vector3, sqrt};

/// Number of samples for the peaks on the way to the set-point; between two samples, speed and acceleration of a
/// motion from rest to rest exceed the samples by less than 2 %.
const SAMPLES: u32 = 16;
/// Number of samples for the peaks while the reference comes to rest.
const STOP_SAMPLES: u32 = 8;
/// Shortest time in which the reference comes to rest \[s\].
const MIN_STOP_S: f64 = 0.1;
/// Stopping time divided by the ratio of speed to acceleration limit. The mean deceleration is thus a third of the limit, so
/// that the initial acceleration can fade within the limit.
const STOP_SHARE: f64 = 3.0;

/// Quintic polynomial between two references that are given with velocity and acceleration. After its end the velocity
/// falls to zero, and the reference stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    from: Reference,
    from_s: f64,
    to: Reference,
    duration_s: f64,
    stop_s: f64,
}

/// Peak values along a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPeaks {
    /// Speed \[m/s\].
    pub speed_m_per_s: f64,
    /// Acceleration \[m/s^2\].
    pub acceleration_m_per_s2: f64,
}

impl Segment {
    /// Creates a segment from `from` at `from_s` to `to`, `duration_s` later; after it the reference stops with about a third of
    /// `max_acceleration_m_per_s2`. `from_s` \[s\] is on the clock of [`Segment::at`]; `duration_s` and the
    /// acceleration are positive.
    pub fn new(
        from: Reference,
        from_s: f64,
        to: Reference,
        duration_s: f64,
        max_acceleration_m_per_s2: f64,
    ) -> Segment {
        let speed = sqrt(to.velocity.dot(&to.velocity));
        Segment {
            from,
            from_s,
            to,
            duration_s,
            stop_s: (STOP_SHARE * speed / max_acceleration_m_per_s2).max(MIN_STOP_S),
        }
    }

    /// Returns the reference at a time \[s\]; before the start it is the start.
    pub fn at(&self, time_s: f64) -> Reference {
        let since_s = (time_s - self.from_s).max(0.0);
        if since_s < self.duration_s {
            return self.quintic(since_s / self.duration_s);
        }
        let after_s = since_s - self.duration_s;
        self.stopping((after_s / self.stop_s).min(1.0))
    }

    /// Returns the position at which the reference comes to rest \[m\], base axes.
    pub fn rest_m(&self) -> Vector3<f64> {
        self.stopping(1.0).position
    }

    /// Returns the time from the start of the segment until the reference rests \[s\].
    pub fn length_s(&self) -> f64 {
        self.duration_s + self.stop_s
    }

    /// Peaks over the whole length, from samples.
    pub fn peaks(&self) -> SegmentPeaks {
        let way = (0..=SAMPLES).map(|k| self.quintic(f64::from(k) / f64::from(SAMPLES)));
        let stop =
            (0..=STOP_SAMPLES).map(|k| self.stopping(f64::from(k) / f64::from(STOP_SAMPLES)));
        let (speed, acceleration) = way.chain(stop).fold((0.0, 0.0), |(v, a): (f64, f64), r| {
            // Not `max`, which would drop a NaN.
            let greater = |old: f64, new: f64| if new <= old { old } else { new };
            (
                greater(v, r.velocity.dot(&r.velocity)),
                greater(a, r.acceleration.dot(&r.acceleration)),
            )
        });
        SegmentPeaks {
            speed_m_per_s: sqrt(speed),
            acceleration_m_per_s2: sqrt(acceleration),
        }
    }

    /// Points along the segment at which borders are checked \[m\].
    pub fn points_m(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let way = (1..=SAMPLES).map(|k| self.quintic(f64::from(k) / f64::from(SAMPLES)).position);
        way.chain([self.rest_m()])
    }

    /// Returns the polynomial, in Bernstein form, at a fraction of its duration.
    fn quintic(&self, share: f64) -> Reference {
        let (from, to, t) = (&self.from, &self.to, self.duration_s);
        let (a, b) = (t / 5.0, t * t / 20.0);
        let points = [
            from.position,
            from.position + from.velocity * a,
            from.position + from.velocity * (2.0 * a) + from.acceleration * b,
            to.position - to.velocity * (2.0 * a) + to.acceleration * b,
            to.position - to.velocity * a,
            to.position,
        ];
        let velocities: [Vector3<f64>; 5] =
            core::array::from_fn(|i| (points[i + 1] - points[i]) * (5.0 / t));
        let accelerations: [Vector3<f64>; 4] =
            core::array::from_fn(|i| (velocities[i + 1] - velocities[i]) * (4.0 / t));
        Reference {
            position: de_casteljau(points, share),
            velocity: de_casteljau(velocities, share),
            acceleration: de_casteljau(accelerations, share),
        }
    }

    /// Returns the reference after the end, at a fraction of the stopping time: velocity and acceleration decrease to zero along
    /// a cubic.
    fn stopping(&self, share: f64) -> Reference {
        let (to, t) = (&self.to, self.stop_s);
        let x = share;
        let (x2, x3) = (x * x, x * x * x);
        Reference {
            position: to.position
                + to.velocity * (t * (x - x3 + 0.5 * x2 * x2))
                + to.acceleration * (t * t * (0.5 * x2 - 2.0 / 3.0 * x3 + 0.25 * x2 * x2)),
            velocity: to.velocity * (1.0 - 3.0 * x2 + 2.0 * x3)
                + to.acceleration * (t * (x - 2.0 * x2 + x3)),
            acceleration: to.velocity * (6.0 * (x2 - x) / t)
                + to.acceleration * (1.0 - 4.0 * x + 3.0 * x2),
        }
    }
}

/// Returns the value of a Bezier curve.
fn de_casteljau<const K: usize>(mut points: [Vector3<f64>; K], share: f64) -> Vector3<f64> {
    for level in (1..K).rev() {
        for i in 0..level {
            points[i] = points[i] + (points[i + 1] - points[i]) * share;
        }
    }
    points[0]
}
