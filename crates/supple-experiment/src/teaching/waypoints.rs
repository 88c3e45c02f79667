//! Computes times for waypoints: a smooth path through them, passed as fast as the limits of speed and acceleration allow.
//!
//! The path is a cubic spline `p(s)` over its length `s`. With `x = s'^2` and the curvature `k(s)` the acceleration is
//! `sqrt(s''^2 + k^2 x^2)`, its two parts being perpendicular. `x` is bounded by `v^2` and `a/k`; one pass backwards gives
//! the largest `x` from which the arm can still slow down, one forwards the largest that it can reach (the two passes of
//! reachability analysis, Pham and Pham 2018, in closed form for these limits). A mean over [`SMOOTHING_S`] bounds the jerk.

use super::RecordedMotion;
use nalgebra::DMatrix;
use supple_core::math::Vector3;

/// Maximum number of waypoints.
const MAX_POINTS: usize = 500;
/// Minimum distance between two waypoints \[m\].
const MIN_DISTANCE_M: f64 = 1e-3;
/// Number of intervals of the path in the computation of times.
const INTERVALS: usize = 4000;
/// Number of intervals between two waypoints in the computation of the path's length.
const PER_POINT: usize = 200;
/// Time over which the speed along the path is averaged \[s\].
const SMOOTHING_S: f64 = 0.1;
/// Time between two samples of the result \[s\].
const SAMPLE_S: f64 = 0.005;

/// Error of waypoints.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WaypointError {
    /// There are too many waypoints.
    #[error(
        "{found} waypoints: give at most {MAX_POINTS}; with a column time_s a motion may have any number"
    )]
    TooMany {
        /// Points found.
        found: usize,
    },
    /// Two consecutive waypoints are too close.
    #[error("waypoints {first} and {} are {distance_m} m apart: leave one of them out", first + 1)]
    TooClose {
        /// Number of the first of the two, from 1.
        first: usize,
        /// Their distance \[m\].
        distance_m: f64,
    },
}

/// Returns the motion through these points \[m\], from rest to rest, with at most this speed \[m/s\] and acceleration \[m/s^2\],
/// both positive.
///
/// # Errors
/// [`WaypointError`].
pub fn time_waypoints(
    points_m: &[Vector3<f64>],
    speed_m_per_s: f64,
    acceleration_m_per_s2: f64,
) -> Result<RecordedMotion, WaypointError> {
    if points_m.len() > MAX_POINTS {
        return Err(WaypointError::TooMany {
            found: points_m.len(),
        });
    }
    for (index, pair) in points_m.windows(2).enumerate() {
        let distance_m = (pair[1] - pair[0]).norm();
        if distance_m < MIN_DISTANCE_M {
            return Err(WaypointError::TooClose {
                first: index + 1,
                distance_m,
            });
        }
    }
    let path = even_path(&Spline::new(points_m));
    let times_s = times(&path, speed_m_per_s, acceleration_m_per_s2);
    Ok(sampled(&path, &times_s))
}

/// Natural cubic spline through points, whose parameter is the sum of the distances between the points.
struct Spline<'a> {
    points_m: &'a [Vector3<f64>],
    knots_m: Vec<f64>,
    /// Second derivative at each knot \[1/m\].
    curves: Vec<Vector3<f64>>,
}

impl Spline<'_> {
    fn new(points_m: &[Vector3<f64>]) -> Spline<'_> {
        let mut knots_m = vec![0.0];
        for pair in points_m.windows(2) {
            knots_m.push(knots_m[knots_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        let n = points_m.len();
        let mut system = DMatrix::<f64>::identity(n, n);
        let mut right = DMatrix::<f64>::zeros(n, 3);
        for i in 1..n.saturating_sub(1) {
            let (before, after) = (knots_m[i] - knots_m[i - 1], knots_m[i + 1] - knots_m[i]);
            system[(i, i - 1)] = before;
            system[(i, i)] = 2.0 * (before + after);
            system[(i, i + 1)] = after;
            let change =
                (points_m[i + 1] - points_m[i]) / after - (points_m[i] - points_m[i - 1]) / before;
            for axis in 0..3 {
                right[(i, axis)] = 6.0 * change[axis];
            }
        }
        // The matrix is diagonally dominant, so it is regular.
        let solved = system.lu().solve(&right);
        let curves = solved.map_or_else(
            || vec![Vector3::zeros(); n],
            |curves| {
                (0..n)
                    .map(|i| Vector3::new(curves[(i, 0)], curves[(i, 1)], curves[(i, 2)]))
                    .collect()
            },
        );
        Spline {
            points_m,
            knots_m,
            curves,
        }
    }

    /// Returns the point at a fraction of the interval from one knot to the next \[m\].
    fn at(&self, knot: usize, share: f64) -> Vector3<f64> {
        let h = self.knots_m[knot + 1] - self.knots_m[knot];
        let (a, b) = (1.0 - share, share);
        let bend = (self.curves[knot] * (a * a * a - a) + self.curves[knot + 1] * (b * b * b - b))
            * (h * h / 6.0);
        self.points_m[knot] * a + self.points_m[knot + 1] * b + bend
    }
}

/// Points of the path at equal distances along it.
struct Path {
    points_m: Vec<Vector3<f64>>,
    step_m: f64,
}

fn even_path(spline: &Spline<'_>) -> Path {
    let mut dense = vec![spline.points_m[0]];
    for knot in 0..spline.points_m.len() - 1 {
        dense.extend((1..=PER_POINT).map(|k| spline.at(knot, k as f64 / PER_POINT as f64)));
    }
    let mut along_m = vec![0.0];
    for pair in dense.windows(2) {
        along_m.push(along_m[along_m.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let step_m = along_m[along_m.len() - 1] / INTERVALS as f64;
    let mut points_m = Vec::with_capacity(INTERVALS + 1);
    let mut interval = 0;
    for k in 0..=INTERVALS {
        let at_m = step_m * k as f64;
        while interval + 2 < along_m.len() && along_m[interval + 1] < at_m {
            interval += 1;
        }
        let share = (at_m - along_m[interval]) / (along_m[interval + 1] - along_m[interval]);
        points_m.push(
            dense[interval] + (dense[interval + 1] - dense[interval]) * share.clamp(0.0, 1.0),
        );
    }
    Path { points_m, step_m }
}

/// Returns the time of each point of the path \[s\].
fn times(path: &Path, speed_m_per_s: f64, acceleration_m_per_s2: f64) -> Vec<f64> {
    let (h, a) = (path.step_m, acceleration_m_per_s2);
    let last = path.points_m.len() - 1;
    // The curvature is taken over several steps, so that the chords of the dense path do not count as corners.
    let reach = (INTERVALS / 200).min(last / 2).max(1);
    let curvature: Vec<f64> = (0..=last)
        .map(|i| {
            let i = i.clamp(reach, last - reach);
            let (before, at, after) = (
                path.points_m[i - reach],
                path.points_m[i],
                path.points_m[i + reach],
            );
            (before - at * 2.0 + after).norm() / (h * reach as f64).powi(2)
        })
        .collect();
    let bound = |i: usize| (speed_m_per_s * speed_m_per_s).min(a / curvature[i].max(1e-9));
    // Maximum squared speeds from which the arm can stop at the end: x - 2 h sqrt(a^2 - (k x)^2) <= limit of the next point.
    let mut limit = vec![0.0; last + 1];
    for i in (0..last).rev() {
        let (c, k) = (limit[i + 1], curvature[i]);
        let (g, q) = (4.0 * h * h, 4.0 * h * h * k * k);
        let root = (g * a * a * (1.0 + q) - q * c * c).max(0.0).sqrt();
        limit[i] = bound(i).min((c + root) / (1.0 + q));
    }
    limit[0] = 0.0;
    let mut squared = vec![0.0; last + 1];
    for i in 0..last {
        let x = squared[i];
        let gain = 2.0 * h * (a * a - (curvature[i] * x).powi(2)).max(0.0).sqrt();
        squared[i + 1] = limit[i + 1].min(x + gain);
    }
    let mut times_s = vec![0.0];
    for pair in squared.windows(2) {
        let mean = 0.5 * (pair[0].sqrt() + pair[1].sqrt());
        times_s.push(times_s[times_s.len() - 1] + h / mean);
    }
    times_s
}

/// Returns samples of the motion at equal time intervals, with the distance along the path averaged over [`SMOOTHING_S`].
fn sampled(path: &Path, times_s: &[f64]) -> RecordedMotion {
    let length_m = path.step_m * (path.points_m.len() - 1) as f64;
    let way_m = |time_s: f64| {
        let after = times_s.partition_point(|t| *t <= time_s);
        match (after.checked_sub(1), after < times_s.len()) {
            (None, _) => 0.0,
            (Some(_), false) => length_m,
            (Some(before), true) => {
                let share = (time_s - times_s[before]) / (times_s[after] - times_s[before]);
                path.step_m * (before as f64 + share)
            }
        }
    };
    let duration_s = times_s[times_s.len() - 1] + SMOOTHING_S;
    let samples = (duration_s / SAMPLE_S).ceil() as usize;
    let parts = (SMOOTHING_S / SAMPLE_S).round() as usize * 4;
    let mut recorded = RecordedMotion::default();
    for k in 0..=samples {
        let time_s = SAMPLE_S * k as f64;
        let mean_m = (0..parts)
            .map(|part| way_m(time_s - SMOOTHING_S * (part as f64 + 0.5) / parts as f64))
            .sum::<f64>()
            / parts as f64;
        let at = (mean_m / path.step_m).clamp(0.0, (path.points_m.len() - 1) as f64);
        let before = (at as usize).min(path.points_m.len() - 2);
        let share = at - before as f64;
        let tip_m = path.points_m[before] * (1.0 - share) + path.points_m[before + 1] * share;
        recorded.time_s.push(time_s);
        recorded.tip_m.push(tip_m);
    }
    recorded
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the peak speed and acceleration, from differences over 40 ms.
    fn peaks(recorded: &RecordedMotion) -> (f64, f64) {
        let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
        let d = 8;
        for i in d..recorded.time_s.len() - d {
            let dt = SAMPLE_S * d as f64;
            let (p, q, r) = (
                recorded.tip_m[i - d],
                recorded.tip_m[i],
                recorded.tip_m[i + d],
            );
            speed = speed.max((r - p).norm() / (2.0 * dt));
            acceleration = acceleration.max((r - q * 2.0 + p).norm() / (dt * dt));
        }
        (speed, acceleration)
    }

    #[test]
    fn a_straight_line_takes_the_time_of_the_trapezoid() {
        let line = [Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0)];
        let recorded = time_waypoints(&line, 0.5, 1.0).expect("a path");
        // 1 m at 0.5 m/s and 1 m/s^2: 2 s at full speed plus half a second, and what the smoothing adds.
        assert!(
            (recorded.duration_s() - (2.5 + SMOOTHING_S)).abs() < 0.02,
            "{}",
            recorded.duration_s()
        );
        let (speed, acceleration) = peaks(&recorded);
        assert!((0.495..=0.5 + 1e-6).contains(&speed), "{speed}");
        assert!((0.9..=1.02).contains(&acceleration), "{acceleration}");
        assert_eq!(recorded.tip_m[0], line[0]);
        assert!((recorded.tip_m[recorded.tip_m.len() - 1] - line[1]).norm() < 1e-9);
    }

    #[test]
    fn a_circle_is_passed_at_the_speed_that_its_curvature_allows() {
        let radius_m = 0.1;
        let points: Vec<_> = (0..=36)
            .map(|k| {
                let angle = core::f64::consts::TAU * f64::from(k) / 36.0;
                Vector3::new(radius_m * angle.cos(), radius_m * angle.sin(), 0.0)
            })
            .collect();
        let recorded = time_waypoints(&points, 10.0, 0.9).expect("a path");
        let (speed, acceleration) = peaks(&recorded);
        // v^2 / r = a.
        assert!((speed / 0.3 - 1.0).abs() < 0.03, "{speed}");
        assert!((0.85..=0.95).contains(&acceleration), "{acceleration}");
        let way_m = core::f64::consts::TAU * radius_m;
        let at_full_speed_s = way_m / 0.3;
        assert!(recorded.duration_s() > at_full_speed_s);
        assert!(recorded.duration_s() < at_full_speed_s + 2.0 * 0.3 / 0.9 + SMOOTHING_S);
    }

    #[test]
    fn every_waypoint_is_passed_within_the_limits() {
        let points: Vec<_> = [
            [0.0, 0.0, 0.0],
            [0.2, 0.0, 0.1],
            [0.2, 0.2, 0.0],
            [0.0, 0.2, 0.1],
            [0.05, 0.05, 0.3],
        ]
        .map(Vector3::from)
        .to_vec();
        let recorded = time_waypoints(&points, 0.4, 1.5).expect("a path");
        for point in &points {
            let distance = recorded.tip_m.iter().map(|tip| (tip - point).norm());
            assert!(distance.fold(f64::MAX, f64::min) < 2e-3, "{point}");
        }
        let (speed, acceleration) = peaks(&recorded);
        assert!(
            speed <= 0.4 + 1e-6 && acceleration <= 1.5 * 1.1,
            "{speed} {acceleration}"
        );
        assert!(acceleration > 1.2, "the limit is used: {acceleration}");
    }

    #[test]
    fn too_many_or_too_close_waypoints_are_refused() {
        let twice = [Vector3::zeros(), Vector3::x(), Vector3::x()];
        let refused = time_waypoints(&twice, 1.0, 1.0);
        assert_eq!(
            refused,
            Err(WaypointError::TooClose {
                first: 2,
                distance_m: 0.0
            })
        );
        let many: Vec<_> = (0..=MAX_POINTS).map(|k| Vector3::x() * k as f64).collect();
        assert!(matches!(
            time_waypoints(&many, 1.0, 1.0),
            Err(WaypointError::TooMany { .. })
        ));
    }
}
