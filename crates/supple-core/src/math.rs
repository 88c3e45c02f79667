//! Scalars and fixed-size matrices.
//!
//! Every transcendental of the core is taken from here, and from `libm` below it (those of the joint angles
//! from [`crate::sincos`]), and so is every square root: neither `std` nor
//! nalgebra is asked, because features unify across a workspace and the same step must give the same
//! bits in every binary.

/// Column of `N` numbers, one per joint unless said otherwise.
pub type Vector<const N: usize> = nalgebra::SVector<f64, N>;
/// Matrix of `R` rows and `C` columns.
pub type Matrix<const R: usize, const C: usize> = nalgebra::SMatrix<f64, R, C>;
pub use nalgebra::{Matrix3, Vector3};

pub use libm::{acos, atan2, cos, exp, fabs as abs, sin};

/// Square root, rounded to the nearest.
///
/// That of `libm` is an instruction without the encoding of AVX, for which a processor with wide registers in use
/// makes the code around it wait: a step took a quarter longer.
#[inline]
pub fn sqrt(x: f64) -> f64 {
    if cfg!(target_arch = "x86_64") {
        wide::f64x2::splat(x).sqrt().to_array()[0]
    } else {
        libm::sqrt(x)
    }
}

/// Sine and cosine of an angle in radians.
#[inline]
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}

/// `true` when every entry is a finite number.
#[inline]
pub fn all_finite<const R: usize, const C: usize>(m: &Matrix<R, C>) -> bool {
    m.iter().all(|x| x.is_finite())
}

/// Smooth step from 0 at `x <= 0` to 1 at `x >= 1`, with zero first and second derivatives at both
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

/// Matrix of the cross product: `skew(a) * b == a.cross(&b)`.
#[inline]
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}
