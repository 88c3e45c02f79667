//! Scale of the observed force in free motion: sets the contact threshold at a constant false-alarm rate.
//!
//! In free motion the whole observed force is residual: noise of the encoders and error of the model in
//! use. `x` is that force divided by the configured threshold, and `s` its root mean square over the last
//! seconds; contact is a force above the configured threshold times `z s`, with
//!
//! ```text
//! z = sqrt(2 ln(n0 / n))
//! ```
//!
//! which a Gaussian residual exceeds `n` times per second if it crosses zero upwards `n0` times per second (Rice,
//! 1945). `n0` is bounded by the bandwidth of the velocity estimate, `omega / (2 pi)`. Until residuals
//! are known, and without a configured false-alarm rate, the factor is one.

use crate::math::{log, sqrt};

/// Seconds of an hour.
const HOUR_S: f64 = 3600.0;
/// Time over which the mean square is taken \[s\].
const WINDOW_S: f64 = 5.0;
/// Weight of the initial value, `z s = 1`, as a time \[s\].
const PRIOR_S: f64 = 0.1;
/// Residuals are clipped at this multiple of their scale, so that a contact that is about to be detected does
/// not raise the threshold.
const CLIP: f64 = 3.0;
/// Range of the factor: residuals only raise the configured threshold, and may not hide every force.
const FACTOR: (f64, f64) = (1.0, 5.0);

/// Mean square of the residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualScale {
    /// `z`; zero without a configured false-alarm rate.
    deviations: f64,
    /// `(z s)^2`.
    mean_square: f64,
    observed_s: f64,
}

impl ResidualScale {
    /// Creates the scale for a false-alarm rate \[1/h\] and a bandwidth of the velocity estimate \[rad/s\].
    pub fn new(false_alarms_per_hour: f64, estimator_rad_per_s: f64) -> ResidualScale {
        let crossings_per_hour = HOUR_S * estimator_rad_per_s / core::f64::consts::TAU;
        let deviations = if false_alarms_per_hour < crossings_per_hour {
            sqrt(2.0 * log(crossings_per_hour / false_alarms_per_hour))
        } else {
            0.0
        };
        ResidualScale {
            deviations,
            mean_square: 1.0,
            observed_s: 0.0,
        }
    }

    /// Adds a residual `x` of a cycle without contact.
    #[inline]
    pub fn add(&mut self, x: f64, elapsed_s: f64) {
        let window_s = (self.observed_s + PRIOR_S).min(WINDOW_S);
        self.observed_s += elapsed_s;
        let square = (self.deviations * x) * (self.deviations * x);
        let clip = CLIP * CLIP * self.mean_square;
        let change = (square.min(clip) - self.mean_square) * (elapsed_s / window_s).min(1.0);
        let (min, max) = (FACTOR.0 * FACTOR.0, FACTOR.1 * FACTOR.1);
        self.mean_square = (self.mean_square + change).clamp(min, max);
    }

    /// Returns the factor of the configured threshold.
    #[inline]
    pub fn factor(&self) -> f64 {
        if self.deviations > 0.0 {
            sqrt(self.mean_square)
        } else {
            1.0
        }
    }
}
