//! Fourth-order Butterworth low pass, run forwards and backwards: zero phase, squared magnitude.
//!
//! The filter has two second-order sections from the prewarped bilinear transform. Both ends are extended by odd reflection,
//! `2 x_0 - x_k`, over 15 samples, and each pass starts from the steady state of its first value, as in
//! `scipy.signal.sosfiltfilt`, with which the tests compare it.
//!
//! The simulated force sensor (`supple_plant`) has another filter, which runs forwards in time. The two implementations are
//! independent on purpose: the identification of the model shares no code with the measurements that evaluate the model.

use crate::error::{IdentError, positive};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use supple_core::math::{cos, sin_cos};

/// Samples of the extension at each end.
const PADDING: usize = 15;

/// Zero-phase low pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    sections: [Section; 2],
}

/// `y = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2) x`, gain 1 at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl LowPass {
    /// Returns a filter for samples at `rate_hz` whose single pass has half power at `cutoff_hz`.
    ///
    /// # Errors
    /// [`IdentError::Option`] unless `0 < cutoff_hz < rate_hz / 2`.
    pub fn butterworth4(cutoff_hz: f64, rate_hz: f64) -> Result<Self, IdentError> {
        positive("rate_hz", rate_hz)?;
        positive("cutoff_hz", cutoff_hz)?;
        if cutoff_hz >= 0.5 * rate_hz {
            return Err(IdentError::Option {
                option: "cutoff_hz",
                value: cutoff_hz,
                must: "below half the sampling rate",
            });
        }
        let (s, c) = sin_cos(PI * cutoff_hz / rate_hz);
        let warped = s / c;
        let section = |pole_angle: f64| {
            let damping = 2.0 * cos(pole_angle) * warped;
            let square = warped * warped;
            let scale = 1.0 / (1.0 + damping + square);
            let b = square * scale;
            Section {
                b: [b, 2.0 * b, b],
                a: [
                    2.0 * (square - 1.0) * scale,
                    (1.0 - damping + square) * scale,
                ],
            }
        };
        Ok(Self {
            sections: [section(PI / 8.0), section(3.0 * PI / 8.0)],
        })
    }

    /// Returns the filtered signal, of the length of `signal`.
    ///
    /// # Errors
    /// [`IdentError::Shape`] if there are 15 samples or fewer.
    pub fn zero_phase(&self, signal: &[f64]) -> Result<Vec<f64>, IdentError> {
        let n = signal.len();
        if n <= PADDING {
            return Err(IdentError::Shape {
                argument: "signal to filter".to_owned(),
                expected: format!("more than {PADDING} samples"),
                found: format!("{n}"),
            });
        }
        let before = (1..=PADDING).rev().map(|k| 2.0 * signal[0] - signal[k]);
        let after = (1..=PADDING).map(|k| 2.0 * signal[n - 1] - signal[n - 1 - k]);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            self.pass(&mut extended);
            extended.reverse();
        }
        Ok(extended[PADDING..PADDING + n].to_vec())
    }

    /// Filters every column of `signals`, (samples, joints).
    ///
    /// # Errors
    /// As [`LowPass::zero_phase`].
    pub fn zero_phase_columns(&self, signals: &DMatrix<f64>) -> Result<DMatrix<f64>, IdentError> {
        let mut filtered = signals.clone();
        for mut column in filtered.column_iter_mut() {
            let smooth = self.zero_phase(column.clone_owned().as_slice())?;
            column.copy_from_slice(&smooth);
        }
        Ok(filtered)
    }

    fn pass(&self, signal: &mut [f64]) {
        for section in &self.sections {
            let ([b0, b1, b2], [a1, a2]) = (section.b, section.a);
            let start = signal[0];
            let (mut z1, mut z2) = ((1.0 - b0) * start, (b2 - a2) * start);
            for x in signal.iter_mut() {
                let y = b0 * *x + z1;
                z1 = b1 * *x - a1 * y + z2;
                z2 = b2 * *x - a2 * y;
                *x = y;
            }
        }
    }
}

/// Returns the central differences, (samples, joints), one-sided of second order at the ends.
///
/// # Errors
/// [`IdentError::Shape`] if there are fewer than three samples.
pub fn differentiate(signals: &DMatrix<f64>, rate_hz: f64) -> Result<DMatrix<f64>, IdentError> {
    let n = signals.nrows();
    if n < 3 {
        return Err(IdentError::Shape {
            argument: "signal to differentiate".to_owned(),
            expected: "at least 3 samples".to_owned(),
            found: format!("{n}"),
        });
    }
    Ok(DMatrix::from_fn(n, signals.ncols(), |i, j| {
        let x = |k: usize| signals[(k, j)];
        let twice = match i {
            0 => -3.0 * x(0) + 4.0 * x(1) - x(2),
            _ if i + 1 == n => 3.0 * x(i) - 4.0 * x(i - 1) + x(i - 2),
            _ => x(i + 1) - x(i - 1),
        };
        0.5 * rate_hz * twice
    }))
}
