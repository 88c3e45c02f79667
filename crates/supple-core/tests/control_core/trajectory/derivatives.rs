//! Velocity is the derivative of position, acceleration that of velocity, and all trajectories
//! start from rest.

use crate::support::property::{Outcome, check, vector3};
use proptest::prelude::*;
use supple_core::Trajectory;
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Line, PathSegment, Probe, Quadrant, Sinusoid};

/// A trajectory, a time on it, and the scales of its derivatives.
#[derive(Clone, Debug)]
pub struct Walk {
    pub trajectory: Trajectory,
    pub time_s: f64,
    /// Shortest time in which anything changes \[s\].
    pub tau_s: f64,
    /// Maximum speed \[m/s\].
    pub speed_m_per_s: f64,
}

fn line() -> impl Strategy<Value = Walk> {
    (vector3(1.0), vector3(1.0), 0.2..5.0, -0.1..1.2).prop_map(|(from_m, to_m, duration_s, x)| {
        Walk {
            trajectory: Trajectory::Line(Line {
                from_m,
                to_m,
                duration_s,
            }),
            time_s: x * duration_s,
            tau_s: duration_s,
            speed_m_per_s: 1.875 * (to_m - from_m).norm() / duration_s,
        }
    })
}

fn sinusoid() -> impl Strategy<Value = Walk> {
    (vector3(1.0), vector3(0.3), 0.1..10.0, 0.1..2.0, 0.0..20.0).prop_map(
        |(centre_m, amplitude_m, w, ramp_s, time_s)| Walk {
            trajectory: Trajectory::Sinusoid(Sinusoid {
                centre_m,
                amplitude_m,
                angular_frequency_rad_per_s: w,
                ramp_s,
            }),
            time_s,
            tau_s: (1.0 / w).min(ramp_s),
            speed_m_per_s: amplitude_m.norm() * w,
        },
    )
}

fn arc() -> impl Strategy<Value = Walk> {
    let place = (0.2..1.0, -0.5..0.5, -3.0..3.0, 0.05..1.5);
    (place, 0.1..10.0, 0.1..2.0, 0.0..20.0).prop_map(
        |((radius_m, height_m, centre_rad, amplitude_rad), w, ramp_s, time_s)| Walk {
            trajectory: Trajectory::Arc(Arc {
                radius_m,
                height_m,
                centre_rad,
                amplitude_rad,
                angular_frequency_rad_per_s: w,
                ramp_s,
            }),
            time_s,
            tau_s: (1.0 / w).min(ramp_s).min(1.0 / (amplitude_rad * w)),
            speed_m_per_s: radius_m * amplitude_rad * w,
        },
    )
}

/// A quadrant in any plane with any unequal semi-axes.
pub fn quadrant() -> impl Strategy<Value = Quadrant> {
    let semi_axes = (vector3(1.0), vector3(1.0), 0.05..0.4, 0.05..0.4)
        .prop_filter("two directions", |(a, b, ..)| {
            a.norm() > 0.1 && a.cross(b).norm() > 0.1
        });
    (vector3(0.5), semi_axes, 0.02..0.5, 0.05..1.0).prop_map(
        |(centre, (a, b, first, second), speed, ramp_s)| {
            let a = a.normalize();
            let b = (b - a * a.dot(&b)).normalize();
            Quadrant::new(centre, a * first, b * second, speed, ramp_s)
        },
    )
}

/// Quadrants with corners at which the velocity jumps, and with ramps up to the maximum length for the shortest segment.
fn quadrant_walk() -> impl Strategy<Value = Walk> {
    let corner = prop_oneof![Just(0.0), 0.05..1.0];
    (quadrant(), 0.0..2.5, corner).prop_map(|(quadrant, rounds, corner)| {
        let shortest_m = quadrant.lengths_m().into_iter().fold(f64::MAX, f64::min);
        let corner_ramp_s = corner * shortest_m / quadrant.speed_m_per_s();
        let quadrant = quadrant.with_corner_ramp(corner_ramp_s);
        let period_s = quadrant.period_s();
        let speed_m_per_s = quadrant.speed_m_per_s();
        let mut tau_s = 0.1 * shortest_m / speed_m_per_s;
        if corner_ramp_s > 0.0 {
            tau_s = tau_s.min(0.3 * corner_ramp_s);
        }
        // The ramp ends within a second: it is short compared with the segments, or the segments are short
        // compared with it.
        Walk {
            trajectory: Trajectory::Quadrant(quadrant),
            time_s: rounds * period_s,
            tau_s: tau_s.min(0.05),
            speed_m_per_s,
        }
    })
}

/// Any valid probing cycle.
pub fn probe() -> impl Strategy<Value = Probe> {
    let place = (0.3..0.6, -0.3..0.3, -3.0..3.0);
    let shape = (1_u32..5, 0.002..0.05, 0.02..0.2, -0.4..0.4);
    let dwell_s = prop_oneof![Just(0.0), 0.01..3.0];
    (place, shape, 0.01..0.3, 0.01..1.0, dwell_s).prop_map(
        |(
            (radius_m, top_m, azimuth_rad),
            (strokes, radial_step_m, stroke_m, azimuth_step_rad),
            speed_m_per_s,
            ramp_share,
            dwell_s,
        )| Probe {
            radius_m,
            strokes,
            radial_step_m,
            top_m,
            stroke_m,
            azimuth_rad,
            azimuth_step_rad,
            speed_m_per_s,
            ramp_s: ramp_share * stroke_m / speed_m_per_s,
            dwell_s,
        },
    )
}

fn probe_walk() -> impl Strategy<Value = Walk> {
    (probe(), 0.0..3.0).prop_map(|(probe, columns)| Walk {
        trajectory: Trajectory::Probe(probe),
        time_s: columns * probe.column_s(),
        tau_s: probe.ramp_s,
        speed_m_per_s: probe.speed_m_per_s,
    })
}

/// A corner of the quadrant within `h` of the time.
fn at_corner(walk: &Walk, h: f64) -> bool {
    let Trajectory::Quadrant(quadrant) = walk.trajectory else {
        return false;
    };
    let segment = |t: f64| -> PathSegment { quadrant.segment_at(t).0 };
    segment(walk.time_s - h) != segment(walk.time_s + h)
}

fn derivatives(walk: Walk) -> Outcome {
    let h = 1e-5 * walk.tau_s;
    if at_corner(&walk, 2.0 * h) {
        return Ok(());
    }
    let at = |t: f64| walk.trajectory.at(t);
    let (before, now, after) = (at(walk.time_s - h), at(walk.time_s), at(walk.time_s + h));
    let speed = walk.speed_m_per_s;
    let velocity = (after.position - before.position) / (2.0 * h);
    let error = (velocity - now.velocity).norm();
    let rounding = 1e-14 / h;
    prop_assert!(
        error <= 1e-6 * speed + rounding,
        "velocity off by {error:.1e} m/s at {speed} m/s: {now:?} {velocity}"
    );
    let acceleration = (after.velocity - before.velocity) / (2.0 * h);
    let scale = speed / walk.tau_s;
    let error = (acceleration - now.acceleration).norm();
    prop_assert!(
        error <= 1e-3 * scale + rounding,
        "acceleration off by {error:.1e} m/s^2 at a scale of {scale}: {now:?} {acceleration}"
    );
    prop_assert!(now.velocity.norm() <= speed * (1.0 + 1e-12) + 1e-15);
    Ok(())
}

fn rest_at_the_start(walk: Walk) -> Outcome {
    let start = walk.trajectory.at(0.0);
    prop_assert_eq!(start.velocity, Vector3::zeros());
    prop_assert_eq!(start.acceleration, Vector3::zeros());
    prop_assert_eq!(walk.trajectory.at(-1.0), start);
    prop_assert_eq!(walk.trajectory.at(f64::NAN), start);
    prop_assert!(walk.trajectory.validate().is_ok());
    // The time scaling rises smoothly: after a thousandth of the ramp there is almost no speed.
    let soon = walk.trajectory.at(1e-3 * walk.tau_s);
    prop_assert!(soon.velocity.norm() <= 1e-3 * walk.speed_m_per_s);
    Ok(())
}

/// The position does not jump, also at corners: the tip never exceeds its maximum speed.
fn continuity(walk: Walk) -> Outcome {
    let dt = 1e-3 * walk.tau_s;
    let mut last = walk.trajectory.at(walk.time_s).position;
    for k in 1..200 {
        let next = walk.trajectory.at(walk.time_s + f64::from(k) * dt).position;
        let step = (next - last).norm();
        prop_assert!(
            step <= walk.speed_m_per_s * dt * (1.0 + 1e-6) + 1e-14,
            "a step of {step} m in {dt} s"
        );
        last = next;
    }
    Ok(())
}

macro_rules! for_every_trajectory {
    ($($property:ident),* $(,)?) => {$(
        mod $property {
            use super::*;
            #[test]
            fn of_the_line() { check(500, line(), super::$property); }
            #[test]
            fn of_the_sinusoid() { check(500, sinusoid(), super::$property); }
            #[test]
            fn of_the_arc() { check(500, arc(), super::$property); }
            #[test]
            fn of_the_quadrant() { check(500, quadrant_walk(), super::$property); }
            #[test]
            fn of_the_probe() { check(500, probe_walk(), super::$property); }
        }
    )*};
}

for_every_trajectory!(derivatives, rest_at_the_start, continuity);
