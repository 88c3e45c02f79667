//! The scale of the residual: false alarms at the stated rate.

use crate::support::random::{Draws, Random};
use supple_core::residual::ResidualScale;

const PERIOD_S: f64 = 1e-3;
/// Bandwidth of the estimator \[rad/s\].
const OMEGA: f64 = 200.0;

/// White noise through two first-order lags of the estimator's bandwidth, standard deviation `sigma`.
fn residuals(sigma: f64, seconds: f64) -> impl Iterator<Item = f64> {
    let mut white = Random::new(20_260_113);
    let lag = (-OMEGA * PERIOD_S).exp();
    let (mut first, mut second) = (0.0, 0.0);
    // Variance of two equal lags in series, of unit white noise.
    let (a, b) = (lag * lag, (1.0 - lag).powi(4));
    let variance = b * (1.0 + a) / (1.0 - a).powi(3);
    let scale = sigma / variance.sqrt();
    (0..(seconds / PERIOD_S) as u32).map(move |_| {
        first = lag * first + (1.0 - lag) * white.normal();
        second = lag * second + (1.0 - lag) * first;
        scale * second
    })
}

/// The configured rate is one alarm per second; a Gaussian residual of that bandwidth causes this rate, independent of its size.
#[test]
fn false_alarms_come_at_the_stated_rate() {
    for sigma in [0.6, 0.9, 1.5] {
        let mut scale = ResidualScale::new(3600.0, OMEGA);
        let (mut alarms, mut above, mut seconds) = (0, false, 0.0);
        for (k, x) in residuals(sigma, 410.0).enumerate() {
            let crossed = x > scale.factor();
            if k >= 10_000 {
                alarms += u32::from(crossed && !above);
                seconds += PERIOD_S;
            }
            above = crossed;
            scale.add(x, PERIOD_S);
        }
        let rate = f64::from(alarms) / seconds;
        assert!((0.6..=1.5).contains(&rate), "{rate} per second at {sigma}");
    }
}

/// At a configured rate of one per hour there is no alarm in ten minutes, also not at the start.
#[test]
fn one_false_alarm_per_hour_is_none_in_ten_minutes() {
    let mut scale = ResidualScale::new(1.0, OMEGA);
    for x in residuals(0.15, 600.0) {
        assert!(x <= scale.factor());
        scale.add(x, PERIOD_S);
    }
}

/// The factor stays within its range, and a force just below the threshold changes it only slightly.
#[test]
fn forces_of_contact_do_not_raise_the_scale() {
    let mut scale = ResidualScale::new(1.0, OMEGA);
    for x in residuals(0.3, 20.0) {
        scale.add(x, PERIOD_S);
    }
    let before = scale.factor();
    (0..20).for_each(|_| scale.add(50.0, PERIOD_S));
    assert!(
        scale.factor() < 1.05 * before,
        "{} {before}",
        scale.factor()
    );
    (0..60_000).for_each(|_| scale.add(50.0, PERIOD_S));
    assert_eq!(scale.factor(), 5.0);
    (0..60_000).for_each(|_| scale.add(0.0, PERIOD_S));
    assert_eq!(scale.factor(), 1.0);
}

#[test]
fn without_a_stated_rate_the_threshold_is_the_configured_one() {
    let mut scale = ResidualScale::new(f64::INFINITY, OMEGA);
    for x in residuals(3.0, 1.0) {
        scale.add(x, PERIOD_S);
        assert_eq!(scale.factor(), 1.0);
    }
}
