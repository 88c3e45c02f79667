//! The torques as a linear function of the inertial parameters.
//!
//! Ten numbers a link, in its *link frame* (the one of the description): mass, first moments
//! `m cx, m cy, m cz`, and inertia about the frame's origin `Ixx, Ixy, Iyy, Ixz, Iyz, Izz`.

use super::parent_rotations;
use crate::arm::Arm;
use crate::math::{Matrix, Vector, Vector3, skew};

/// Joint-torque regressor, a block of ten columns a link \[N x 10 each\]:
/// `rnea = sum_k Y_k p_k + armature qdd`, with `p_k` as [`parameters`] orders them.
pub fn regressor<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> [Matrix<N, 10>; N] {
    let rotations = parent_rotations(arm, q);
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = -arm.gravity;
    core::array::from_fn(|k| {
        let link = &arm.links[k];
        let origin = &link.parent_from_joint.translation;
        accel += alpha.cross(origin) + omega.cross(&omega.cross(origin));
        accel = rotations[k].tr_mul(&accel);
        omega = rotations[k].tr_mul(&omega);
        alpha = rotations[k].tr_mul(&alpha);
        alpha += Vector3::new(omega.y * qd[k], -omega.x * qd[k], qdd[k]);
        omega.z += qd[k];

        let to_link = &link.link_from_joint;
        let (moment, force) =
            body_columns(&(to_link * omega), &(to_link * alpha), &(to_link * accel));
        let mut moment = to_link.tr_mul(&moment);
        let mut force = to_link.tr_mul(&force);
        let mut block = Matrix::<N, 10>::zeros();
        for i in (0..=k).rev() {
            block.row_mut(i).copy_from(&moment.row(2));
            if i > 0 {
                let origin = &arm.links[i].parent_from_joint.translation;
                force = rotations[i] * force;
                moment = rotations[i] * moment + skew(origin) * force;
            }
        }
        block
    })
}

/// Moment about the origin and force on one link, as functions of its ten parameters.
fn body_columns(
    w: &Vector3<f64>,
    alpha: &Vector3<f64>,
    accel: &Vector3<f64>,
) -> (Matrix<3, 10>, Matrix<3, 10>) {
    let mut moment = Matrix::<3, 10>::zeros();
    let mut force = Matrix::<3, 10>::zeros();
    force.column_mut(0).copy_from(accel);
    let spin = skew(alpha) + skew(w) * skew(w);
    force.fixed_view_mut::<3, 3>(0, 1).copy_from(&spin);
    moment.fixed_view_mut::<3, 3>(0, 1).copy_from(&-skew(accel));
    let a = inertia_columns(alpha);
    let gyroscopic = skew(w) * inertia_columns(w);
    moment
        .fixed_view_mut::<3, 6>(0, 4)
        .copy_from(&(a + gyroscopic));
    (moment, force)
}

/// `I v` as a function of `(Ixx, Ixy, Iyy, Ixz, Iyz, Izz)`.
fn inertia_columns(v: &Vector3<f64>) -> Matrix<3, 6> {
    #[rustfmt::skip]
    let columns = Matrix::<3, 6>::from_row_slice(&[
        v.x, v.y, 0.0, v.z, 0.0, 0.0,
        0.0, v.x, v.y, 0.0, v.z, 0.0,
        0.0, 0.0, 0.0, v.x, v.y, v.z,
    ]);
    columns
}

/// Inertial parameters of every link, ten each, in its link frame; the last link with the tool.
pub fn parameters<const N: usize>(arm: &Arm<N>) -> [Vector<10>; N] {
    core::array::from_fn(|k| {
        let link = &arm.links[k];
        let r = &link.link_from_joint;
        let h = r * link.first_moment;
        let i = r * link.inertia * r.transpose();
        Vector::<10>::from_column_slice(&[
            link.mass,
            h.x,
            h.y,
            h.z,
            i[(0, 0)],
            i[(0, 1)],
            i[(1, 1)],
            i[(0, 2)],
            i[(1, 2)],
            i[(2, 2)],
        ])
    })
}
