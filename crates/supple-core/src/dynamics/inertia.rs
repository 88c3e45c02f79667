//! Rigid bodies in base axes about one common point: adding bodies is adding their parameters.
//!
//! Ten numbers: mass, first moment `h`, inertia about the point `xx, xy, yy, xz, yz, zz`. Motions
//! and forces are pairs of vectors, linear before angular, of the body's point that coincides with
//! the reference point.

use crate::math::lanes::Number;
use crate::math::vec3::{V3, add_cross, add_scaled, cross, dot, halves, join, rotate, scale};

/// Returns a body of a joint frame `rotation` (by columns), whose origin is at `r` from the reference point.
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
    let row = |i: usize, j: usize| {
        dot(
            [a[i], b[i], c[i]],
            [rotation[j], rotation[3 + j], rotation[6 + j]],
        )
    };
    // Shifted by r: 2 (r . s) 1 - r s^T - s r^T with s = h + m r / 2.
    let s = add_scaled(moment, r, T::splat(0.5) * mass);
    let (x, y, z) = (r[0] * s[0], r[1] * s[1], r[2] * s[2]);
    let shifted = add_scaled(moment, r, mass);
    let two = T::splat(2.0);
    let product =
        |i: usize, j: usize| (-r[i]).multiply_add(s[j], (-r[j]).multiply_add(s[i], row(i, j)));
    [
        mass,
        shifted[0],
        shifted[1],
        shifted[2],
        two.multiply_add(y + z, row(0, 0)),
        product(1, 0),
        two.multiply_add(x + z, row(1, 1)),
        product(2, 0),
        product(2, 1),
        two.multiply_add(x + y, row(2, 2)),
    ]
}

/// Returns the momentum of the body for a velocity, or force on it for an acceleration.
#[inline(always)]
pub(super) fn times<T: Number>(body: [T; 10], motion: [T; 6]) -> [T; 6] {
    let (linear, angular) = halves(motion);
    let moment = [body[1], body[2], body[3]];
    let inertia = [body[4], body[5], body[6], body[7], body[8], body[9]];
    join(
        add_cross(scale(linear, body[0]), angular, moment),
        add_cross(inertia_times(inertia, angular), moment, linear),
    )
}

/// Returns `I w`, with `I` as `xx, xy, yy, xz, yz, zz`.
#[inline(always)]
pub(super) fn inertia_times<T: Number>([xx, xy, yy, xz, yz, zz]: [T; 6], w: V3<T>) -> V3<T> {
    [
        dot([xx, xy, xz], w),
        dot([xy, yy, yz], w),
        dot([xz, yz, zz], w),
    ]
}

/// Returns the rate of change of a motion that is fixed in a body of velocity `twist`.
#[inline(always)]
pub(super) fn cross_motion<T: Number>(twist: [T; 6], motion: [T; 6]) -> [T; 6] {
    let ((v, w), (linear, angular)) = (halves(twist), halves(motion));
    join(add_cross(cross(w, linear), v, angular), cross(w, angular))
}

/// Returns the rate of change of a momentum that is fixed in a body of velocity `twist`.
#[inline(always)]
pub(super) fn cross_force<T: Number>(twist: [T; 6], force: [T; 6]) -> [T; 6] {
    let ((v, w), (linear, angular)) = (halves(twist), halves(force));
    join(cross(w, linear), add_cross(cross(w, angular), v, linear))
}

/// Returns the torque about an axis that holds the body against gravity, `-S . (m g, h x g)`.
#[inline(always)]
pub(super) fn gravity_torque_about<T: Number>(axis: [T; 6], body: [T; 10], gravity: V3<T>) -> T {
    let (linear, angular) = halves(axis);
    let moment = cross([body[1], body[2], body[3]], gravity);
    -(dot(linear, scale(gravity, body[0])) + dot(angular, moment))
}

/// Returns the gradient of that torque by gravity \[kg m\]: the torque is its product with gravity.
#[inline(always)]
pub(super) fn gravity_gradient_about<T: Number>(axis: [T; 6], body: [T; 10]) -> V3<T> {
    let (linear, angular) = halves(axis);
    let moment = [body[1], body[2], body[3]];
    let lever = scale(linear, -body[0]);
    add_cross(lever, moment, angular)
}
