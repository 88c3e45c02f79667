//! Scalars and fixed-size matrices.
//!
//! All transcendental functions and square roots of the core come from this module, which uses
//! `libm` ([`crate::math::sincos`] for the joint angles). `std` and nalgebra are not used for them: cargo
//! unifies features across the workspace, and a step must give identical bits in every binary.

mod cholesky;
pub(crate) mod lanes;
pub mod linalg;
pub mod sincos;
pub(crate) mod vec3;

/// Column of `N` numbers, one per joint unless stated otherwise.
pub type Vector<const N: usize> = nalgebra::SVector<f64, N>;
/// Matrix of `R` rows and `C` columns.
pub type Matrix<const R: usize, const C: usize> = nalgebra::SMatrix<f64, R, C>;
pub use nalgebra::{Matrix3, Vector3};

pub use libm::{acos, atan2, cos, exp, fabs as abs, log, sin};

/// Returns the square root, correctly rounded.
///
/// `libm`'s square root compiles to a legacy SSE instruction. Mixed with AVX code it causes
/// transition penalties: a step took 25 % longer.
#[inline]
pub fn sqrt(x: f64) -> f64 {
    if cfg!(target_arch = "x86_64") {
        wide::f64x2::splat(x).sqrt().to_array()[0]
    } else {
        libm::sqrt(x)
    }
}

/// Returns sine and cosine of an angle in radians.
#[inline]
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}

/// Returns whether every entry is a finite number.
#[inline]
pub fn all_finite<const R: usize, const C: usize>(m: &Matrix<R, C>) -> bool {
    m.iter().all(|x| x.is_finite())
}

/// Computes the smooth step from 0 at `x <= 0` to 1 at `x >= 1`, with zero first and second derivatives at both
/// ends (minimum jerk). Returns value, first and second derivative with respect to `x`.
#[inline]
pub fn smooth_step(x: f64) -> (f64, f64, f64) {
    if x <= 0.0 {
        (0.0, 0.0, 0.0)
    } else if x >= 1.0 {
        (1.0, 0.0, 0.0)
    } else {
        let x2 = x * x;
        (
            x2 * x * (10.0 + x * (6.0 * x - 15.0)),
            30.0 * x2 * (1.0 - x) * (1.0 - x),
            60.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
        )
    }
}

/// Returns the matrix of the cross product: `skew(a) * b == a.cross(&b)`.
#[inline]
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}
