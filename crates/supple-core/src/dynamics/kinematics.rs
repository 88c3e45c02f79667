//! Where the arm is and how it moves: poses, Jacobian, velocity-product acceleration.

use crate::arm::Arm;
use crate::math::{Matrix, Vector, Vector3};
use crate::pose::Pose;

/// Pose of every joint frame in the base, `base_from_joint`. `q` \[rad\].
pub fn joint_poses<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> [Pose; N] {
    let mut pose = Pose::IDENTITY;
    core::array::from_fn(|i| {
        pose = pose * arm.parent_from_joint_at(i, q[i]);
        pose
    })
}

/// Pose of the tip in the base, `base_from_tip`. `q` \[rad\].
pub fn tip_pose<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Pose {
    let poses = joint_poses(arm, q);
    poses[N - 1] * arm.joint_from_tip
}

/// Geometric Jacobian of the tip: linear rows first, then angular, base axes. Eq. (3.5).
pub fn jacobian<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<6, N> {
    let poses = joint_poses(arm, q);
    let tip = poses[N - 1].transform_point(&arm.joint_from_tip.translation);
    jacobian_of(&poses, &tip)
}

#[inline]
pub(super) fn jacobian_of<const N: usize>(poses: &[Pose; N], tip: &Vector3<f64>) -> Matrix<6, N> {
    let mut jacobian = Matrix::<6, N>::zeros();
    for (i, pose) in poses.iter().enumerate() {
        let axis = pose.rotation.column(2).into_owned();
        let linear = axis.cross(&(tip - pose.translation));
        jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&linear);
        jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis);
    }
    jacobian
}

/// `J' qd`: classical acceleration of the tip at `qdd = 0` \[m/s^2, rad/s^2\], base axes.
pub fn jacobian_dot_qd<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Vector<6> {
    let poses = joint_poses(arm, q);
    let tip = poses[N - 1].transform_point(&arm.joint_from_tip.translation);
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = Vector3::zeros();
    for i in 0..N {
        let axis = poses[i].rotation.column(2).into_owned() * qd[i];
        alpha += omega.cross(&axis);
        omega += axis;
        let next = if i + 1 < N {
            poses[i + 1].translation
        } else {
            tip
        };
        let arm_to_next = next - poses[i].translation;
        accel += alpha.cross(&arm_to_next) + omega.cross(&omega.cross(&arm_to_next));
    }
    Vector::<6>::new(accel.x, accel.y, accel.z, alpha.x, alpha.y, alpha.z)
}
