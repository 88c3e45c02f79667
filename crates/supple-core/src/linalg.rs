//! The small linear algebra that the law needs, for sizes known at compile time.

use crate::math::{Matrix, Matrix3, Vector, abs, acos, cos, sqrt};

/// Lower factor of a symmetric positive definite matrix, `A = L L^T`.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky<const N: usize> {
    lower: Matrix<N, N>,
    inverse_diagonal: Vector<N>,
}

impl<const N: usize> Cholesky<N> {
    /// Reads the lower triangle of `a`. `None` where `a` is not positive definite.
    #[inline]
    pub fn new(a: &Matrix<N, N>) -> Option<Self> {
        let mut lower = Matrix::<N, N>::zeros();
        let mut inverse_diagonal = Vector::<N>::zeros();
        for j in 0..N {
            let mut d = a[(j, j)];
            for k in 0..j {
                d -= lower[(j, k)] * lower[(j, k)];
            }
            if !(d > 0.0 && d.is_finite()) {
                return None;
            }
            let d = sqrt(d);
            lower[(j, j)] = d;
            inverse_diagonal[j] = 1.0 / d;
            for i in j + 1..N {
                let mut s = a[(i, j)];
                for k in 0..j {
                    s -= lower[(i, k)] * lower[(j, k)];
                }
                lower[(i, j)] = s * inverse_diagonal[j];
            }
        }
        Some(Self {
            lower,
            inverse_diagonal,
        })
    }

    /// `L^-1 B`.
    #[inline]
    pub fn solve_lower<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = *b;
        for c in 0..C {
            for i in 0..N {
                let mut s = x[(i, c)];
                for k in 0..i {
                    s -= self.lower[(i, k)] * x[(k, c)];
                }
                x[(i, c)] = s * self.inverse_diagonal[i];
            }
        }
        x
    }

    /// `A^-1 B`.
    #[inline]
    pub fn solve<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = self.solve_lower(b);
        for c in 0..C {
            for i in (0..N).rev() {
                let mut s = x[(i, c)];
                for k in i + 1..N {
                    s -= self.lower[(k, i)] * x[(k, c)];
                }
                x[(i, c)] = s * self.inverse_diagonal[i];
            }
        }
        x
    }
}

/// Eigenvalues of a symmetric 3 x 3 matrix in ascending order; the upper triangle is read.
///
/// Closed form by the angle of the characteristic cubic. Relative to the greatest in size, the error
/// is a few 1e-16 where the eigenvalues are apart, and grows to 1e-8 where two of them coincide.
pub fn symmetric_eigenvalues(a: &Matrix3<f64>) -> [f64; 3] {
    let mean = (a[(0, 0)] + a[(1, 1)] + a[(2, 2)]) / 3.0;
    let off = a[(0, 1)] * a[(0, 1)] + a[(0, 2)] * a[(0, 2)] + a[(1, 2)] * a[(1, 2)];
    let (d0, d1, d2) = (a[(0, 0)] - mean, a[(1, 1)] - mean, a[(2, 2)] - mean);
    let spread = sqrt((d0 * d0 + d1 * d1 + d2 * d2 + 2.0 * off) / 6.0);
    if spread <= f64::EPSILON * abs(mean) {
        return [mean; 3];
    }
    let determinant = d0 * (d1 * d2 - a[(1, 2)] * a[(1, 2)])
        - a[(0, 1)] * (a[(0, 1)] * d2 - a[(1, 2)] * a[(0, 2)])
        + a[(0, 2)] * (a[(0, 1)] * a[(1, 2)] - d1 * a[(0, 2)]);
    let half = (determinant / (2.0 * spread * spread * spread)).clamp(-1.0, 1.0);
    let angle = acos(half) / 3.0;
    let third = 2.0 * core::f64::consts::FRAC_PI_3;
    let greatest = mean + 2.0 * spread * cos(angle);
    let least = mean + 2.0 * spread * cos(angle + third);
    [least, 3.0 * mean - greatest - least, greatest]
}

/// Least singular value of a 3 x `N` matrix, through its 3 x 3 Gram matrix.
///
/// Near zero the error is about 1e-8 times the greatest singular value, and up to 3e-4 times it where
/// two vanish together: enough to schedule damping, not to decide rank.
pub fn least_singular_value<const N: usize>(j: &Matrix<3, N>) -> f64 {
    let [least, ..] = symmetric_eigenvalues(&(j * j.transpose()));
    sqrt(least.max(0.0))
}
