//! Kinematics: poses, Jacobian, velocity-product acceleration.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::chain::Chain;
use super::frames::{joint_motions, matrix};
use crate::math::lanes::in_groups;
use crate::math::vec3::{add, add_cross, cross, scale, sub};
use crate::math::{Matrix, Vector};
use crate::model::arm::Arm;
use crate::model::pose::Pose;

/// Returns the pose of every joint frame in the base, `base_from_joint`. `q` \[rad\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn joint_poses<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> [Pose; N] {
    in_groups!(N, poses(arm, q))
}

#[cfg_attr(not(debug_assertions), inline)]
fn poses<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> [Pose; N] {
    let chain = Chain::<G>::new(arm, q);
    core::array::from_fn(|i| chain.frame(i).pose())
}

/// Returns the pose of the tip in the base, `base_from_tip`. `q` \[rad\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn tip_pose<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Pose {
    in_groups!(N, tip(arm, q))
}

#[cfg_attr(not(debug_assertions), inline)]
fn tip<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Pose {
    Chain::<G>::new(arm, q).tip.pose()
}

/// Returns the geometric Jacobian of the tip: linear rows first, then angular, base axes. Eq. (3.5).
#[cfg_attr(not(debug_assertions), inline)]
pub fn jacobian<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<6, N> {
    in_groups!(N, columns(arm, q))
}

#[cfg_attr(not(debug_assertions), inline)]
fn columns<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<6, N> {
    let chain = Chain::<G>::new(arm, q);
    matrix(&joint_motions(&chain, chain.tip.origin))
}

/// Returns `J' qd`: classical acceleration of the tip at `qdd = 0` \[m/s^2, rad/s^2\], base axes.
#[cfg_attr(not(debug_assertions), inline)]
pub fn jacobian_dot_qd<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Vector<6> {
    in_groups!(N, bias_acceleration(arm, q, qd))
}

#[cfg_attr(not(debug_assertions), inline)]
fn bias_acceleration<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
) -> Vector<6> {
    let chain = Chain::<G>::new(arm, q);
    let (mut angular_velocity, mut angular_acceleration, mut accel) =
        ([0.0; 3], [0.0; 3], [0.0; 3]);
    for i in 0..N {
        let frame = chain.frame(i);
        let axis = scale(frame.axis(), qd[i]);
        angular_acceleration = add_cross(angular_acceleration, angular_velocity, axis);
        angular_velocity = add(angular_velocity, axis);
        let next = if i + 1 < N {
            chain.frame(i + 1)
        } else {
            chain.tip
        };
        let offset = sub(next.origin, frame.origin);
        accel = add_cross(
            add_cross(accel, angular_acceleration, offset),
            angular_velocity,
            cross(angular_velocity, offset),
        );
    }
    Vector::<6>::new(
        accel[0],
        accel[1],
        accel[2],
        angular_acceleration[0],
        angular_acceleration[1],
        angular_acceleration[2],
    )
}
