//! Vectors and rotations as plain arrays, for one joint or for a group of joints
//! ([`crate::math::lanes`]). Rotations and pairs of vectors are flat arrays in column-major order.

use crate::math::lanes::Number;

pub(crate) type V3<T = f64> = [T; 3];

#[inline(always)]
pub(crate) fn add<T: Number>(a: V3<T>, b: V3<T>) -> V3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<T: Number>(a: V3<T>, b: V3<T>) -> V3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale<T: Number>(a: V3<T>, s: T) -> V3<T> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
pub(crate) fn dot<T: Number>(a: V3<T>, b: V3<T>) -> T {
    a[2].multiply_add(b[2], a[1].multiply_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(crate) fn cross<T: Number>(a: V3<T>, b: V3<T>) -> V3<T> {
    [
        a[1].multiply_add(b[2], -(a[2] * b[1])),
        a[2].multiply_add(b[0], -(a[0] * b[2])),
        a[0].multiply_add(b[1], -(a[1] * b[0])),
    ]
}

/// Returns `c + s v`.
#[inline(always)]
pub(crate) fn add_scaled<T: Number>(c: V3<T>, v: V3<T>, s: T) -> V3<T> {
    [
        v[0].multiply_add(s, c[0]),
        v[1].multiply_add(s, c[1]),
        v[2].multiply_add(s, c[2]),
    ]
}

/// Returns `c + a x b`.
#[inline(always)]
pub(crate) fn add_cross<T: Number>(c: V3<T>, a: V3<T>, b: V3<T>) -> V3<T> {
    [
        a[1].multiply_add(b[2], (-a[2]).multiply_add(b[1], c[0])),
        a[2].multiply_add(b[0], (-a[0]).multiply_add(b[2], c[1])),
        a[0].multiply_add(b[1], (-a[1]).multiply_add(b[0], c[2])),
    ]
}

/// Returns `c + R v`.
#[inline(always)]
pub(crate) fn add_rotated<T: Number>(c: V3<T>, r: &[T; 9], v: V3<T>) -> V3<T> {
    add_scaled(
        add_scaled(
            add_scaled(c, [r[0], r[1], r[2]], v[0]),
            [r[3], r[4], r[5]],
            v[1],
        ),
        [r[6], r[7], r[8]],
        v[2],
    )
}

/// Returns `R v`.
#[inline(always)]
pub(crate) fn rotate<T: Number>(r: &[T; 9], v: V3<T>) -> V3<T> {
    [
        r[6].multiply_add(v[2], r[3].multiply_add(v[1], r[0] * v[0])),
        r[7].multiply_add(v[2], r[4].multiply_add(v[1], r[1] * v[0])),
        r[8].multiply_add(v[2], r[5].multiply_add(v[1], r[2] * v[0])),
    ]
}

/// Returns `R^T v`.
#[inline(always)]
pub(crate) fn rotate_back<T: Number>(r: &[T; 9], v: V3<T>) -> V3<T> {
    [
        dot([r[0], r[1], r[2]], v),
        dot([r[3], r[4], r[5]], v),
        dot([r[6], r[7], r[8]], v),
    ]
}

/// Returns `A B` of two rotations.
#[inline(always)]
pub(crate) fn product<T: Number>(a: &[T; 9], b: &[T; 9]) -> [T; 9] {
    join3(
        rotate(a, [b[0], b[1], b[2]]),
        rotate(a, [b[3], b[4], b[5]]),
        rotate(a, [b[6], b[7], b[8]]),
    )
}

/// Returns `R^T`.
#[inline(always)]
pub(crate) fn transposed<T: Number>(r: &[T; 9]) -> [T; 9] {
    [r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]]
}

#[inline(always)]
pub(crate) fn join<T: Number>(a: V3<T>, b: V3<T>) -> [T; 6] {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

#[inline(always)]
pub(crate) fn join3<T: Number>(a: V3<T>, b: V3<T>, c: V3<T>) -> [T; 9] {
    [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
}

/// Returns the linear and the angular part.
#[inline(always)]
pub(crate) fn halves<T: Number>(x: [T; 6]) -> (V3<T>, V3<T>) {
    ([x[0], x[1], x[2]], [x[3], x[4], x[5]])
}

/// Returns the dot product of a pair of vectors with another.
#[inline(always)]
pub(crate) fn dot6<T: Number>(a: [T; 6], b: [T; 6]) -> T {
    let ((a, c), (b, d)) = (halves(a), halves(b));
    dot(a, b) + dot(c, d)
}
