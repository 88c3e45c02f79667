//! Rotations of the links against their parents, in one matrix for each joint.

use crate::math::lanes::{in_groups, joint_values};
use crate::math::{Matrix3, Vector};
use crate::model::arm::Arm;

/// Returns the rotation of joint frame `i` in its parent's joint frame, for every joint.
#[cfg_attr(not(debug_assertions), inline)]
pub(super) fn parent_rotations<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> [Matrix3<f64>; N] {
    in_groups!(N, rotations(arm, q))
}

#[cfg_attr(not(debug_assertions), inline)]
pub(super) fn rotations<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
) -> [Matrix3<f64>; N] {
    let rows = super::chain::parent_rotations::<N, G>(arm, q);
    core::array::from_fn(|i| Matrix3::from_column_slice(&joint_values(&rows, i)))
}
