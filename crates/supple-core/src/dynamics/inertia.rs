//! Rigid bodies in base axes about one point, the same for all of them: adding two is adding their numbers.
//!
//! Ten numbers: mass, first moment `h`, inertia about the point `xx, xy, yy, xz, yz, zz`. Motions and
//! forces are pairs of vectors, linear before angular, of the body's point that is at the reference
//! point now.

use super::vec3::{V3, add, cross, dot, halves, join, rotate, scale};
use crate::lanes::Number;

/// A body of a joint frame `rotation` (by columns), whose origin is at `r` from the reference point.
#[inline(always)]
pub(super) fn in_base<T: Number>(body: [T; 10], rotation: &[T; 9], r: V3<T>) -> [T; 10] {
    let mass = body[0];
    let moment = rotate(rotation, [body[1], body[2], body[3]]);
    // The columns of R I, then the entries of R I R^T.
    let [xx, xy, yy, xz, yz, zz] = [body[4], body[5], body[6], body[7], body[8], body[9]];
    let (a, b, c) = (
        rotate(rotation, [xx, xy, xz]),
        rotate(rotation, [xy, yy, yz]),
        rotate(rotation, [xz, yz, zz]),
    );
    let entry =
        |i: usize, j: usize| a[i] * rotation[j] + b[i] * rotation[3 + j] + c[i] * rotation[6 + j];
    // Shifted by r: 2 (r . s) 1 - r s^T - s r^T with s = h + m r / 2.
    let s = add(moment, scale(r, T::splat(0.5) * mass));
    let (x, y, z) = (r[0] * s[0], r[1] * s[1], r[2] * s[2]);
    let shifted = add(moment, scale(r, mass));
    let two = T::splat(2.0);
    [
        mass,
        shifted[0],
        shifted[1],
        shifted[2],
        entry(0, 0) + two * (y + z),
        entry(1, 0) - (r[0] * s[1] + r[1] * s[0]),
        entry(1, 1) + two * (x + z),
        entry(2, 0) - (r[0] * s[2] + r[2] * s[0]),
        entry(2, 1) - (r[1] * s[2] + r[2] * s[1]),
        entry(2, 2) + two * (x + y),
    ]
}

/// Momentum of the body under a velocity; force on it under an acceleration.
#[inline(always)]
pub(super) fn times<T: Number>(body: [T; 10], motion: [T; 6]) -> [T; 6] {
    let (linear, angular) = halves(motion);
    let moment = [body[1], body[2], body[3]];
    let spun = [
        body[4] * angular[0] + body[5] * angular[1] + body[7] * angular[2],
        body[5] * angular[0] + body[6] * angular[1] + body[8] * angular[2],
        body[7] * angular[0] + body[8] * angular[1] + body[9] * angular[2],
    ];
    join(
        add(scale(linear, body[0]), cross(angular, moment)),
        add(spun, cross(moment, linear)),
    )
}

/// Rate of a motion that is fixed in a body of velocity `twist`.
#[inline(always)]
pub(super) fn cross_motion<T: Number>(twist: [T; 6], motion: [T; 6]) -> [T; 6] {
    let ((v, w), (linear, angular)) = (halves(twist), halves(motion));
    join(add(cross(w, linear), cross(v, angular)), cross(w, angular))
}

/// Rate of a momentum that is fixed in a body of velocity `twist`.
#[inline(always)]
pub(super) fn cross_force<T: Number>(twist: [T; 6], force: [T; 6]) -> [T; 6] {
    let ((v, w), (linear, angular)) = (halves(twist), halves(force));
    join(cross(w, linear), add(cross(w, angular), cross(v, linear)))
}

/// Torque about an axis through which the body falls: what holds it, `-S . (m g, h x g)`.
#[inline(always)]
pub(super) fn weight_on<T: Number>(axis: [T; 6], body: [T; 10], gravity: V3<T>) -> T {
    let (linear, angular) = halves(axis);
    let moment = cross([body[1], body[2], body[3]], gravity);
    -(dot(linear, scale(gravity, body[0])) + dot(angular, moment))
}
