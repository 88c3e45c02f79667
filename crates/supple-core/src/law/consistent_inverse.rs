//! The dynamically consistent inverse `Jb = H^-1 J^T A^-1`, `A = J H^-1 J^T`, by one elimination of both matrices.
//!
//! `L D L^T` of the symmetric matrix `[H J^T; J 0]`: after the pivots of `H` its lower right block is `-A`. All columns are held
//! in groups of lanes from the first step to the last.
#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns are counted: each index goes into several arrays"
)]

use crate::math::Matrix;
use crate::math::lanes::{
    Column, Columns, LANES, Lanes, Number, column, columns, entry, in_groups,
};

/// Repeats a statement for `$k` from 0 to `$n - 1`, with `$k` known at compile time up to 12.
macro_rules! unrolled {
    ($k:ident in $n:expr => $body:block) => {
        unrolled!(@ $k, $n, $body, 0 1 2 3 4 5 6 7 8 9 10 11);
        for $k in 12..$n $body
    };
    (@ $k:ident, $n:expr, $body:block, $($at:literal)*) => {
        $(if $at < $n {
            let $k: usize = $at;
            $body
        })*
    };
}

/// Returns `Jb`, with `A + E` for `A`: `adjust_pivot(i, pivot)` gives pivot `i` of `A + E`. `None` if one of the two matrices is not
/// positive definite. Reads the lower triangle of the mass matrix, given by columns.
#[inline(always)]
pub(super) fn consistent_inverse<const N: usize, const G: usize, const D: usize>(
    mass_matrix: &Columns<N, G>,
    jacobian: &Matrix<D, N>,
    adjust_pivot: impl FnMut(usize, f64) -> f64,
) -> Option<Matrix<N, D>> {
    in_groups!(D, in_lanes[N, G](mass_matrix, jacobian, adjust_pivot))
}

#[inline(always)]
fn in_lanes<const N: usize, const G: usize, const D: usize, const T: usize>(
    mass_matrix: &Columns<N, G>,
    jacobian: &Matrix<D, N>,
    mut adjust_pivot: impl FnMut(usize, f64) -> f64,
) -> Option<Matrix<N, D>> {
    let mut h = *mass_matrix;
    let mut j: Columns<N, T> = columns(jacobian);
    let mut a: Columns<D, T> = [[Lanes::ZERO; T]; D];
    let mut definite = true;
    unrolled!(k in N => {
        let pivot = entry(&h[k], k);
        definite &= pivot > 0.0 && pivot < f64::INFINITY;
        let inverse = Lanes::splat(1.0 / pivot);
        let (before, jacobian) = (h[k], j[k]);
        scale(&mut h[k], inverse);
        scale(&mut j[k], inverse);
        for i in k + 1..N {
            let factor = Lanes::splat(-entry(&h[k], i));
            add(&mut h[i], factor, &before, i / LANES);
            add(&mut j[i], factor, &jacobian, 0);
        }
        for i in 0..D {
            let factor = Lanes::splat(entry(&j[k], i));
            add(&mut a[i], factor, &jacobian, i / LANES);
        }
    });
    // A^-1, its rows in lanes.
    let mut x: Columns<D, T> = core::array::from_fn(|k| {
        let row: [f64; D] = core::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
        column(&row)
    });
    let mut pivots = [Lanes::ZERO; D];
    unrolled!(k in D => {
        let pivot = adjust_pivot(k, entry(&a[k], k));
        definite &= pivot > 0.0 && pivot < f64::INFINITY;
        pivots[k] = Lanes::splat(1.0 / pivot);
        let before = a[k];
        scale(&mut a[k], pivots[k]);
        for i in k + 1..D {
            let factor = Lanes::splat(-entry(&a[k], i));
            add(&mut a[i], factor, &before, i / LANES);
            let row = x[k];
            for group in 0..=k / LANES {
                x[i][group] = factor.multiply_add(row[group], x[i][group]);
            }
        }
    });
    for k in 0..D {
        scale(&mut x[k], pivots[k]);
    }
    unrolled!(k in D => {
        let k = D - 1 - k;
        let row = x[k];
        for i in 0..k {
            add(&mut x[i], Lanes::splat(-entry(&a[i], k)), &row, 0);
        }
    });
    let mut y: Columns<N, T> = [[Lanes::ZERO; T]; N];
    unrolled!(k in N => {
        for i in 0..D {
            add(&mut y[k], Lanes::splat(entry(&j[k], i)), &x[i], 0);
        }
    });
    unrolled!(k in N => {
        let k = N - 1 - k;
        let row = y[k];
        for i in 0..k {
            add(&mut y[i], Lanes::splat(-entry(&h[i], k)), &row, 0);
        }
    });
    definite.then(|| Matrix::from_fn(|joint, direction| entry(&y[joint], direction)))
}

/// Multiplies a column by the same number in all lanes.
#[inline(always)]
fn scale<const G: usize>(column: &mut Column<G>, factor: Lanes) {
    for x in column {
        *x *= factor;
    }
}

/// Adds a multiple of `other` from group `first` on.
#[inline(always)]
fn add<const G: usize>(column: &mut Column<G>, factor: Lanes, other: &Column<G>, first: usize) {
    for group in first..G {
        column[group] = factor.multiply_add(other[group], column[group]);
    }
}
