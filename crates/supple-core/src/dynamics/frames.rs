//! Joint motions and links in base axes about one point.
//!
//! In base axes about one point, velocities and forces need no transformation along the chain: they
//! are plain sums. The point is the tip or the last joint, not the base, because the light bodies
//! of the wrist are near it: about the base their inertias would lose precision to the `m r^2` of
//! their distance.

use super::chain::Chain;
use super::inertia::in_base;
use crate::math::Matrix;
use crate::math::lanes::{Rows, for_each_joint, joint_values, splat};
use crate::math::vec3::{V3, cross, join, sub};
use crate::model::arm::Arm;

/// Returns the velocity of a point for unit speed of each joint, linear then angular: for the tip, the columns
/// of the Jacobian.
#[inline(always)]
pub(super) fn joint_motions<const G: usize>(chain: &Chain<G>, point: V3) -> Rows<6, G> {
    let point = splat(point);
    for_each_joint!(r in &chain.rotations, origin in &chain.origins => {
        let axis = [r[6], r[7], r[8]];
        join(cross(axis, sub(point, origin)), axis)
    })
}

/// Returns the links in base axes about a point.
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

/// Returns a matrix with a column for each joint.
#[inline(always)]
pub(super) fn matrix<const K: usize, const N: usize, const G: usize>(
    rows: &Rows<K, G>,
) -> Matrix<K, N> {
    let mut m = Matrix::zeros();
    for (i, column) in m.data.0.iter_mut().enumerate() {
        *column = joint_values(rows, i);
    }
    m
}
