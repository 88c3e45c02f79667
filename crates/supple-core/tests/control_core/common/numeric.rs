//! Comparisons that reject NaN, and fourth-order central differences.

use std::ops::{Add, Mul, Sub};
use supple_core::{Matrix, Vector};

/// Step of [`derivative`]: truncation and rounding are both near 1e-10 for the random arms here.
pub const STEP: f64 = 2e-4;

/// Largest entry of `|found - expected| / (scale + |expected|)`; infinite if an entry is NaN.
pub fn error_at_scale<const R: usize, const C: usize>(
    found: &Matrix<R, C>,
    expected: &Matrix<R, C>,
    scale: f64,
) -> f64 {
    found.iter().zip(expected).fold(0.0, |worst: f64, (a, b)| {
        let error = (a - b).abs() / (scale + b.abs());
        if error.is_nan() {
            f64::INFINITY
        } else {
            worst.max(error)
        }
    })
}

/// Largest entry of `|found - expected| / (1 + |expected|)`; infinite if an entry is NaN.
pub fn mixed_error<const R: usize, const C: usize>(
    found: &Matrix<R, C>,
    expected: &Matrix<R, C>,
) -> f64 {
    error_at_scale(found, expected, 1.0)
}

/// Largest absolute entry.
pub fn size<const R: usize, const C: usize>(m: &Matrix<R, C>) -> f64 {
    m.iter().fold(0.0, |worst: f64, x| worst.max(x.abs()))
}

/// A number as a 1 x 1 matrix, for comparison with the functions above.
pub fn scalar(x: f64) -> Vector<1> {
    Vector::<1>::new(x)
}

/// `df/dt` at `t = 0`, to fourth order.
pub fn derivative<T>(f: impl Fn(f64) -> T) -> T
where
    T: Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let near = f(STEP) - f(-STEP);
    let far = f(2.0 * STEP) - f(-2.0 * STEP);
    near * (8.0 / (12.0 * STEP)) - far * (1.0 / (12.0 * STEP))
}

/// Unit vector along joint `i`.
pub fn unit<const N: usize>(i: usize) -> Vector<N> {
    let mut e = Vector::zeros();
    e[i] = 1.0;
    e
}

/// Fails the surrounding property if `found` and `expected` differ by more than `tolerance`
/// relative to `scale + |expected|`, entry by entry.
#[macro_export]
macro_rules! prop_close {
    ($found:expr, $expected:expr, $scale:expr, $tolerance:expr) => {{
        let (found, expected) = ($found, $expected);
        let error = $crate::common::numeric::error_at_scale(&found, &expected, $scale);
        proptest::prop_assert!(
            error <= $tolerance,
            "{} is off by {error:.1e}: found {found} expected {expected}",
            stringify!($found)
        );
    }};
}
