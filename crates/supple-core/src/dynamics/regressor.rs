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
//! so that each joint's twist is brought to the link, in place of the link's sixty numbers to each joint.
//! All in axes of the link frame.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::body_motion::body_motions;
use super::chain::{Chain, parent_rotations};
use super::vec3::{V3, add, cross, dot, product, rotate_back, sub, transposed};
use crate::arm::Arm;
use crate::lanes::{Number, for_each_joint, in_groups, per_joint, splat};
use crate::math::{Matrix, Vector};

/// Joint-torque regressor, a block of ten columns a link \[N x 10 each\]:
/// `rnea = sum_k Y_k p_k + armature qdd`, with `p_k` as [`parameters`] orders them.
#[inline]
pub fn regressor<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> [Matrix<N, 10>; N] {
    let mut blocks = [Matrix::<N, 10>::zeros(); N];
    let put = |link: usize, columns: &[[f64; N]; 10]| {
        for (column, found) in blocks[link].data.0.iter_mut().zip(columns) {
            column[..=link].copy_from_slice(&found[..=link]);
        }
    };
    in_groups!(N, columns(arm, q, qd, qdd, put));
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
    let by_rows = |link: usize, columns: &[[f64; N]; 10]| {
        for joint in 0..=link {
            put(joint, link, columns.map(|column| column[joint]));
        }
    };
    in_groups!(N, columns(arm, q, qd, qdd, by_rows));
}

/// The columns of every link, right for the joints up to it: `put(link, columns)`.
#[inline]
fn columns<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
    mut put: impl FnMut(usize, &[[f64; N]; 10]),
) {
    let chain = Chain::<G>::new(arm, q);
    let motions = body_motions(arm, &parent_rotations::<N, G>(arm, q), qd, qdd);
    for link in 0..N {
        let frame = chain.frame(link);
        let mut link_from_joint = [0.0; 9];
        link_from_joint.copy_from_slice(arm.links[link].link_from_joint.as_slice());
        let joint_from_link = transposed(&link_from_joint);
        let base_from_link = product(&frame.rotation, &joint_from_link);
        let motion = &motions[link];
        let [w, alpha, accel] = [motion.spin, motion.rate, motion.accel]
            .map(|v| splat(rotate_back(&joint_from_link, v)));
        let (base_from_link, here) = (splat(base_from_link), splat(frame.origin));
        let rows = for_each_joint(&chain.rotations, &chain.origins, &[], |r, origin, []| {
            let axis = [r[6], r[7], r[8]];
            let linear = cross(axis, sub(here, origin));
            let e = rotate_back(&base_from_link, axis);
            let v = rotate_back(&base_from_link, linear);
            power(e, v, w, alpha, accel)
        });
        put(link, &rows.map(|row| per_joint(&row)));
    }
}

/// Power of the twist `(e, v)` on the wrench of a link, as a function of the link's ten parameters.
#[inline(always)]
fn power<T: Number>(e: V3<T>, v: V3<T>, w: V3<T>, alpha: V3<T>, accel: V3<T>) -> [T; 10] {
    let h = add(add(cross(v, alpha), cross(cross(v, w), w)), cross(accel, e));
    let u = cross(e, w);
    [
        dot(v, accel),
        h[0],
        h[1],
        h[2],
        e[0] * alpha[0] + u[0] * w[0],
        e[0] * alpha[1] + e[1] * alpha[0] + u[0] * w[1] + u[1] * w[0],
        e[1] * alpha[1] + u[1] * w[1],
        e[0] * alpha[2] + e[2] * alpha[0] + u[0] * w[2] + u[2] * w[0],
        e[1] * alpha[2] + e[2] * alpha[1] + u[1] * w[2] + u[2] * w[1],
        e[2] * alpha[2] + u[2] * w[2],
    ]
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
