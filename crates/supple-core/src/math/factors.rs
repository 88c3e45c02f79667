//! Cholesky factors in groups ([`crate::math::lanes`]), for the law: `A = L D L^T`, `L` unit lower, `D`
//! diagonal, without square roots. [`crate::math::linalg::Cholesky`] is the scalar version.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::lanes::{Columns, LANES, Lanes, Number, entry, scaled};

/// Factors of a symmetric positive definite matrix.
pub(crate) struct Factors<const N: usize, const G: usize> {
    /// Columns of `L`; entries on and above the diagonal are unused.
    lower: Columns<N, G>,
    inverse_pivots: [f64; N],
}

impl<const N: usize, const G: usize> Factors<N, G> {
    /// Factors `A + E` with `E` diagonal: `adjust_pivot(i, pivot)` gives the modified pivot `i` during
    /// the factorisation. Reads the lower triangle of `A`. `None` if the result is not positive
    /// definite.
    #[inline(always)]
    pub fn new(mut a: Columns<N, G>, adjust_pivot: impl Fn(usize, f64) -> f64) -> Option<Self> {
        let mut inverse_pivots = [0.0; N];
        let mut definite = true;
        for k in 0..N {
            let column = a[k];
            let pivot = adjust_pivot(k, entry(&column, k));
            definite &= pivot > 0.0 && pivot < f64::INFINITY;
            inverse_pivots[k] = 1.0 / pivot;
            let inverse = Lanes::splat(inverse_pivots[k]);
            let scaled = scaled(column, inverse);
            for j in k + 1..N {
                let across = Lanes::splat(-entry(&column, j));
                for group in j / LANES..G {
                    a[j][group] = across.multiply_add(scaled[group], a[j][group]);
                }
            }
            a[k] = scaled;
        }
        definite.then_some(Factors {
            lower: a,
            inverse_pivots,
        })
    }

    /// `A^-1 b`.
    #[inline(always)]
    pub fn solve(&self, b: &[f64; N]) -> [f64; N] {
        let mut x = *b;
        for k in 0..N {
            for i in k + 1..N {
                x[i] = (-entry(&self.lower[k], i)).multiply_add(x[k], x[i]);
            }
        }
        for k in (0..N).rev() {
            x[k] *= self.inverse_pivots[k];
            for i in k + 1..N {
                x[k] = (-entry(&self.lower[k], i)).multiply_add(x[i], x[k]);
            }
        }
        x
    }

    /// `B L^-T`.
    #[inline(always)]
    pub fn solve_right<const R: usize>(&self, mut b: Columns<N, R>) -> Columns<N, R> {
        for k in 0..N {
            for i in k + 1..N {
                let across = Lanes::splat(-entry(&self.lower[k], i));
                for row in 0..R {
                    b[i][row] = across.multiply_add(b[k][row], b[i][row]);
                }
            }
        }
        b
    }

    /// `B A^-1 B^T` from the diagonal downwards, from `right`, which is `B L^-T` with `D` rows.
    #[inline(always)]
    pub fn gram<const D: usize, const R: usize>(&self, right: &Columns<N, R>) -> Columns<D, R> {
        let mut sum = [[Lanes::ZERO; R]; D];
        for k in 0..N {
            let scaled = scaled(right[k], Lanes::splat(self.inverse_pivots[k]));
            for j in 0..D {
                let across = Lanes::splat(entry(&scaled, j));
                for row in j / LANES..R {
                    sum[j][row] = across.multiply_add(right[k][row], sum[j][row]);
                }
            }
        }
        sum
    }
}

/// Compares with [`crate::math::linalg::Cholesky`], which has its own tests.
#[cfg(test)]
mod tests {
    use super::Factors;
    use crate::math::lanes::{Columns, column, entry};
    use crate::math::linalg::Cholesky;
    use crate::math::{Matrix, Vector};
    use crate::property::config;
    use core::array::from_fn;
    use proptest::array::uniform;
    use proptest::prelude::*;

    fn columns<const D: usize, const N: usize, const G: usize>(m: &Matrix<D, N>) -> Columns<N, G> {
        from_fn(|k| column::<D, G>(&m.data.0[k]))
    }

    /// `E` is added to the pivots of `A`; `b` has `D` rows in `R` groups.
    fn same<const N: usize, const G: usize, const D: usize, const R: usize>(
        square: [[f64; N]; N],
        b: [[f64; D]; N],
        added: f64,
    ) -> Result<(), TestCaseError> {
        let square = Matrix::<N, N>::from(square);
        let a = square * square.transpose() + Matrix::<N, N>::identity() * 0.01;
        let plain = Cholesky::new(&(a + Matrix::<N, N>::identity() * added)).expect("definite");
        let factors =
            Factors::<N, G>::new(columns(&a), |_, pivot| pivot + added).expect("definite");
        let b = Matrix::<D, N>::from(b);

        let x = Vector::from(square.data.0[0]);
        let difference = Vector::from(factors.solve(&square.data.0[0])) - plain.solve(&x);
        prop_assert!(difference.amax() < 1e-9, "{difference}");

        let right = factors.solve_right(columns::<D, N, R>(&b));
        let gram: Columns<D, R> = factors.gram(&right);
        let expected = b * plain.solve(&b.transpose());
        for j in 0..D {
            for i in j..D {
                let found = entry(&gram[j], i);
                let error = found - expected[(i, j)];
                prop_assert!(error.abs() < 1e-9 * (1.0 + found.abs()), "{i} {j}: {error}");
            }
        }
        let refused = Factors::<N, G>::new(columns(&-a), |_, pivot| pivot);
        prop_assert!(refused.is_none());
        Ok(())
    }

    fn entries<const R: usize, const C: usize>() -> impl Strategy<Value = [[f64; R]; C]> {
        uniform(uniform(-2.0..2.0))
    }

    proptest! {
        #![proptest_config(config(256, 20_260_105))]

        #[test]
        fn factors_match_cholesky_for_four_joints_three_directions(a in entries::<4, 4>(), b in entries::<3, 4>(), e in 0.0..0.5) {
            same::<4, 1, 3, 1>(a, b, e)?;
        }

        #[test]
        fn factors_match_cholesky_for_seven_joints_six_directions(a in entries::<7, 7>(), b in entries::<6, 7>(), e in 0.0..0.5) {
            same::<7, 2, 6, 2>(a, b, e)?;
        }
    }
}
