//! The small linear algebra that the law needs, for sizes known at compile time.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::{Matrix, Matrix3, Vector, abs, acos, cos, sqrt};

/// Cholesky factors without square roots of a symmetric positive definite matrix: `A = L D L^T`, `L` unit
/// lower, `D` diagonal. The roots would be half of the time of a small solve.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky<const N: usize> {
    /// Columns of `L`; what is not below the diagonal means nothing.
    lower: [[f64; N]; N],
    inverse_pivots: [f64; N],
}

impl<const N: usize> Cholesky<N> {
    /// Reads the lower triangle of `a`. `None` where `a` is not positive definite.
    #[inline]
    pub fn new(a: &Matrix<N, N>) -> Option<Self> {
        Self::with_pivots(a, |_, pivot| pivot)
    }

    /// The same of `A + E`, `E` diagonal: what `replaced` adds to each pivot, counted from 0, on the way.
    #[inline]
    pub fn with_pivots(a: &Matrix<N, N>, replaced: impl Fn(usize, f64) -> f64) -> Option<Self> {
        let mut rest = a.data.0;
        let mut inverse_pivots = [0.0; N];
        let mut definite = true;
        for k in 0..N {
            let column = rest[k];
            let pivot = replaced(k, column[k]);
            definite &= pivot > 0.0 && pivot < f64::INFINITY;
            let inverse = 1.0 / pivot;
            inverse_pivots[k] = inverse;
            let scaled = column.map(|x| x * inverse);
            rest[k] = scaled;
            for j in k + 1..N {
                for i in 0..N {
                    rest[j][i] -= scaled[j] * column[i];
                }
            }
        }
        definite.then_some(Self {
            lower: rest,
            inverse_pivots,
        })
    }

    /// `L^-1 B`.
    #[inline]
    pub fn solve_lower<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = *b;
        for column in &mut x.data.0 {
            for k in 0..N {
                for i in k + 1..N {
                    column[i] -= self.lower[k][i] * column[k];
                }
            }
        }
        x
    }

    /// `B L^-T`, the transpose of `L^-1 B^T`.
    #[inline]
    pub fn solve_lower_right<const R: usize>(&self, b: &Matrix<R, N>) -> Matrix<R, N> {
        let mut x = b.data.0;
        for k in 0..N {
            let before = x[k];
            for i in k + 1..N {
                for (entry, other) in x[i].iter_mut().zip(&before) {
                    *entry -= self.lower[k][i] * other;
                }
            }
        }
        let mut out = *b;
        out.data.0 = x;
        out
    }

    /// `D^-1 B`.
    #[inline]
    pub fn divide<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = *b;
        for column in &mut x.data.0 {
            for (entry, inverse_pivot) in column.iter_mut().zip(&self.inverse_pivots) {
                *entry *= inverse_pivot;
            }
        }
        x
    }

    /// `L^-T B`.
    #[inline]
    pub fn solve_upper<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = *b;
        for column in &mut x.data.0 {
            for k in (0..N).rev() {
                for i in 0..k {
                    column[i] -= self.lower[i][k] * column[k];
                }
            }
        }
        x
    }

    /// `A^-1 B`.
    #[inline]
    pub fn solve<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        self.solve_upper(&self.divide(&self.solve_lower(b)))
    }

    /// `B A^-1 B^T`, given `half`, `B L^-T`.
    #[inline]
    pub fn gram<const R: usize>(&self, half: &Matrix<R, N>) -> Matrix<R, R> {
        let mut sum = Matrix::<R, R>::zeros();
        for (column, inverse_pivot) in half.data.0.iter().zip(&self.inverse_pivots) {
            for j in 0..R {
                let scaled = column[j] * inverse_pivot;
                for i in 0..R {
                    sum.data.0[j][i] += column[i] * scaled;
                }
            }
        }
        sum
    }
}

/// `M v`, without nalgebra's general product: it is what small loops are quick at.
#[inline(always)]
pub fn times<const R: usize, const C: usize>(m: &Matrix<R, C>, v: &Vector<C>) -> Vector<R> {
    let mut out = [0.0; R];
    for (column, x) in m.data.0.iter().zip(&v.data.0[0]) {
        for (sum, entry) in out.iter_mut().zip(column) {
            *sum += entry * x;
        }
    }
    Vector::from(out)
}

/// `M^T v`.
#[inline(always)]
pub fn transpose_times<const R: usize, const C: usize>(
    m: &Matrix<R, C>,
    v: &Vector<R>,
) -> Vector<C> {
    let mut out = [0.0; C];
    for (sum, column) in out.iter_mut().zip(&m.data.0) {
        for (entry, x) in column.iter().zip(&v.data.0[0]) {
            *sum += entry * x;
        }
    }
    Vector::from(out)
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

/// Whether the least singular value of a 3 x `N` matrix is above `bound`, without finding it: certain where
/// it says yes; where it says no, ask [`least_singular_value`].
///
/// Of eigenvalues `a <= b <= c` of the Gram matrix, `a = det / (b c) >= 4 det / trace^2`.
#[inline]
pub fn singular_values_exceed<const N: usize>(j: &Matrix<3, N>, bound: f64) -> bool {
    let [xx, xy, yy, xz, yz, zz] = gram_3(j);
    let determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let trace = xx + yy + zz;
    4.0 * determinant > bound * bound * trace * trace
}

/// `J J^T`: `xx, xy, yy, xz, yz, zz`.
#[inline(always)]
fn gram_3<const N: usize>(j: &Matrix<3, N>) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for [x, y, z] in &j.data.0 {
        let products = [x * x, x * y, y * y, x * z, y * z, z * z];
        for (sum, product) in sums.iter_mut().zip(products) {
            *sum += product;
        }
    }
    sums
}

/// Least singular value of a 3 x `N` matrix, through its 3 x 3 Gram matrix.
///
/// Near zero the error is about 1e-8 times the greatest singular value, and up to 3e-4 times it where
/// two vanish together: enough to schedule damping, not to decide rank.
pub fn least_singular_value<const N: usize>(j: &Matrix<3, N>) -> f64 {
    let [xx, xy, yy, xz, yz, zz] = gram_3(j);
    let gram = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let [least, ..] = symmetric_eigenvalues(&gram);
    sqrt(least.max(0.0))
}
