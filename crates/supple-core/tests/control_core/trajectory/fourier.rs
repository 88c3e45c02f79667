//! The excitation series: derivatives, rest at both ends, limits.

use supple_core::Vector;
use supple_core::trajectory::Fourier;

fn series() -> Fourier<3> {
    let mut series = Fourier::at_rest(Vector::from([0.1, -0.2, 0.3]), 1.3);
    for k in 0..5 {
        let x = 0.1 + 0.05 * k as f64;
        series.sine_rad[k] = Vector::from([x, -0.5 * x, 0.2]);
        series.cosine_rad[k] = Vector::from([0.3 - x, 0.1, x]);
    }
    series.duration_s = 12.0;
    series.ramp_s = 1.5;
    series
}

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_position() {
    let (series, h) = (series(), 1e-5);
    for i in 1..1200 {
        let t = 0.01 * f64::from(i);
        let (before, at, after) = (series.at(t - h), series.at(t), series.at(t + h));
        let slope = (after.position_rad - before.position_rad) / (2.0 * h);
        let curve = (after.velocity_rad_per_s - before.velocity_rad_per_s) / (2.0 * h);
        assert!((slope - at.velocity_rad_per_s).amax() < 1e-6, "{t}");
        assert!((curve - at.acceleration_rad_per_s2).amax() < 1e-4, "{t}");
    }
}

#[test]
fn the_reference_equals_the_series_at_full_speed() {
    let series = series();
    // The ramp of the time scaling delays by half its length.
    let (t, lag) = (6.0, 0.5 * series.ramp_s);
    let mut expected = series.centre_rad;
    for k in 0..5 {
        let angle = 1.3 * (k + 1) as f64 * (t - lag);
        expected += series.sine_rad[k] * angle.sin() + series.cosine_rad[k] * angle.cos();
    }
    assert!((series.at(t).position_rad - expected).amax() < 1e-12);
}

#[test]
fn the_series_rests_at_both_ends_and_beyond() {
    let series = series();
    for t in [-1.0, 0.0, 12.0, 20.0] {
        let at = series.at(t);
        assert!(at.velocity_rad_per_s.amax() < 1e-12, "{t}");
        assert!(at.acceleration_rad_per_s2.amax() < 1e-9, "{t}");
    }
    let (end, later) = (series.at(12.0), series.at(30.0));
    assert_eq!(end.position_rad, later.position_rad);
}
