//! Joints and links in base axes about one point.
//!
//! There neither velocities nor forces have to be turned on their way along the arm: they are sums. The point
//! is the tip or the last joint, not the base, because the light bodies of the wrist are near it: about the base
//! their inertias would vanish in their own distance.

use super::chain::Chain;
use super::inertia::in_base;
use crate::arm::Arm;
use crate::lanes::{Rows, for_each_joint, of_joint, splat};
use crate::math::Matrix;
use crate::vec3::{V3, cross, join, sub};

/// What each joint's unit speed gives a point, linear then angular: of the tip, the Jacobian's columns.
#[inline(always)]
pub(super) fn joint_motions<const G: usize>(chain: &Chain<G>, point: V3) -> Rows<6, G> {
    let point = splat(point);
    for_each_joint!(r in &chain.rotations, origin in &chain.origins => {
        let axis = [r[6], r[7], r[8]];
        join(cross(axis, sub(point, origin)), axis)
    })
}

/// The links in base axes about a point.
#[inline(always)]
pub(super) fn bodies<const N: usize, const G: usize>(
    arm: &Arm<N>,
    chain: &Chain<G>,
    point: V3,
) -> Rows<10, G> {
    let (point, links) = (splat(point), arm.rows.bodies::<G>());
    for_each_joint!(
        body in &links, r in &chain.rotations, origin in &chain.origins
        => in_base(body, &r, sub(origin, point))
    )
}

/// A matrix with a column for each joint.
#[inline(always)]
pub(super) fn matrix<const K: usize, const N: usize, const G: usize>(
    rows: &Rows<K, G>,
) -> Matrix<K, N> {
    let mut m = Matrix::zeros();
    for (i, column) in m.data.0.iter_mut().enumerate() {
        *column = of_joint(rows, i);
    }
    m
}
