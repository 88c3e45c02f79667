//! Shared by the control tests: arms and configurations of the WAM's size, a controller with its
//! state, a simulated arm, comparisons, and seeded properties.
#![allow(dead_code, reason = "each test binary takes its own part of this")]
#![allow(
    clippy::disallowed_methods,
    reason = "reference values use other mathematical functions"
)]

pub mod arms;
pub mod configs;
pub mod plant;
pub mod property;
pub mod random;
pub mod rig;
#[path = "../../../../tests/support/property.rs"]
pub mod settings;
pub mod states;

use supple_core::Matrix;

/// Largest absolute entry; infinite if an entry is NaN.
pub fn size<const R: usize, const C: usize>(m: &Matrix<R, C>) -> f64 {
    m.iter().fold(0.0, |worst: f64, x| {
        if x.is_nan() {
            f64::INFINITY
        } else {
            worst.max(x.abs())
        }
    })
}

/// Fails if two matrices differ by more than `tolerance` in any entry, or contain NaN.
#[track_caller]
pub fn assert_close<const R: usize, const C: usize>(
    found: &Matrix<R, C>,
    expected: &Matrix<R, C>,
    tolerance: f64,
) {
    let error = size(&(found - expected));
    assert!(
        error <= tolerance,
        "off by {error:.2e}, more than {tolerance:.1e}: found {found} expected {expected}"
    );
}

/// Inverse by elimination with partial pivoting, which the tested code does not use.
#[track_caller]
pub fn inverse<const R: usize>(m: &Matrix<R, R>) -> Matrix<R, R> {
    let (mut a, mut b) = (*m, Matrix::<R, R>::identity());
    for c in 0..R {
        let pivot = (c..R)
            .max_by(|i, j| a[(*i, c)].abs().total_cmp(&a[(*j, c)].abs()))
            .expect("a row");
        a.swap_rows(c, pivot);
        b.swap_rows(c, pivot);
        let d = a[(c, c)];
        assert!(d != 0.0, "not invertible: {m}");
        for k in 0..R {
            a[(c, k)] /= d;
            b[(c, k)] /= d;
        }
        for i in (0..R).filter(|i| *i != c) {
            let factor = a[(i, c)];
            for k in 0..R {
                a[(i, k)] -= factor * a[(c, k)];
                b[(i, k)] -= factor * b[(c, k)];
            }
        }
    }
    b
}
