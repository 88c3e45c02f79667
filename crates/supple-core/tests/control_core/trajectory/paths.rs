//! The shapes of the hold, the line, the sinusoid and the arc.

use crate::support::assert_close;
use std::f64::consts::FRAC_PI_4;
use supple_core::Trajectory;
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Line, Sinusoid};

#[test]
fn hold_stays() {
    let point = Vector3::new(0.4, -0.1, 0.2);
    for time_s in [0.0, 1.0, 1e6] {
        let reference = Trajectory::Hold(point).at(time_s);
        assert_eq!(reference, supple_core::Reference::at_rest(point));
    }
}

#[test]
fn line_goes_from_rest_to_rest_at_1_875_times_its_mean_speed() {
    let line = Line {
        from_m: Vector3::new(0.1, 0.2, 0.3),
        to_m: Vector3::new(0.5, -0.1, 0.3),
        duration_s: 2.0,
    };
    let at = |t: f64| Trajectory::Line(line).at(t);
    assert_eq!(at(0.0).position, line.from_m);
    assert_close(&at(1.0).position, &((line.from_m + line.to_m) * 0.5), 1e-15);
    let peak = at(1.0).velocity.norm();
    assert!((peak - 1.875 * 0.5 / 2.0).abs() < 1e-15, "{peak}");
    for time_s in [2.0, 2.1, 1e9] {
        assert_close(&at(time_s).position, &line.to_m, 1e-15);
        assert_eq!(at(time_s).velocity, Vector3::zeros());
        assert_eq!(at(time_s).acceleration, Vector3::zeros());
    }
}

/// `x = 0.6 + 0.2 sin(pi t / 4)` as printed, half the ramp later.
#[test]
fn the_papers_sinusoid_at_any_speed() {
    for speed in [0.5, 1.0, 2.0] {
        let trajectory = Trajectory::Sinusoid(Sinusoid::paper(speed));
        let w = FRAC_PI_4 * speed;
        for k in 0..100 {
            let time_s = 1.0 / speed + 0.173 * f64::from(k);
            let angle = w * (time_s - 0.5 / speed);
            let found = trajectory.at(time_s);
            let x = |value: f64| Vector3::new(value, 0.0, 0.0);
            assert_close(&found.position, &x(0.6 + 0.2 * angle.sin()), 1e-14);
            assert_close(&found.velocity, &x(0.2 * w * angle.cos()), 1e-14);
            assert_close(&found.acceleration, &x(-0.2 * w * w * angle.sin()), 1e-14);
        }
        let period_s = Sinusoid::paper(speed).period_s();
        assert!((period_s - 8.0 / speed).abs() < 1e-14);
    }
}

#[test]
fn an_arc_keeps_radius_and_height_and_oscillates_about_its_centre() {
    let arc = Arc {
        radius_m: 0.6,
        height_m: 0.1,
        centre_rad: 0.4,
        amplitude_rad: 0.5,
        angular_frequency_rad_per_s: 0.8,
        ramp_s: 1.0,
    };
    let (mut min, mut max) = (f64::MAX, f64::MIN);
    for k in 0..4000 {
        let time_s = 0.01 * f64::from(k);
        let reference = Trajectory::Arc(arc).at(time_s);
        let (p, v) = (reference.position, reference.velocity);
        assert!((p.xy().norm() - 0.6).abs() < 1e-14);
        assert_eq!((p.z, v.z, reference.acceleration.z), (0.1, 0.0, 0.0));
        assert!(p.xy().dot(&v.xy()).abs() < 1e-15, "not tangential");
        let azimuth = p.y.atan2(p.x);
        if time_s >= 1.0 {
            let expected = 0.4 + 0.5 * (0.8 * (time_s - 0.5)).sin();
            assert!((azimuth - expected).abs() < 1e-13);
        }
        (min, max) = (min.min(azimuth), max.max(azimuth));
    }
    assert!((min + 0.1).abs() < 1e-4 && (max - 0.9).abs() < 1e-4);
}
