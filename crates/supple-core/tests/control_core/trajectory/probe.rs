//! The probing cycle: down, up, out, and a step of the base joint.

use super::derivatives::probe;
use crate::support::property::{Outcome, check};
use proptest::prelude::*;
use supple_core::Trajectory;
use supple_core::trajectory::{Probe, ProbePhase, Reference};

fn paper() -> Probe {
    Probe {
        radius_m: 0.55,
        strokes: 4,
        radial_step_m: 0.00667,
        top_m: 0.02,
        stroke_m: 0.1,
        azimuth_rad: 0.2,
        azimuth_step_rad: 0.1,
        speed_m_per_s: 0.04,
        ramp_s: 0.1,
        dwell_s: 0.0,
    }
}

/// Radius, azimuth, height.
fn cylindrical(reference: &Reference) -> (f64, f64, f64) {
    let p = reference.position;
    (p.xy().norm(), p.y.atan2(p.x), p.z)
}

/// Times of the phase changes in the first two columns, with the phase that begins.
fn changes(probe: &Probe) -> Vec<(f64, ProbePhase, u32, u32)> {
    let mut found = Vec::new();
    let end = 2.0 * probe.column_s();
    let place = |t: f64| {
        let (phase, _, stroke, column) = probe.phase_at(t);
        (phase, stroke, column)
    };
    let mut last = place(0.0);
    let n = 20_000;
    for k in 1..=n {
        let (mut before, mut after) = (
            end * f64::from(k - 1) / f64::from(n),
            end * f64::from(k) / f64::from(n),
        );
        let next = place(after);
        if next == last {
            continue;
        }
        for _ in 0..80 {
            let mid = 0.5 * (before + after);
            if place(mid) == last {
                before = mid;
            } else {
                after = mid;
            }
        }
        last = next;
        found.push((after, next.0, next.1, next.2));
    }
    found
}

#[test]
fn the_probing_cycle_moves_down_10_cm_up_10_cm_out_6_67_mm_and_to_the_next_column() {
    let probe = paper();
    let trajectory = Trajectory::Probe(probe);
    let mut expected = Vec::new();
    for column in 0..2 {
        for stroke in 0..4 {
            let onward = if stroke < 3 {
                ProbePhase::Out
            } else {
                ProbePhase::Advance
            };
            expected.push((ProbePhase::Down, stroke, column));
            expected.push((ProbePhase::Up, stroke, column));
            expected.push((onward, stroke, column));
        }
    }
    expected.push((ProbePhase::Down, 0, 2));
    let found = changes(&probe);
    let order: Vec<_> = found.iter().map(|(_, p, s, c)| (*p, *s, *c)).collect();
    assert_eq!(order, expected[1..]);

    for (time_s, begins, stroke, column) in found {
        let reference = trajectory.at(time_s);
        let (radius, azimuth, height) = cylindrical(&reference);
        let expected_radius = 0.55 + 0.00667 * f64::from(stroke);
        let expected_azimuth = 0.2 + 0.1 * f64::from(column);
        let bottom = begins == ProbePhase::Up;
        let expected_height = if bottom { 0.02 - 0.1 } else { 0.02 };
        assert!((radius - expected_radius).abs() < 1e-9, "{begins:?}");
        assert!((azimuth - expected_azimuth).abs() < 1e-9, "{begins:?}");
        assert!((height - expected_height).abs() < 1e-9, "{begins:?}");
        assert!(reference.velocity.norm() < 1e-9, "{begins:?} from rest");
    }
}

#[test]
fn mid_stroke_is_vertical_at_the_speed() {
    let probe = paper();
    let trajectory = Trajectory::Probe(probe);
    let stroke_s = probe.stroke_m / probe.speed_m_per_s + probe.ramp_s;
    let mut seen = 0;
    for k in 0..20_000 {
        let time_s = 1e-3 * f64::from(k);
        let (phase, t, ..) = probe.phase_at(time_s);
        let direction = match phase {
            ProbePhase::Down => -1.0,
            ProbePhase::Up => 1.0,
            ProbePhase::Dwell | ProbePhase::Out | ProbePhase::Advance => continue,
        };
        let reference = trajectory.at(time_s);
        assert_eq!(reference.velocity.xy().norm(), 0.0);
        if t >= probe.ramp_s && t <= stroke_s - probe.ramp_s {
            assert_eq!(reference.velocity.z, direction * 0.04);
            assert_eq!(reference.acceleration.norm(), 0.0);
            seen += 1;
        }
    }
    assert!(seen > 10_000, "{seen} milliseconds at the speed");
}

#[test]
fn times_of_a_cycle_and_of_a_column() {
    let probe = paper();
    let stroke_s = 0.1 / 0.04 + 0.1;
    let out_s = 1.875 * 0.00667 / 0.04;
    assert!((probe.cycle_s() - (2.0 * stroke_s + out_s)).abs() < 1e-12);
    let (_, t, stroke, column) = probe.phase_at(probe.column_s() + 1e-6);
    assert!((t - 1e-6).abs() < 1e-9 && stroke == 0 && column == 1);
}

/// The dwell delays the way up and changes nothing else.
#[test]
fn a_dwell_rests_at_the_bottom_between_down_and_up() {
    let (without, dwell_s) = (paper(), 0.7);
    let probe = Probe { dwell_s, ..without };
    let stroke_s = probe.stroke_s();
    let [dwelling, plain] = [probe, without].map(Trajectory::Probe);
    for k in 0..=700 {
        let time_s = stroke_s + 1e-3 * f64::from(k);
        let reference = dwelling.at(time_s);
        assert!((reference.position.z - (0.02 - 0.1)).abs() < 1e-15);
        assert!(reference.velocity.norm() + reference.acceleration.norm() < 1e-12);
        let inside = (1..700).contains(&k);
        assert!(!inside || probe.phase_at(time_s).0 == ProbePhase::Dwell);
    }
    for k in 0..2 * 2600 {
        let time_s = 1e-3 * f64::from(k);
        let later_s = if time_s > stroke_s { dwell_s } else { 0.0 };
        let difference = dwelling.at(time_s + later_s).position - plain.at(time_s).position;
        assert!(difference.norm() < 1e-12, "at {time_s} s");
    }
    assert!((probe.cycle_s() - without.cycle_s() - dwell_s).abs() < 1e-12);
    assert!((probe.column_s() - without.column_s() - 4.0 * dwell_s).abs() < 1e-12);
}

fn never_faster_than_the_speed(probe: Probe) -> Outcome {
    let trajectory = Trajectory::Probe(probe);
    let end = 2.0 * probe.column_s();
    for k in 0..2000 {
        let time_s = end * f64::from(k) / 2000.0;
        let speed = trajectory.at(time_s).velocity.norm();
        prop_assert!(
            speed <= probe.speed_m_per_s * (1.0 + 1e-12),
            "{speed} m/s at {time_s} s"
        );
    }
    Ok(())
}

/// Position, velocity and acceleration are continuous at every change of phase.
fn continuous_where_phases_meet(probe: Probe) -> Outcome {
    let trajectory = Trajectory::Probe(probe);
    let dt = 1e-7 * probe.ramp_s;
    for (time_s, ..) in changes(&probe) {
        let (left, right) = (trajectory.at(time_s - dt), trajectory.at(time_s + dt));
        let speed = probe.speed_m_per_s;
        prop_assert!((right.position - left.position).norm() < 1e-10);
        prop_assert!((right.velocity - left.velocity).norm() < 1e-6 * speed);
        let jump = (right.acceleration - left.acceleration).norm();
        prop_assert!(jump < 1e-4 * speed / probe.ramp_s, "{jump}");
    }
    Ok(())
}

fn columns_repeat_turned_by_the_step(probe: Probe) -> Outcome {
    let trajectory = Trajectory::Probe(probe);
    let column_s = probe.column_s();
    let (sin, cos) = probe.azimuth_step_rad.sin_cos();
    for k in 0..50 {
        let time_s = column_s * (f64::from(k) + 0.31) / 50.0;
        let (now, later) = (trajectory.at(time_s), trajectory.at(time_s + column_s));
        for (a, b) in [
            (now.position, later.position),
            (now.velocity, later.velocity),
        ] {
            prop_assert!((cos * a.x - sin * a.y - b.x).abs() < 1e-9);
            prop_assert!((sin * a.x + cos * a.y - b.y).abs() < 1e-9);
            prop_assert!((a.z - b.z).abs() < 1e-9);
        }
    }
    Ok(())
}

#[test]
fn of_any_probing_cycle() {
    check(200, probe(), never_faster_than_the_speed);
    check(60, probe(), continuous_where_phases_meet);
    check(200, probe(), columns_repeat_turned_by_the_step);
}
