//! SIMD over the joints: one function is evaluated for four joints at a time.
//!
//! The quantities of the joints are stored by rows: one row per quantity, in groups of [`LANES`]
//! joints, the last group padded with zeros. A function of one joint is applied to one group at a
//! time. The crate `wide` provides the vector types: a processor without vector instructions gives
//! bit-identical results.
//!
//! A multiply-add is rounded once in builds for processors with fused multiply-add ([`FUSED`]), and
//! twice in other builds. The choice is made at compile time, never at run time, so that all
//! binaries of one build give identical results.

use crate::math::Matrix;
use core::array::from_fn;
use core::ops::{Add, Mul, Neg, Sub};
pub(crate) use wide::f64x4 as Lanes;

/// Whether this build is for processors with fused multiply-add (as with `-C target-cpu=native`):
/// its results differ from those of other builds by rounding.
pub const FUSED: bool = cfg!(all(target_arch = "x86_64", target_feature = "fma"));

/// Joints in a group.
pub(crate) const LANES: usize = 4;

/// `K` quantities of each joint, in `G` groups.
pub(crate) type Rows<const K: usize, const G: usize> = [[Lanes; G]; K];

/// A vector over the joints, or over a task's directions, in `G` groups.
pub(crate) type Column<const G: usize> = [Lanes; G];

/// A matrix by columns.
pub(crate) type Columns<const C: usize, const G: usize> = [Column<G>; C];

/// Scalar of one joint, or of a group of joints.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Returns the same value in all lanes.
    fn splat(x: f64) -> Self;

    /// Returns `self * factor + summand`, see [`FUSED`].
    fn multiply_add(self, factor: Self, summand: Self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }

    #[cfg(all(target_arch = "x86_64", target_feature = "fma"))]
    #[inline(always)]
    fn multiply_add(self, factor: f64, summand: f64) -> f64 {
        use safe_arch::{fused_mul_add_m128d_s, get_f64_from_m128d_s, set_m128d_s};
        get_f64_from_m128d_s(fused_mul_add_m128d_s(
            set_m128d_s(self),
            set_m128d_s(factor),
            set_m128d_s(summand),
        ))
    }

    #[cfg(not(all(target_arch = "x86_64", target_feature = "fma")))]
    #[inline(always)]
    fn multiply_add(self, factor: f64, summand: f64) -> f64 {
        self * factor + summand
    }
}

impl Number for Lanes {
    #[inline(always)]
    fn splat(x: f64) -> Lanes {
        Lanes::new([x; LANES])
    }

    #[inline(always)]
    fn multiply_add(self, factor: Lanes, summand: Lanes) -> Lanes {
        if FUSED {
            Lanes::mul_add(self, factor, summand)
        } else {
            self * factor + summand
        }
    }
}

/// Returns the same values for all joints of a group.
#[inline(always)]
pub(crate) fn splat<const K: usize>(x: [f64; K]) -> [Lanes; K] {
    let mut out = [Lanes::ZERO; K];
    for (out, x) in out.iter_mut().zip(x) {
        *out = Lanes::splat(x);
    }
    out
}

/// Calls a function of `<N, G>`, after other parameters `[..]` of its own, with the number of groups
/// that `N` joints need.
///
/// An array's length cannot be computed from `N` in stable Rust. The number of groups is a constant
/// for each `N`: the other arms are never instantiated. Beyond sixteen joints there are more groups
/// than needed.
macro_rules! in_groups {
    ($n:ident, $function:ident $([$($other:ident),*])? ($($argument:expr),* $(,)?)) => {
        $crate::math::lanes::in_groups!(@ $n, $function, [$($($other,)*)?], ($($argument),*))
    };
    (@ $n:ident, $function:ident, $other:tt, $arguments:tt) => {
        match const { $n.div_ceil($crate::math::lanes::LANES) } {
            1 => $crate::math::lanes::in_groups!(@call $function, $other, $n, 1, $arguments),
            2 => $crate::math::lanes::in_groups!(@call $function, $other, $n, 2, $arguments),
            3 => $crate::math::lanes::in_groups!(@call $function, $other, $n, 3, $arguments),
            4 => $crate::math::lanes::in_groups!(@call $function, $other, $n, 4, $arguments),
            _ => $crate::math::lanes::in_groups!(@call $function, $other, $n, $n, $arguments),
        }
    };
    (@call $function:ident, [$($other:ident,)*], $n:ident, $groups:tt, ($($argument:expr),*)) => {
        $function::<$($other,)* $n, $groups>($($argument),*)
    };
}
pub(crate) use in_groups;

/// Applies an expression to the quantities of each joint, one group at a time, and stores the
/// results by rows: `for_each_joint!(axis in &motions, body in &bodies => times(body, axis))`.
///
/// A macro, not a function with a closure: the compiler would not inline large closures.
macro_rules! for_each_joint {
    ($($quantities:pat in $rows:expr),+ => $found:expr) => {{
        let mut out = [[$crate::math::lanes::Lanes::ZERO; G]; _];
        for group in 0..G {
            $(let $quantities = $crate::math::lanes::load_group($rows, group);)+
            $crate::math::lanes::store_group(&mut out, group, $found);
        }
        out
    }};
}
pub(crate) use for_each_joint;

/// Stores the quantities of a group.
#[inline(always)]
pub(crate) fn store_group<const K: usize, const G: usize>(
    rows: &mut Rows<K, G>,
    group: usize,
    quantities: [Lanes; K],
) {
    for (row, x) in rows.iter_mut().zip(quantities) {
        row[group] = x;
    }
}

/// Returns the rows of quantities that are stored joint by joint: `of(k, joint)`.
#[inline(always)]
pub(crate) fn rows<const K: usize, const N: usize, const G: usize>(
    of: impl Fn(usize, usize) -> f64,
) -> Rows<K, G> {
    let mut out = [[Lanes::ZERO; G]; K];
    for (k, row) in out.iter_mut().enumerate() {
        for (group, x) in row.iter_mut().enumerate() {
            let mut lanes = [0.0; LANES];
            for (lane, number) in lanes.iter_mut().enumerate() {
                let joint = group * LANES + lane;
                if joint < N {
                    *number = of(k, joint);
                }
            }
            *x = Lanes::new(lanes);
        }
    }
    out
}

/// Returns the quantities of a group.
#[inline(always)]
pub(crate) fn load_group<const K: usize, const G: usize>(
    rows: &Rows<K, G>,
    group: usize,
) -> [Lanes; K] {
    let mut out = [Lanes::ZERO; K];
    for (out, row) in out.iter_mut().zip(rows) {
        *out = row[group];
    }
    out
}

/// Returns the quantities of joint `i`.
#[inline(always)]
pub(crate) fn joint_values<const K: usize, const G: usize>(
    rows: &Rows<K, G>,
    i: usize,
) -> [f64; K] {
    from_fn(|k| entry(&rows[k], i))
}

/// Returns the quantities of joint `i` in all lanes.
#[inline(always)]
pub(crate) fn broadcast_joint<const K: usize, const G: usize>(
    rows: &Rows<K, G>,
    i: usize,
) -> [Lanes; K] {
    let mut out = [Lanes::ZERO; K];
    for (out, row) in out.iter_mut().zip(rows) {
        *out = Lanes::splat(entry(row, i));
    }
    out
}

/// Returns the quantities of every joint, joint by joint.
#[inline(always)]
pub(crate) fn to_joint_arrays<const K: usize, const N: usize, const G: usize>(
    rows: &Rows<K, G>,
) -> [[f64; K]; N] {
    let mut out = [[0.0; K]; N];
    for (k, row) in rows.iter().enumerate() {
        for (out, x) in out.iter_mut().zip(per_joint::<N, G>(row)) {
            out[k] = x;
        }
    }
    out
}

/// Returns entry `i` of a column.
#[inline(always)]
pub(crate) fn entry<const G: usize>(column: &Column<G>, i: usize) -> f64 {
    column[i / LANES].as_array()[i % LANES]
}

/// Returns a column of `N` numbers, padded with zeros.
#[inline(always)]
pub(crate) fn column<const N: usize, const G: usize>(numbers: &[f64; N]) -> Column<G> {
    let [column] = rows::<1, N, G>(|_, i| numbers[i]);
    column
}

/// Returns the columns of a matrix, each padded with zeros.
#[inline(always)]
pub(crate) fn columns<const R: usize, const C: usize, const G: usize>(
    m: &Matrix<R, C>,
) -> Columns<C, G> {
    // Not `map`, which the compiler does not always inline.
    let mut columns = [[Lanes::ZERO; G]; C];
    for (to, from) in columns.iter_mut().zip(&m.data.0) {
        *to = column(from);
    }
    columns
}

/// Returns `s x`, entry by entry.
#[inline(always)]
pub(crate) fn scaled<const K: usize>(x: [Lanes; K], s: Lanes) -> [Lanes; K] {
    let mut out = x;
    for x in &mut out {
        *x *= s;
    }
    out
}

/// Returns one row as an array with one number per joint.
#[inline(always)]
pub(crate) fn per_joint<const N: usize, const G: usize>(row: &[Lanes; G]) -> [f64; N] {
    from_fn(|i| entry(row, i))
}

/// Returns the sum over the joints.
#[inline(always)]
pub(crate) fn total<const G: usize>(row: &Column<G>) -> f64 {
    let mut sum = row[0];
    for x in &row[1..] {
        sum += *x;
    }
    let [a, b, c, d] = sum.to_array();
    (a + b) + (c + d)
}

/// Additive identity in floating point (-0.0): `x + -0.0 == x` bit for bit, so the compiler removes
/// the addition; with `+0.0` it may not, as `-0.0 + 0.0` is `+0.0`.
pub(crate) const NEGATIVE_ZERO: f64 = -0.0;

/// Prefix sums over the joints, starting from `start`.
#[inline(always)]
pub(crate) fn prefix_sums<const K: usize, const G: usize>(
    start: [f64; K],
    mut terms: Rows<K, G>,
) -> Rows<K, G> {
    for (row, start) in terms.iter_mut().zip(start) {
        let mut before = Lanes::splat(start);
        for x in row.iter_mut() {
            let [a, b, c, _] = x.to_array();
            let pairs = *x + Lanes::new([0.0, a, b, c]);
            let [a, b, ..] = pairs.to_array();
            *x = pairs + Lanes::new([0.0, 0.0, a, b]) + before;
            before = Lanes::splat(x.to_array()[LANES - 1]);
        }
    }
    terms
}

/// Returns the suffix sums over the joints.
#[inline(always)]
pub(crate) fn suffix_sums<const K: usize, const G: usize>(mut terms: Rows<K, G>) -> Rows<K, G> {
    for row in &mut terms {
        let mut beyond = Lanes::splat(NEGATIVE_ZERO);
        for x in row.iter_mut().rev() {
            let [_, b, c, d] = x.to_array();
            let pairs = *x + Lanes::new([b, c, d, 0.0]);
            let [.., c, d] = pairs.to_array();
            *x = pairs + Lanes::new([c, d, 0.0, 0.0]) + beyond;
            beyond = Lanes::splat(x.to_array()[0]);
        }
    }
    terms
}
