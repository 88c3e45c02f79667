//! Small linear algebra for sizes known at compile time.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::lanes::Number;
use crate::math::vec3::{V3, cross, dot};
use crate::math::{Matrix, Matrix3, abs, sqrt};
use core::f64::consts::SQRT_2;

pub use crate::math::cholesky::Cholesky;

/// Returns the first `D` rows; nalgebra's copy of `fixed_rows` took a fifth of the time of the law.
#[inline(always)]
pub(crate) fn first_rows<const R: usize, const C: usize, const D: usize>(
    m: &Matrix<R, C>,
) -> Matrix<D, C> {
    let mut rows = Matrix::<D, C>::zeros();
    for (row, column) in rows.data.0.iter_mut().zip(&m.data.0) {
        for (x, y) in row.iter_mut().zip(column) {
            *x = *y;
        }
    }
    rows
}

/// Eigenvalues of a symmetric 3 x 3 matrix in ascending order; the upper triangle is read.
///
/// Closed form by the characteristic cubic, reduced to `4 y^3 - 3 y = x`. Relative to the largest
/// magnitude, the error is a few 1e-16 for distinct eigenvalues, and grows to 1e-8 if two of them
/// coincide.
pub fn symmetric_eigenvalues(a: &Matrix3<f64>) -> [f64; 3] {
    let (mean, spread, x) = cubic(a);
    if spread == 0.0 {
        return [mean; 3];
    }
    let min = mean + 2.0 * spread * min_root(x);
    let max = mean - 2.0 * spread * min_root(-x);
    [min, 3.0 * mean - max - min, max]
}

/// Returns `mean`, `spread` and `x`: the eigenvalues are `mean + 2 spread y` for the roots of `4
/// y^3 - 3 y = x`.
#[inline(always)]
fn cubic(a: &Matrix3<f64>) -> (f64, f64, f64) {
    let mean = (a[(0, 0)] + a[(1, 1)] + a[(2, 2)]) / 3.0;
    let off = a[(0, 1)] * a[(0, 1)] + a[(0, 2)] * a[(0, 2)] + a[(1, 2)] * a[(1, 2)];
    let (d0, d1, d2) = (a[(0, 0)] - mean, a[(1, 1)] - mean, a[(2, 2)] - mean);
    let spread = sqrt((d0 * d0 + d1 * d1 + d2 * d2 + 2.0 * off) / 6.0);
    if spread <= f64::EPSILON * abs(mean) {
        return (mean, 0.0, 0.0);
    }
    let determinant = d0 * (d1 * d2 - a[(1, 2)] * a[(1, 2)])
        - a[(0, 1)] * (a[(0, 1)] * d2 - a[(1, 2)] * a[(0, 2)])
        + a[(0, 2)] * (a[(0, 1)] * a[(1, 2)] - d1 * a[(0, 2)]);
    let x = determinant / (2.0 * spread * spread * spread);
    (mean, spread, x.clamp(-1.0, 1.0))
}

/// Returns the smallest root of `4 y^3 - 3 y = x` for `-1 <= x <= 1`, `cos(acos(x) / 3 + 2 pi / 3)`, to 2e-16.
///
/// The root is analytic in `sqrt(1 - x)` and interpolated at Chebyshev points of it; without
/// rounding the error is 3e-17.
#[inline(always)]
fn min_root(x: f64) -> f64 {
    let t = SQRT_2 * sqrt(1.0 - x) - 1.0;
    let (z, c) = (t * t, &MIN_ROOT_COEFFICIENTS);
    let w = z * z;
    // Groups every fourth power: four independent sums.
    let mut sums = [c[16], c[17], c[18], 0.0];
    for k in (0..4).rev() {
        for i in 0..4 {
            sums[i] = sums[i].multiply_add(w, c[4 * k + i]);
        }
    }
    let odd = t.multiply_add(sums[3], sums[2]);
    z.multiply_add(odd, t.multiply_add(sums[1], sums[0]))
}

/// Coefficients in powers of `sqrt(2 (1 - x)) - 1`.
const MIN_ROOT_COEFFICIENTS: [f64; 19] = [
    -0.766_044_443_118_978,
    -0.247_409_066_322_853_4,
    0.015_509_188_436_485_936,
    -0.002_466_352_815_065_628_5,
    0.000_504_124_691_138_123_3,
    -0.000_116_425_453_318_249_31,
    2.891_993_630_551_945e-5,
    -7.541_075_563_453_027e-6,
    2.035_869_665_081_840_6e-6,
    -5.641_643_328_528_482e-7,
    1.595_433_626_667_477_6e-7,
    -4.582_632_206_690_477_6e-8,
    1.334_861_626_366_851e-8,
    -3.982_036_064_644_077e-9,
    1.184_625_070_317_413_6e-9,
    -3.093_616_173_100_703e-10,
    9.309_326_514_430_476e-11,
    -5.114_664_526_508_49e-11,
    1.568_610_274_461_335_5e-11,
];

/// Returns whether all singular values of a 3 x `N` matrix, given by columns, are above `bound`, up to a rounding of
/// their squares.
///
/// This is Sylvester's criterion: all leading minors of `J J^T - bound^2` are positive. It is much cheaper than
/// [`min_singular_value`].
#[inline]
pub fn singular_values_exceed<const N: usize>(j: &[[f64; 3]; N], bound: f64) -> bool {
    let [xx, xy, yy, xz, yz, zz] = gram_3(j);
    let square = bound * bound;
    let (xx, yy, zz) = (xx - square, yy - square, zz - square);
    let minor = xx * yy - xy * xy;
    let determinant = zz * minor + xz * (xy * yz - yy * xz) - yz * (xx * yz - xy * xz);
    (xx > 0.0) & (minor > 0.0) & (determinant > 0.0)
}

/// Returns whether the submatrix of the three rows and columns `at` of a symmetric matrix is positive definite, by its
/// leading minors. Reads the lower triangle.
#[inline]
pub(crate) fn is_positive_definite_3(
    a: impl Fn(usize, usize) -> f64,
    [x, y, z]: [usize; 3],
) -> bool {
    let (xx, yx, yy) = (a(x, x), a(y, x), a(y, y));
    let (zx, zy, zz) = (a(z, x), a(z, y), a(z, z));
    let minor = xx * yy - yx * yx;
    let determinant = zz * minor + zx * (yx * zy - yy * zx) - zy * (xx * zy - yx * zx);
    (xx > 0.0) & (minor > 0.0) & (determinant > 0.0) & (determinant < f64::INFINITY)
}

/// Inverse of a 3 x 3 matrix that is given by columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inverse3 {
    /// Rows of the inverse times the determinant.
    rows: [V3; 3],
    determinant: f64,
}

impl Inverse3 {
    #[inline(always)]
    pub fn new([a, b, c]: [V3; 3]) -> Inverse3 {
        let rows = [cross(b, c), cross(c, a), cross(a, b)];
        Inverse3 {
            rows,
            determinant: dot(a, rows[0]),
        }
    }

    /// Sufficient test that all singular values exceed `bound`: the Frobenius norm of the inverse
    /// bounds its largest singular value. Cheaper than the exact [`singular_values_exceed`].
    #[inline(always)]
    pub fn exceeds_conservatively(&self, bound: f64) -> bool {
        let [a, b, c] = self.rows;
        let squares = dot(a, a) + dot(b, b) + dot(c, c);
        squares * (bound * bound) < self.determinant * self.determinant
    }

    /// Returns the rows of the inverse.
    #[inline(always)]
    pub fn rows(&self) -> [V3; 3] {
        let scale = 1.0 / self.determinant;
        let mut rows = self.rows;
        for entry in rows.as_flattened_mut() {
            *entry *= scale;
        }
        rows
    }
}

/// Returns `J J^T`: `xx, xy, yy, xz, yz, zz`.
#[inline(always)]
fn gram_3<const N: usize>(j: &[[f64; 3]; N]) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for [x, y, z] in j {
        let pairs = [(x, x), (x, y), (y, y), (x, z), (y, z), (z, z)];
        for (sum, (a, b)) in sums.iter_mut().zip(pairs) {
            *sum = a.multiply_add(*b, *sum);
        }
    }
    sums
}

/// Returns the smallest singular value of a 3 x `N` matrix, from its 3 x 3 Gram matrix.
///
/// Near zero the error is about 1e-8 times the largest singular value, and up to 3e-4 times it if
/// two vanish together: sufficient to schedule damping, not to determine the rank.
/// The function is inlined, so an unused value costs nothing.
#[inline(always)]
pub fn min_singular_value<const N: usize>(j: &Matrix<3, N>) -> f64 {
    let [xx, xy, yy, xz, yz, zz] = gram_3(&j.data.0);
    let gram = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let (mean, spread, x) = cubic(&gram);
    sqrt((mean + 2.0 * spread * min_root(x)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::{Inverse3, min_root, singular_values_exceed};
    use crate::math::{Matrix3, Vector3, acos, cos};
    use crate::property::config;
    use proptest::array::uniform3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(config(256, 20_261_122))]

        #[test]
        fn inverse3_inverts_a_3x3_matrix(
            columns in uniform3(uniform3(-2.0..2.0)),
            x in uniform3(-2.0..2.0),
            bound in 1e-3..2.0,
        ) {
            let (inverse, matrix) = (Inverse3::new(columns), Matrix3::from(columns));
            let x = Vector3::from(x);
            let error = Matrix3::from(inverse.rows()).tr_mul(&(matrix * x)) - x;
            // Relative to the entries of the matrix, the smallest singular value is a measure of
            // its condition.
            let min = matrix.singular_values().min();
            prop_assert!(error.amax() * min * min < 1e-12, "{error}");
            if inverse.exceeds_conservatively(bound) {
                prop_assert!(singular_values_exceed(&columns, bound * (1.0 - 1e-9)));
            }
            // Close to exact: the Frobenius norm is at most sqrt(3) times the largest singular
            // value.
            if singular_values_exceed(&columns, bound * 1.8) {
                prop_assert!(inverse.exceeds_conservatively(bound));
            }
        }
    }

    #[test]
    fn min_root_solves_the_cubic() {
        for k in 0..=100_000 {
            let x = f64::from(k) / 50_000.0 - 1.0;
            let y = min_root(x);
            let expected = cos(acos(x) / 3.0 + 2.0 * core::f64::consts::FRAC_PI_3);
            // Near one, where two roots coincide, the reference itself is not more accurate.
            let slack = if x > 0.999 { 2e-12 } else { 1e-15 };
            assert!((y - expected).abs() < slack, "{x}: {y} {expected}");
            assert!((4.0 * y * y * y - 3.0 * y - x).abs() < 3e-15, "{x}: {y}");
        }
    }

    #[test]
    fn conservative_test_rejects_a_singular_matrix() {
        let flat = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        assert!(!Inverse3::new(flat).exceeds_conservatively(1e-9));
        assert!(!Inverse3::new([[0.0; 3]; 3]).exceeds_conservatively(0.0));
        assert!(!Inverse3::new([[f64::NAN; 3]; 3]).exceeds_conservatively(0.1));
    }
}
