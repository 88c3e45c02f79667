//! The segment between two set-points: its ends, its derivatives, its stop, and the path of a sequence of segments.

use proptest::prelude::*;
use supple_core::Trajectory;
use supple_core::math::Vector3;
use supple_core::trajectory::{Reference, Segment, Sinusoid};

use crate::support::settings::config;

const MAX_ACCELERATION: f64 = 6.0;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-size..size, -size..size, -size..size].prop_map(Vector3::from)
}

fn reference() -> impl Strategy<Value = Reference> {
    (vector(1.0), vector(0.5), vector(2.0)).prop_map(|(position, velocity, acceleration)| {
        Reference {
            position,
            velocity,
            acceleration,
        }
    })
}

fn segment() -> impl Strategy<Value = Segment> {
    (reference(), reference(), 0.0..5.0, 0.01..1.0).prop_map(|(from, to, at_s, length_s)| {
        Segment::new(from, at_s, to, length_s, MAX_ACCELERATION)
    })
}

fn differ(a: &Reference, b: &Reference) -> f64 {
    let parts = [
        a.position - b.position,
        a.velocity - b.velocity,
        a.acceleration - b.acceleration,
    ];
    parts.iter().map(|part| part.norm()).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(config(128, 20_261_123))]

    #[test]
    fn it_passes_both_ends_and_rests_behind(
        (from, to, at_s, length_s) in (reference(), reference(), 0.0..5.0, 0.01..1.0)
    ) {
        let segment = Segment::new(from, at_s, to, length_s, MAX_ACCELERATION);
        prop_assert!(differ(&segment.at(at_s), &from) < 1e-9);
        prop_assert!(differ(&segment.at(at_s - 1.0), &from) < 1e-9);
        // The rounding error of the time is multiplied by the jerk, which is up to 60 m / (0.01 s)^3.
        prop_assert!(differ(&segment.at(at_s + length_s), &to) < 1e-6);
        let end = Reference::at_rest(segment.rest_m());
        for later_s in [0.0, 1e-3, 10.0] {
            let there = segment.at(at_s + segment.length_s() + 1e-9 + later_s);
            prop_assert!(differ(&there, &end) < 1e-6, "{there:?}");
        }
    }

    #[test]
    fn velocity_and_acceleration_are_the_derivatives(
        (from, to, at_s, length_s, share) in (reference(), reference(), 0.0..5.0, 0.01..1.0, 0.01..0.99)
    ) {
        let segment = Segment::new(from, at_s, to, length_s, MAX_ACCELERATION);
        let time_s = at_s + share * segment.length_s();
        let h = 1e-6;
        let (before, now, after) = (segment.at(time_s - h), segment.at(time_s), segment.at(time_s + h));
        let scale = 1.0 + segment.peaks().acceleration_m_per_s2;
        let velocity = (after.position - before.position) / (2.0 * h);
        prop_assert!((velocity - now.velocity).norm() < 1e-5 * scale);
        let acceleration = (after.velocity - before.velocity) / (2.0 * h);
        // The jerk jumps at two times; the difference across such a time uses both sides.
        prop_assert!((acceleration - now.acceleration).norm() < 2e-3 * scale);
    }

    #[test]
    fn peaks_are_the_greatest_values(segment in segment()) {
        let peaks = segment.peaks();
        for k in 0..=2000 {
            let there = segment.at(6.0 * f64::from(k) / 2000.0);
            prop_assert!(there.velocity.norm() <= 1.02 * peaks.speed_m_per_s + 1e-9);
            prop_assert!(there.acceleration.norm() <= 1.06 * peaks.acceleration_m_per_s2 + 1e-9);
        }
    }

    #[test]
    fn it_stops_within_the_limit(to in reference()) {
        let from = Reference { position: to.position - to.velocity * 0.1, ..to };
        let segment = Segment::new(from, 0.0, to, 0.1, MAX_ACCELERATION);
        for k in 0..=1000 {
            let there = segment.at(0.1 + 3.0 * f64::from(k) / 1000.0);
            let limit = to.acceleration.norm().max(MAX_ACCELERATION);
            prop_assert!(there.acceleration.norm() <= limit, "{there:?}");
        }
    }
}

/// Greatest distance from the paper's sinusoid after the first 50 ms, with set-points of it at 100 Hz, each 30 ms ahead.
fn streamed(of: impl Fn(&Trajectory, f64) -> Reference) -> f64 {
    let sinusoid = Trajectory::Sinusoid(Sinusoid::paper(1.0));
    let mut segment = Segment::new(
        sinusoid.at(0.0),
        0.0,
        sinusoid.at(0.0),
        0.03,
        MAX_ACCELERATION,
    );
    let mut worst = 0.0_f64;
    for k in 0..1000_u32 {
        let now_s = 0.01 * f64::from(k);
        let to = of(&sinusoid, now_s + 0.03);
        segment = Segment::new(segment.at(now_s), now_s, to, 0.03, MAX_ACCELERATION);
        for cycle in 0..10 {
            let time_s = now_s + 1e-3 * f64::from(cycle);
            let error = segment.at(time_s).position - sinusoid.at(time_s).position;
            if time_s > 0.05 {
                worst = worst.max(error.norm());
            }
        }
    }
    worst
}

#[test]
fn a_sequence_reproduces_the_curve_that_it_samples() {
    let with_derivatives = streamed(|sinusoid, time_s| sinusoid.at(time_s));
    assert!(with_derivatives < 1e-6, "{with_derivatives} m");
    // The set-points have positions alone: their velocity is derived from three positions, their acceleration is zero.
    let positions = streamed(|sinusoid, time_s| {
        let at = |steps: f64| sinusoid.at(time_s - 0.01 * steps).position;
        Reference {
            velocity: (at(0.0) * 3.0 - at(1.0) * 4.0 + at(2.0)) / 0.02,
            ..Reference::at_rest(at(0.0))
        }
    });
    assert!((1e-9..2e-4).contains(&positions), "{positions} m");
}
