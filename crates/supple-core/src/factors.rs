//! Cholesky factors in groups ([`crate::lanes`]), for the law: `A = L D L^T`, `L` unit lower, `D` diagonal,
//! without square roots. [`crate::linalg::Cholesky`] is the plain one.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::lanes::{Columns, LANES, Lanes, Number, entry, scaled};

/// Factors of a symmetric positive definite matrix.
pub(crate) struct Factors<const N: usize, const G: usize> {
    /// Columns of `L`; what is not below the diagonal means nothing.
    lower: Columns<N, G>,
    inverse_pivots: [f64; N],
}

impl<const N: usize, const G: usize> Factors<N, G> {
    /// Of `A + E`, `E` diagonal: what `replaced` adds to each pivot, counted from 0, on the way. Reads `A`
    /// from the diagonal downwards. `None` where the sum is not positive definite.
    #[inline(always)]
    pub fn new(mut a: Columns<N, G>, replaced: impl Fn(usize, f64) -> f64) -> Option<Self> {
        let mut inverse_pivots = [0.0; N];
        let mut definite = true;
        for k in 0..N {
            let column = a[k];
            let pivot = replaced(k, entry(&column, k));
            definite &= pivot > 0.0 && pivot < f64::INFINITY;
            inverse_pivots[k] = 1.0 / pivot;
            let inverse = Lanes::splat(inverse_pivots[k]);
            let scaled = scaled(column, inverse);
            for j in k + 1..N {
                let across = Lanes::splat(-entry(&column, j));
                for group in j / LANES..G {
                    a[j][group] = across.times_plus(scaled[group], a[j][group]);
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
                x[i] = (-entry(&self.lower[k], i)).times_plus(x[k], x[i]);
            }
        }
        for k in (0..N).rev() {
            x[k] *= self.inverse_pivots[k];
            for i in k + 1..N {
                x[k] = (-entry(&self.lower[k], i)).times_plus(x[i], x[k]);
            }
        }
        x
    }

    /// `B L^-T`.
    #[inline(always)]
    pub fn half<const R: usize>(&self, mut b: Columns<N, R>) -> Columns<N, R> {
        for k in 0..N {
            for i in k + 1..N {
                let across = Lanes::splat(-entry(&self.lower[k], i));
                for row in 0..R {
                    b[i][row] = across.times_plus(b[k][row], b[i][row]);
                }
            }
        }
        b
    }

    /// `B A^-1 B^T` from the diagonal downwards, given `half`, `B L^-T` of `D` rows.
    #[inline(always)]
    pub fn gram<const D: usize, const R: usize>(&self, half: &Columns<N, R>) -> Columns<D, R> {
        let mut sum = [[Lanes::ZERO; R]; D];
        for k in 0..N {
            let scaled = scaled(half[k], Lanes::splat(self.inverse_pivots[k]));
            for j in 0..D {
                let across = Lanes::splat(entry(&scaled, j));
                for row in j / LANES..R {
                    sum[j][row] = across.times_plus(half[k][row], sum[j][row]);
                }
            }
        }
        sum
    }
}

/// Against [`crate::linalg::Cholesky`], which has its own tests.
#[cfg(test)]
mod tests {
    use super::Factors;
    use crate::lanes::{Columns, column, entry};
    use crate::linalg::Cholesky;
    use crate::math::{Matrix, Vector};
    use core::array::from_fn;
    use proptest::array::uniform;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

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

        let half = factors.half(columns::<D, N, R>(&b));
        let gram: Columns<D, R> = factors.gram(&half);
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
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            rng_seed: RngSeed::Fixed(20_260_105),
            ..ProptestConfig::default()
        })]

        #[test]
        fn four_joints_three_directions(a in entries::<4, 4>(), b in entries::<3, 4>(), e in 0.0..0.5) {
            same::<4, 1, 3, 1>(a, b, e)?;
        }

        #[test]
        fn seven_joints_six_directions(a in entries::<7, 7>(), b in entries::<6, 7>(), e in 0.0..0.5) {
            same::<7, 2, 6, 2>(a, b, e)?;
        }
    }
}
