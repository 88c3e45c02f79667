//! The same function for every joint, four joints in one instruction.
//!
//! What is known of each joint is kept by rows: a row for each quantity, in groups of [`LANES`] joints, the
//! last group filled up with zeros. A function of one joint is applied to a group at a time. `wide` has
//! the vector types: a processor without vector instructions gets the same results, to the bit.

use core::array::from_fn;
use core::ops::{Add, Mul, Neg, Sub};
pub(crate) use wide::f64x4 as Lanes;

/// Joints in a group.
pub(crate) const LANES: usize = 4;

/// `K` quantities of each joint, in `G` groups.
pub(crate) type Rows<const K: usize, const G: usize> = [[Lanes; G]; K];

/// A number of one joint, or of a group.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// The same number for all.
    fn splat(x: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }
}

impl Number for Lanes {
    #[inline(always)]
    fn splat(x: f64) -> Lanes {
        Lanes::new([x; LANES])
    }
}

/// The same numbers for all joints of a group.
#[inline(always)]
pub(crate) fn splat<const K: usize>(x: [f64; K]) -> [Lanes; K] {
    x.map(Number::splat)
}

/// Calls a function of `<N, G>` with the number of groups that `N` joints need.
///
/// An array's length cannot be computed from `N`. The number is a constant of each `N`: the other arms are
/// never instantiated. Beyond sixteen joints there are more groups than needed.
macro_rules! in_groups {
    ($n:ident, $function:ident($($argument:expr),* $(,)?)) => {
        match const { $n.div_ceil($crate::lanes::LANES) } {
            1 => $function::<$n, 1>($($argument),*),
            2 => $function::<$n, 2>($($argument),*),
            3 => $function::<$n, 3>($($argument),*),
            4 => $function::<$n, 4>($($argument),*),
            _ => $function::<$n, $n>($($argument),*),
        }
    };
}
pub(crate) use in_groups;

/// Applies `body` to every joint: to its quantities of `a`, of `b` and of `c`.
#[inline(always)]
pub(crate) fn for_each_joint<
    const A: usize,
    const B: usize,
    const C: usize,
    const OUT: usize,
    const G: usize,
>(
    a: &Rows<A, G>,
    b: &Rows<B, G>,
    c: &Rows<C, G>,
    body: impl Fn([Lanes; A], [Lanes; B], [Lanes; C]) -> [Lanes; OUT],
) -> Rows<OUT, G> {
    let mut out = [[Lanes::ZERO; G]; OUT];
    for group in 0..G {
        let result = body(
            from_fn(|k| a[k][group]),
            from_fn(|k| b[k][group]),
            from_fn(|k| c[k][group]),
        );
        for (row, lanes) in out.iter_mut().zip(result) {
            row[group] = lanes;
        }
    }
    out
}

/// Quantities that are kept joint by joint, by rows: `of(k, joint)`.
#[inline(always)]
pub(crate) fn rows<const K: usize, const N: usize, const G: usize>(
    of: impl Fn(usize, usize) -> f64,
) -> Rows<K, G> {
    from_fn(|k| {
        from_fn(|group| {
            Lanes::new(from_fn(|lane| {
                let joint = group * LANES + lane;
                if joint < N { of(k, joint) } else { 0.0 }
            }))
        })
    })
}

/// The quantities of joint `i`.
#[inline(always)]
pub(crate) fn of_joint<const K: usize, const G: usize>(rows: &Rows<K, G>, i: usize) -> [f64; K] {
    from_fn(|k| rows[k][i / LANES].as_array()[i % LANES])
}

/// One row, a number for each joint.
#[inline(always)]
pub(crate) fn per_joint<const N: usize, const G: usize>(row: &[Lanes; G]) -> [f64; N] {
    from_fn(|i| row[i / LANES].as_array()[i % LANES])
}

/// Of each joint, the sum of `start` and of the terms of the joints up to it.
#[inline(always)]
pub(crate) fn sums_outward<const K: usize, const G: usize>(
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

/// Of each joint, the sum of the terms from it on.
#[inline(always)]
pub(crate) fn sums_inward<const K: usize, const G: usize>(mut terms: Rows<K, G>) -> Rows<K, G> {
    for row in &mut terms {
        let mut beyond = Lanes::ZERO;
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
