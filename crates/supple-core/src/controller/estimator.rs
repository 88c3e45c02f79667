//! Joint velocity from quantised positions: a critically damped tracking loop.
//!
//! ```text
//! innovation = y - (q + v T);   q += v T + (1 - r^2) innovation;   v += (1 - r)^2 / T innovation
//! r = exp(-omega T)
//! ```
//!
//! **Delay.** The velocity follows a slow ramp of the velocity with a lag of `2 / omega`: 10 ms at
//! 200 rad/s. **Noise.** Positions quantised to a step `d` and moving (error variance `d^2 / 12`,
//! white) give a velocity of standard deviation `d sqrt(omega^3 T / 48)` for `omega T` small: 1.1
//! mrad/s for 85 urad, 200 rad/s and 1 ms. A difference over one cycle would give 35 mrad/s.

use crate::math::{Vector, abs, exp};

/// Smaller speeds are set to zero \[rad/s\]. Otherwise the velocity of a joint at rest would decay
/// to a subnormal number, which many processors handle a hundred times slower.
const MIN_SPEED_RAD_PER_S: f64 = 1e-12;

/// Gains of one update, which depend on the time between two measurements alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorGains {
    elapsed_s: f64,
    /// Share of the innovation that corrects the position.
    position: f64,
    /// Correction of the velocity per innovation \[1/s\].
    velocity_per_s: f64,
}

impl EstimatorGains {
    /// Returns the gains for positions measured `elapsed_s` after the last ones; `bandwidth_rad_per_s` is `omega`.
    pub fn new(elapsed_s: f64, bandwidth_rad_per_s: f64) -> Self {
        let r = exp(-bandwidth_rad_per_s * elapsed_s);
        EstimatorGains {
            elapsed_s,
            position: 1.0 - r * r,
            velocity_per_s: (1.0 - r) * (1.0 - r) / elapsed_s,
        }
    }

    /// Returns the acceleration with which the velocity estimate changes while the position estimate lags the measured position
    /// by `behind_rad` \[rad\] after its update, for example after an impact.
    pub(super) fn acceleration_rad_per_s2<const N: usize>(
        &self,
        behind_rad: &Vector<N>,
    ) -> Vector<N> {
        let innovation_share = 1.0 - self.position;
        behind_rad * (self.velocity_per_s / (self.elapsed_s * innovation_share))
    }

    /// Returns the time between the measurements \[s\].
    pub fn elapsed_s(&self) -> f64 {
        self.elapsed_s
    }
}

/// State of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator<const N: usize> {
    /// Filtered positions \[rad\].
    pub position_rad: Vector<N>,
    /// Velocities \[rad/s\].
    pub velocity_rad_per_s: Vector<N>,
}

impl<const N: usize> Estimator<N> {
    /// Returns an estimator at rest at `position_rad`.
    pub fn at_rest(position_rad: Vector<N>) -> Self {
        Estimator {
            position_rad,
            velocity_rad_per_s: Vector::zeros(),
        }
    }

    /// Updates the estimate with the measured positions; `None` is bridged by prediction. If finite positions are so far
    /// apart that the estimate overflows, it restarts at rest.
    pub fn update(&mut self, measured_rad: &[Option<f64>; N], gains: &EstimatorGains) {
        for (i, measured) in measured_rad.iter().enumerate() {
            match measured {
                Some(position_rad) => self.correct(i, *position_rad, gains),
                None => self.position_rad[i] += self.velocity_rad_per_s[i] * gains.elapsed_s,
            }
        }
    }

    /// Updates the estimate with positions that are all measured.
    pub(super) fn update_all(&mut self, measured_rad: &Vector<N>, gains: &EstimatorGains) {
        for i in 0..N {
            self.correct(i, measured_rad[i], gains);
        }
    }

    #[inline(always)]
    fn correct(&mut self, i: usize, measured_rad: f64, gains: &EstimatorGains) {
        let velocity = self.velocity_rad_per_s[i];
        let predicted = self.position_rad[i] + velocity * gains.elapsed_s;
        let innovation = measured_rad - predicted;
        let position = predicted + gains.position * innovation;
        let velocity = velocity + gains.velocity_per_s * innovation;
        let at_rest = abs(velocity) < MIN_SPEED_RAD_PER_S;
        self.position_rad[i] = position;
        self.velocity_rad_per_s[i] = if at_rest { 0.0 } else { velocity };
        // The sum is zero exactly if both are finite.
        if !(position * 0.0 + velocity * 0.0 == 0.0) {
            (self.position_rad[i], self.velocity_rad_per_s[i]) = (measured_rad, 0.0);
        }
    }
}
