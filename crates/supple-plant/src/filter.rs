//! Second-order Butterworth low-pass filter of the force sensor.
//!
//! Bilinear transform of `H(s) = w^2 / (s^2 + sqrt(2) w s + w^2)` with the cutoff pre-warped, so that
//! the gain is exactly `1/sqrt(2)` at the cutoff:
//!
//! ```text
//! k = tan(pi f_c / f_s)   a = 1 / (1 + sqrt(2) k + k^2)
//! b0 = a k^2   b1 = 2 b0   b2 = b0   a1 = 2 a (k^2 - 1)   a2 = a (1 - sqrt(2) k + k^2)
//! ```
//!
//! The filter delays by about `sqrt(2) / (2 pi f_c)`, 2.25 ms at 100 Hz.
//!
//! It is part of the simulated sensor and shares no code with the zero-phase filter of identification
//! (`supple_ident::filter`), so that an error in one of them becomes visible in a comparison of model and plant. Tests compare
//! both with scipy.

use crate::error::{PlantError, entry};
use supple_core::nalgebra::Vector3;

/// Filter of a vector, one state per axis, direct form II transposed.
#[derive(Clone, Debug, PartialEq)]
pub struct Butterworth {
    b: [f64; 3],
    a: [f64; 2],
    first: Vector3<f64>,
    second: Vector3<f64>,
}

impl Butterworth {
    /// Returns the filter with a gain of -3 dB at `cutoff_hz`; `sample_s` is the sampling period.
    ///
    /// # Errors
    /// [`PlantError`] if the cutoff is not positive and below half the sampling rate.
    pub fn new(cutoff_hz: f64, sample_s: f64) -> Result<Butterworth, PlantError> {
        let ratio = cutoff_hz * sample_s;
        entry(
            ratio > 0.0 && ratio < 0.5,
            "cutoff_hz",
            cutoff_hz,
            "positive and below half the sampling rate of the plant's step",
        )?;
        let k = libm::tan(core::f64::consts::PI * ratio);
        let root2 = core::f64::consts::SQRT_2;
        let a = 1.0 / (1.0 + root2 * k + k * k);
        let b0 = a * k * k;
        Ok(Butterworth {
            b: [b0, 2.0 * b0, b0],
            a: [2.0 * a * (k * k - 1.0), a * (1.0 - root2 * k + k * k)],
            first: Vector3::zeros(),
            second: Vector3::zeros(),
        })
    }

    /// Filters one sample.
    pub fn step(&mut self, sample: &Vector3<f64>) -> Vector3<f64> {
        let out = sample * self.b[0] + self.first;
        self.first = sample * self.b[1] - out * self.a[0] + self.second;
        self.second = sample * self.b[2] - out * self.a[1];
        out
    }

    /// Resets the filter state.
    pub fn reset(&mut self) {
        self.first = Vector3::zeros();
        self.second = Vector3::zeros();
    }
}

#[cfg(test)]
mod tests {
    use super::Butterworth;
    use supple_core::nalgebra::Vector3;

    #[test]
    fn coefficients_are_the_published_ones() {
        // scipy.signal.butter(2, 100, fs=1000)
        let filter = Butterworth::new(100.0, 1e-3).unwrap();
        let b = [
            0.067_455_273_889_071_9,
            0.134_910_547_778_143_8,
            0.067_455_273_889_071_9,
        ];
        let a = [-1.142_980_502_539_901, 0.412_801_598_096_188_7];
        for (x, y) in filter.b.iter().chain(&filter.a).zip(b.iter().chain(&a)) {
            assert!((x - y).abs() < 1e-15, "{x} {y}");
        }
    }

    /// Returns the steady amplitude of a sinusoid through the filter at the plant's default step.
    fn gain(hz: f64) -> f64 {
        let step_s = 2e-4;
        let mut filter = Butterworth::new(100.0, step_s).unwrap();
        let n = (2.0 / step_s) as usize;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for i in 0..2 * n {
            let phase = core::f64::consts::TAU * hz * i as f64 * step_s;
            let out = filter.step(&Vector3::repeat(phase.sin())).y;
            if i >= n {
                sine += out * phase.sin();
                cosine += out * phase.cos();
            }
        }
        2.0 * (sine * sine + cosine * cosine).sqrt() / n as f64
    }

    #[test]
    fn gain_is_minus_3_db_at_the_cutoff_and_falls_by_40_db_per_decade() {
        assert!((gain(100.0) - 0.5_f64.sqrt()).abs() < 1e-6);
        assert!((gain(5.0) - 1.0).abs() < 1e-4);
        let decade = gain(1000.0) / gain(100.0) * 0.5_f64.sqrt();
        assert!((decade - 0.01).abs() < 3e-3, "{decade}");
    }

    #[test]
    fn the_integral_of_a_pulse_is_preserved() {
        let mut filter = Butterworth::new(100.0, 2e-4).unwrap();
        let pulse = Vector3::new(3.0, -2.0, 1.0);
        let mut sum = filter.step(&pulse);
        for _ in 0..1000 {
            sum += filter.step(&Vector3::zeros());
        }
        assert!((sum - pulse).norm() < 1e-12);
    }

    #[test]
    fn rejects_a_cutoff_above_half_the_sampling_rate() {
        let error = Butterworth::new(600.0, 1e-3).unwrap_err();
        assert!(error.to_string().contains("600"));
    }
}
