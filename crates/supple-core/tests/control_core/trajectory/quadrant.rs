//! The quadrant: constant speed on every segment, and corners where only the velocity jumps.

use super::derivatives::quadrant;
use crate::support::property::{Outcome, check};
use proptest::prelude::*;
use supple_core::Trajectory;
use supple_core::math::Vector3;
use supple_core::trajectory::{PathSegment, Quadrant};

/// Time after which the ramp of every quadrant here has ended.
const AFTER_RAMP_S: f64 = 1.0;

/// A quarter of an ellipse's perimeter by a fine midpoint rule, which converges exponentially on a
/// periodic integrand.
fn quarter_perimeter(a: f64, b: f64) -> f64 {
    let n = 4096;
    let h = std::f64::consts::FRAC_PI_2 / f64::from(n);
    let stretch = |u: f64| (a * u.sin()).hypot(b * u.cos());
    (0..n).map(|k| stretch((f64::from(k) + 0.5) * h) * h).sum()
}

/// A quadrant with a time after the ramp, and its frame.
#[derive(Clone, Debug)]
struct Case {
    quadrant: Quadrant,
    time_s: f64,
    first: Vector3<f64>,
    second: Vector3<f64>,
    centre: Vector3<f64>,
    speed: f64,
}

fn case() -> impl Strategy<Value = Case> {
    (quadrant(), 0.0..2.0).prop_map(|(quadrant, laps)| {
        let corner = |segment| {
            let time_s = start_of(&quadrant, segment);
            Trajectory::Quadrant(quadrant).at(time_s).position
        };
        let centre = Trajectory::Quadrant(quadrant).at(0.0).position;
        let time_s = AFTER_RAMP_S + laps * quadrant.period_s();
        Case {
            quadrant,
            time_s,
            first: corner(PathSegment::Ellipse) - centre,
            second: corner(PathSegment::Back) - centre,
            centre,
            speed: Trajectory::Quadrant(quadrant).at(time_s).velocity.norm(),
        }
    })
}

/// First representable time at which `segment` has begun in the second lap.
fn start_of(quadrant: &Quadrant, segment: PathSegment) -> f64 {
    let period_s = quadrant.period_s();
    let begun = |t: f64| {
        let (now, _, lap) = quadrant.segment_at(t);
        let rank = |p: PathSegment| p as u32;
        (lap, rank(now)) >= (u32::from(first_lap_after_ramp(quadrant)), rank(segment))
    };
    let (mut before, mut after) = (0.0, AFTER_RAMP_S + 20.0 * period_s);
    for _ in 0..200 {
        let mid = 0.5 * (before + after);
        if begun(mid) {
            after = mid;
        } else {
            before = mid;
        }
    }
    after
}

/// The first lap after the ramp.
fn first_lap_after_ramp(quadrant: &Quadrant) -> u8 {
    let (_, _, lap) = quadrant.segment_at(AFTER_RAMP_S);
    u8::try_from(lap + 1).expect("few laps in a second")
}

fn speed_is_constant(case: Case) -> Outcome {
    let reference = Trajectory::Quadrant(case.quadrant).at(case.time_s);
    let period_s = case.quadrant.period_s();
    let length: f64 = case.quadrant.lengths_m().iter().sum();
    prop_assert!((case.speed - length / period_s).abs() <= 1e-12 * case.speed);
    // The acceleration has no component along the velocity.
    let along = reference.acceleration.dot(&reference.velocity) / case.speed;
    prop_assert!(along.abs() <= 1e-12 * (1.0 + reference.acceleration.norm()));
    Ok(())
}

fn points_lie_on_the_path(case: Case) -> Outcome {
    let reference = Trajectory::Quadrant(case.quadrant).at(case.time_s);
    let (segment, share, _) = case.quadrant.segment_at(case.time_s);
    prop_assert!((0.0..=1.0 + 1e-12).contains(&share));
    let (a, b) = (case.first.norm(), case.second.norm());
    let from_centre = reference.position - case.centre;
    let (x, y) = (
        from_centre.dot(&case.first) / a,
        from_centre.dot(&case.second) / b,
    );
    let off_plane = from_centre - case.first * (x / a) - case.second * (y / b);
    prop_assert!(off_plane.norm() < 1e-12);
    match segment {
        PathSegment::Out => {
            prop_assert!(y.abs() < 1e-12 && (x - share * a).abs() < 1e-12);
            prop_assert_eq!(reference.acceleration, Vector3::zeros());
        }
        PathSegment::Back => {
            prop_assert!(x.abs() < 1e-12 && (y - (1.0 - share) * b).abs() < 1e-12);
            prop_assert_eq!(reference.acceleration, Vector3::zeros());
        }
        PathSegment::Ellipse => {
            let on = (x / a).powi(2) + (y / b).powi(2);
            prop_assert!((on - 1.0).abs() < 1e-11 && x > -1e-12 && y > -1e-12);
            // Curvature of an ellipse at (x, y), towards the inside.
            let w = (x * b / a).powi(2) + (y * a / b).powi(2);
            let curvature = a * b / w.powf(1.5);
            let expected = curvature * case.speed * case.speed;
            prop_assert!((reference.acceleration.norm() - expected).abs() < 1e-9 * expected);
            prop_assert!(reference.acceleration.dot(&from_centre) < 0.0);
        }
    }
    Ok(())
}

fn lengths(case: Case) -> Outcome {
    let (a, b) = (case.first.norm(), case.second.norm());
    let [out, ellipse, back] = case.quadrant.lengths_m();
    prop_assert!((out - a).abs() < 1e-12 && (back - b).abs() < 1e-12);
    let exact = quarter_perimeter(a, b);
    let error = (ellipse - exact).abs() / exact;
    prop_assert!(error < 1e-8, "{error:.1e} off at axes {a} and {b}");
    Ok(())
}

fn closes_on_itself(case: Case) -> Outcome {
    let trajectory = Trajectory::Quadrant(case.quadrant);
    let now = trajectory.at(case.time_s);
    // Away from the corners, where a rounding error of time decides the segment.
    let (_, share, _) = case.quadrant.segment_at(case.time_s);
    let later = trajectory.at(case.time_s + case.quadrant.period_s());
    prop_assert!((later.position - now.position).norm() < 1e-11);
    if (1e-6..1.0 - 1e-6).contains(&share) {
        prop_assert!((later.velocity - now.velocity).norm() < 1e-9);
    }
    Ok(())
}

fn corners_jump_in_velocity_alone(case: Case) -> Outcome {
    let trajectory = Trajectory::Quadrant(case.quadrant);
    let (first, second) = (case.first.normalize(), case.second.normalize());
    for (segment, before, after) in [
        (PathSegment::Out, -second, first),
        (PathSegment::Ellipse, first, second),
        (PathSegment::Back, -first, -second),
    ] {
        let time_s = start_of(&case.quadrant, segment);
        let (left, right) = (trajectory.at(time_s - 1e-9), trajectory.at(time_s + 1e-9));
        prop_assert!((right.position - left.position).norm() < 1e-8);
        prop_assert!((left.velocity - before * case.speed).norm() < 1e-6 * case.speed);
        prop_assert!((right.velocity - after * case.speed).norm() < 1e-6 * case.speed);
        let jump = (right.velocity - left.velocity).norm();
        prop_assert!((jump - case.speed * 2.0_f64.sqrt()).abs() < 1e-6 * case.speed);
        // The maximum centripetal acceleration of the ellipse, without the velocity jump.
        let (a, b) = (case.first.norm(), case.second.norm());
        let max = a.max(b) / a.min(b).powi(2) * case.speed.powi(2);
        for side in [left, right] {
            prop_assert!(side.acceleration.norm() <= max * (1.0 + 1e-9));
        }
    }
    Ok(())
}

macro_rules! of_any_quadrant {
    ($($property:ident),* $(,)?) => {$(
        mod $property {
            #[test]
            fn of_any_quadrant() {
                crate::support::property::check(300, super::case(), super::$property);
            }
        }
    )*};
}

of_any_quadrant!(
    speed_is_constant,
    points_lie_on_the_path,
    lengths,
    closes_on_itself,
    corners_jump_in_velocity_alone,
);

#[test]
fn the_ramp_reaches_the_speed_and_adds_half_its_time() {
    let quadrant = Quadrant::vertical(0.1);
    let at = |t: f64| Trajectory::Quadrant(quadrant).at(t);
    let mut last = 0.0;
    for k in 0..=500 {
        let speed = at(1e-3 * f64::from(k)).velocity.norm();
        assert!(speed >= last - 1e-15, "the speed only grows");
        last = speed;
    }
    assert!((last - 0.1).abs() < 1e-15);
    let covered = (at(0.5).position - at(0.0).position).norm();
    assert!((covered - 0.1 * 0.25).abs() < 1e-14);
    let lap = at(0.25 + quadrant.period_s());
    assert!((lap.position - at(0.0).position).norm() < 1e-12);
}

/// With corner ramps the velocity is continuous everywhere and zero at the corners, the same path is followed, and
/// a lap takes three ramps longer.
#[test]
fn corner_ramps_leave_the_path_and_stop_at_its_corners() {
    check(
        100,
        (quadrant(), 0.05..1.0),
        |(without, share): (Quadrant, f64)| {
            let speed = without.speed_m_per_s();
            let shortest_m = without.lengths_m().into_iter().fold(f64::MAX, f64::min);
            let ramp_s = share * shortest_m / speed;
            let with = without.with_corner_ramp(ramp_s);
            prop_assert!(
                (with.period_s() - without.period_s() - 3.0 * ramp_s).abs()
                    < 1e-12 * with.period_s()
            );
            let (_, max_acceleration) = Trajectory::Quadrant(with).peaks();
            for segment in [PathSegment::Out, PathSegment::Ellipse, PathSegment::Back] {
                let start_s = start_of(&with, segment);
                let trajectory = Trajectory::Quadrant(with);
                for beside_s in [-1e-6 * ramp_s, 1e-6 * ramp_s] {
                    let velocity = trajectory.at(start_s + beside_s).velocity;
                    prop_assert!(velocity.norm() < 1e-9 * speed);
                }
                let corner_m = Trajectory::Quadrant(without)
                    .at(start_of(&without, segment))
                    .position;
                prop_assert!((trajectory.at(start_s).position - corner_m).norm() < 1e-8);
                let middle = trajectory.at(start_s + 0.5 * ramp_s);
                prop_assert!(middle.acceleration.norm() <= max_acceleration);
            }
            Ok(())
        },
    );
}

/// The arc length is accurate to 12 digits up to an axis ratio of 2, as in the paper's figure, and
/// to 8 digits up to 8.
#[test]
fn arc_length_of_round_and_slender_quadrants() {
    check(300, 1.0..8.0, |ratio: f64| {
        let first = Vector3::new(0.3, 0.0, 0.0);
        let second = Vector3::new(0.0, 0.3 / ratio, 0.0);
        let quadrant = Quadrant::new(Vector3::zeros(), first, second, 0.1, 0.1);
        let exact = quarter_perimeter(0.3, 0.3 / ratio);
        let error = (quadrant.lengths_m()[1] - exact).abs() / exact;
        let bound = if ratio <= 2.0 { 1e-12 } else { 1e-8 };
        prop_assert!(error < bound, "{error:.1e} at {ratio}");
        Ok(())
    });
}
