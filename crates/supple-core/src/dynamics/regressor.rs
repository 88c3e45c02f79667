//! The torques as a linear function of the inertial parameters.
//!
//! Ten numbers a link, in its *link frame* (the one of the description): mass, first moments
//! `m cx, m cy, m cz`, and inertia about the frame's origin `Ixx, Ixy, Iyy, Ixz, Iyz, Izz`.
//!
//! The row of joint `i` for link `k` is the power that the link's inertial wrench takes where joint `i`
//! turns at unit rate: with `(e, v)` the twist of that motion, and `w`, `alpha`, `a` those of the link,
//!
//! ```text
//! v . a m  +  (v x alpha + (v x w) x w + a x e) . h  +  e . I alpha + (e x w) . I w
//! ```
//!
//! so that six numbers go out along the chain for each joint, in place of the sixty of a link's wrench
//! that would come back. All in axes of the link frame.

use super::parent_rotations;
use crate::arm::Arm;
use crate::math::{Matrix, Vector, Vector3};

/// Joint-torque regressor, a block of ten columns a link \[N x 10 each\]:
/// `rnea = sum_k Y_k p_k + armature qdd`, with `p_k` as [`parameters`] orders them.
pub fn regressor<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> [Matrix<N, 10>; N] {
    let mut blocks = [Matrix::<N, 10>::zeros(); N];
    regressor_rows(arm, q, qd, qdd, |joint, link, row| {
        for (column, value) in row.iter().enumerate() {
            blocks[link][(joint, column)] = *value;
        }
    });
    blocks
}

/// As [`regressor`], row by row: `put(joint, link, row)` for every joint and every link that it moves.
/// The other rows are zero.
#[inline]
pub fn regressor_rows<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
    mut put: impl FnMut(usize, usize, [f64; 10]),
) {
    let rotations = parent_rotations(arm, q);
    let mut twists = [Twist::ZERO; N];
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = -arm.gravity;
    for k in 0..N {
        let link = &arm.links[k];
        let mut parent_from_link = rotations[k] * link.link_from_joint.transpose();
        let mut origin = link.parent_from_joint.translation;
        if k > 0 {
            let parent = &arm.links[k - 1].link_from_joint;
            parent_from_link = parent * parent_from_link;
            origin = parent * origin;
        }
        let axis = link.link_from_joint.column(2).into_owned();
        accel += alpha.cross(&origin) + omega.cross(&omega.cross(&origin));
        accel = parent_from_link.tr_mul(&accel);
        omega = parent_from_link.tr_mul(&omega);
        alpha = parent_from_link.tr_mul(&alpha) + omega.cross(&axis) * qd[k] + axis * qdd[k];
        omega += axis * qd[k];
        for twist in &mut twists[..k] {
            twist.linear += twist.angular.cross(&origin);
            twist.linear = parent_from_link.tr_mul(&twist.linear);
            twist.angular = parent_from_link.tr_mul(&twist.angular);
        }
        twists[k].angular = axis;
        for (joint, twist) in twists[..=k].iter().enumerate() {
            put(joint, k, twist.power(&omega, &alpha, &accel));
        }
    }
}

/// Motion of a link where one joint turns at unit rate.
#[derive(Clone, Copy)]
struct Twist {
    angular: Vector3<f64>,
    linear: Vector3<f64>,
}

impl Twist {
    const ZERO: Twist = Twist {
        angular: Vector3::new(0.0, 0.0, 0.0),
        linear: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Power on the wrench of a link that moves so, as a function of its ten parameters.
    #[inline]
    fn power(&self, w: &Vector3<f64>, alpha: &Vector3<f64>, accel: &Vector3<f64>) -> [f64; 10] {
        let (e, v) = (&self.angular, &self.linear);
        let h = v.cross(alpha) + v.cross(w).cross(w) + accel.cross(e);
        let u = e.cross(w);
        [
            v.dot(accel),
            h.x,
            h.y,
            h.z,
            e.x * alpha.x + u.x * w.x,
            e.x * alpha.y + e.y * alpha.x + u.x * w.y + u.y * w.x,
            e.y * alpha.y + u.y * w.y,
            e.x * alpha.z + e.z * alpha.x + u.x * w.z + u.z * w.x,
            e.y * alpha.z + e.z * alpha.y + u.y * w.z + u.z * w.y,
            e.z * alpha.z + u.z * w.z,
        ]
    }
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
