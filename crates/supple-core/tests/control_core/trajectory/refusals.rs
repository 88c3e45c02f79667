//! Invalid trajectories are rejected with the entry and its value.

use std::f64::consts::PI;
use supple_core::Trajectory;
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Line, Probe, Quadrant, Sinusoid};

const NOT_POSITIVE: [f64; 5] = [0.0, -0.1, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
const NOT_FINITE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// Checks that `value` in `entry` is rejected with that name.
#[track_caller]
fn refused(trajectory: Trajectory, entry: &str, value: f64) {
    let error = trajectory.validate().expect_err(entry);
    assert!(
        error.entry.contains(entry),
        "{} is not {entry}",
        error.entry
    );
    assert!(
        error.value == value || (error.value.is_nan() && value.is_nan()),
        "{entry}: {} is not {value}",
        error.value
    );
    let message = error.to_string();
    assert!(message.contains(error.entry) && message.contains(&format!("{value}")));
    assert!(message.contains(error.must));
}

fn sinusoid() -> Sinusoid {
    Sinusoid::paper(1.0)
}

fn arc() -> Arc {
    Arc {
        radius_m: 0.6,
        height_m: 0.0,
        centre_rad: 0.0,
        amplitude_rad: 0.5,
        angular_frequency_rad_per_s: 1.0,
        ramp_s: 1.0,
    }
}

fn probe() -> Probe {
    Probe {
        radius_m: 0.5,
        strokes: 3,
        radial_step_m: 0.01,
        top_m: 0.0,
        stroke_m: 0.1,
        azimuth_rad: 0.0,
        azimuth_step_rad: 0.1,
        speed_m_per_s: 0.04,
        ramp_s: 0.1,
        dwell_s: 0.0,
    }
}

/// Checks that `base` with `field` set to each of `values` is rejected with the field's name.
macro_rules! refuses {
    ($kind:ident, $base:expr, $values:expr, $($field:ident),*) => {$(
        for value in $values {
            let mut entries = $base;
            entries.$field = value;
            refused(Trajectory::$kind(entries), stringify!($field), value);
        }
    )*};
}

#[test]
fn entries_must_be_positive() {
    let line = Line {
        from_m: Vector3::zeros(),
        to_m: Vector3::x(),
        duration_s: 1.0,
    };
    refuses!(Line, line, NOT_POSITIVE, duration_s);
    refuses!(
        Sinusoid,
        sinusoid(),
        NOT_POSITIVE,
        angular_frequency_rad_per_s,
        ramp_s
    );
    refuses!(
        Arc,
        arc(),
        NOT_POSITIVE,
        radius_m,
        amplitude_rad,
        angular_frequency_rad_per_s,
        ramp_s
    );
    refuses!(
        Probe,
        probe(),
        NOT_POSITIVE,
        radius_m,
        radial_step_m,
        stroke_m,
        speed_m_per_s,
        ramp_s
    );
    let no_strokes = Probe {
        strokes: 0,
        ..probe()
    };
    refused(Trajectory::Probe(no_strokes), "strokes", 0.0);
    for dwell_s in [-1e-9, f64::NAN, f64::INFINITY] {
        let wrong = Probe { dwell_s, ..probe() };
        refused(Trajectory::Probe(wrong), "dwell_s", dwell_s);
    }
}

#[test]
fn entries_must_be_finite() {
    refuses!(Arc, arc(), NOT_FINITE, height_m, centre_rad);
    refuses!(
        Probe,
        probe(),
        NOT_FINITE,
        top_m,
        azimuth_rad,
        azimuth_step_rad
    );
    for value in NOT_FINITE {
        for axis in 0..3 {
            let mut point = Vector3::new(0.5, 0.0, 0.1);
            point[axis] = value;
            refused(Trajectory::Hold(point), "position_m", value);
            let mut line = Line {
                from_m: point,
                to_m: Vector3::zeros(),
                duration_s: 1.0,
            };
            refused(Trajectory::Line(line), "from_m", value);
            (line.from_m, line.to_m) = (line.to_m, line.from_m);
            refused(Trajectory::Line(line), "to_m", value);
            let mut wrong = sinusoid();
            wrong.centre_m = point;
            refused(Trajectory::Sinusoid(wrong), "centre_m", value);
            let mut wrong = sinusoid();
            wrong.amplitude_m = point;
            refused(Trajectory::Sinusoid(wrong), "amplitude_m", value);
            let [x, z] = [Vector3::x(), Vector3::z()];
            let wrong = Quadrant::new(point, x, z, 0.1, 0.1);
            refused(Trajectory::Quadrant(wrong), "centre_m", value);
            let wrong = Quadrant::new(x, point, z, 0.1, 0.1);
            refused(Trajectory::Quadrant(wrong), "first_m", value);
            let wrong = Quadrant::new(x, z, point, 0.1, 0.1);
            refused(Trajectory::Quadrant(wrong), "second_m", value);
        }
    }
}

#[test]
fn degenerate_quadrants_are_rejected() {
    let zero = Vector3::zeros();
    let quadrant = |first, second, speed, ramp_s| {
        Trajectory::Quadrant(Quadrant::new(zero, first, second, speed, ramp_s))
    };
    let (x, z) = (Vector3::x() * 0.2, Vector3::z() * 0.1);
    assert!(quadrant(x, z, 0.1, 0.1).validate().is_ok());
    refused(quadrant(zero, z, 0.1, 0.1), "length of first_m", 0.0);
    refused(quadrant(x, zero, 0.1, 0.1), "length of second_m", 0.0);
    for value in NOT_POSITIVE {
        refused(quadrant(x, z, value, 0.1), "speed_m_per_s", value);
        refused(quadrant(x, z, 0.1, value), "ramp_s", value);
    }
    let with_corners = |corner_ramp_s| {
        let quadrant = Quadrant::new(zero, x, z, 0.1, 0.1);
        Trajectory::Quadrant(quadrant.with_corner_ramp(corner_ramp_s))
    };
    // The shortest segment takes one second at full speed.
    assert!(with_corners(1.0).validate().is_ok());
    for value in [-0.1, 1.001, f64::NAN, f64::INFINITY] {
        refused(with_corners(value), "corner_ramp_s", value);
    }
    let oblique = Vector3::new((PI / 3.0).cos(), 0.0, (PI / 3.0).sin());
    let error = quadrant(x, oblique, 0.1, 0.1)
        .validate()
        .expect_err("oblique");
    assert!(error.entry.starts_with("cosine") && (error.value - 0.5).abs() < 1e-12);
}

#[test]
fn a_ramp_longer_than_the_stroke_allows_is_rejected() {
    let longest = Probe {
        ramp_s: 2.5,
        ..probe()
    };
    assert!(Trajectory::Probe(longest).validate().is_ok());
    let too_long = Probe {
        ramp_s: 2.6,
        ..probe()
    };
    refused(Trajectory::Probe(too_long), "ramp_s", 2.6);
}

/// Evaluating an invalid trajectory must not panic before it is rejected.
#[test]
fn a_probe_without_strokes_does_not_panic() {
    let none = Probe {
        strokes: 0,
        ..probe()
    };
    let _ = (none.cycle_s(), none.column_s(), none.phase_at(1.0));
    let _ = Trajectory::Probe(none).at(1.0);
}
