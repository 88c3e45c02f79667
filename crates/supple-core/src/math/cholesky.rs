//! Cholesky factors without square roots, which would take half of the time of a small solve.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns are counted: each index goes into several arrays"
)]

use crate::math::Matrix;
use crate::math::lanes::{LANES, Lanes, Number};

/// Factors of a symmetric positive definite matrix: `A = L D L^T`, `L` unit lower, `D` diagonal.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky<const N: usize> {
    /// Columns of `L`; entries on and above the diagonal are unused.
    lower: [[f64; N]; N],
    inverse_pivots: [f64; N],
}

impl<const N: usize> Cholesky<N> {
    /// Reads the lower triangle of `a`. `None` if `a` is not positive definite.
    #[inline(always)]
    pub fn new(a: &Matrix<N, N>) -> Option<Self> {
        let mut rest = a.data.0;
        let mut inverse_pivots = [0.0; N];
        let mut definite = true;
        for k in 0..N {
            let column = rest[k];
            let pivot = column[k];
            definite &= pivot > 0.0 && pivot < f64::INFINITY;
            inverse_pivots[k] = 1.0 / pivot;
            for i in k + 1..N {
                rest[k][i] *= inverse_pivots[k];
            }
            for j in k + 1..N {
                for i in j..N {
                    rest[j][i] = (-rest[k][j]).multiply_add(column[i], rest[j][i]);
                }
            }
        }
        definite.then_some(Self {
            lower: rest,
            inverse_pivots,
        })
    }

    /// Returns `A^-1 B`, four columns at a time.
    #[inline(always)]
    pub fn solve<const C: usize>(&self, b: &Matrix<N, C>) -> Matrix<N, C> {
        let mut x = *b;
        if C == 1 {
            for column in &mut x.data.0 {
                self.solve_in_place(column);
            }
            return x;
        }
        for first in (0..C).step_by(LANES) {
            let at = |i: usize, lane: usize| match first + lane {
                column if column < C => b.data.0[column][i],
                _ => 0.0,
            };
            let mut group = [Lanes::splat(0.0); N];
            for i in 0..N {
                group[i] = Lanes::new([at(i, 0), at(i, 1), at(i, 2), at(i, 3)]);
            }
            self.solve_in_place(&mut group);
            for lane in 0..LANES.min(C - first) {
                for i in 0..N {
                    x.data.0[first + lane][i] = group[i].as_array()[lane];
                }
            }
        }
        x
    }

    /// `A^-1 x`, of one column or of a group of them.
    #[inline(always)]
    fn solve_in_place<T: Number>(&self, x: &mut [T; N]) {
        for k in 0..N {
            for i in k + 1..N {
                x[i] = T::splat(-self.lower[k][i]).multiply_add(x[k], x[i]);
            }
        }
        for k in 0..N {
            x[k] = x[k] * T::splat(self.inverse_pivots[k]);
        }
        for k in (0..N).rev() {
            for i in 0..k {
                x[i] = T::splat(-self.lower[i][k]).multiply_add(x[k], x[i]);
            }
        }
    }
}
