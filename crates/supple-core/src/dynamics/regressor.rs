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
use super::vec3::{
    V3, add_cross, cross, dot, join3, product, rotate, rotate_back, sub, transposed,
};
use crate::arm::Arm;
use crate::lanes::{
    LANES, Lanes, Number, for_each_joint, in_groups, of_joint, per_joint, rows, splat,
};
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
    let put = |link: usize, parameter: usize, column| blocks[link].data.0[parameter] = column;
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
    let mut of_link = [[0.0; 10]; N];
    let by_rows = |link: usize, parameter: usize, column: [f64; N]| {
        for (row, x) in of_link.iter_mut().zip(column) {
            row[parameter] = x;
        }
        if parameter == 9 {
            for (joint, row) in of_link.iter().enumerate().take(link + 1) {
                put(joint, link, *row);
            }
        }
    };
    in_groups!(N, columns(arm, q, qd, qdd, by_rows));
}

/// The columns of every link, one for each of its parameters: `put(link, parameter, column)`.
#[inline]
fn columns<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
    mut put: impl FnMut(usize, usize, [f64; N]),
) {
    let chain = Chain::<G>::new(arm, q);
    let motions = body_motions(arm, &parent_rotations::<N, G>(arm, q), qd, qdd);
    let places = rows::<1, N, G>(|_, i| i as f64)[0];
    let link_from_joint = arm.rows.links_from_joints::<G>();
    let base_from_link =
        for_each_joint(&chain.rotations, &link_from_joint, &[], |base, link, []| {
            product(&base, &transposed(&link))
        });
    let motions = rows::<9, N, G>(|k, i| {
        let motion = &motions[i];
        [motion.spin, motion.rate, motion.accel][k / 3][k % 3]
    });
    let motions = for_each_joint(&motions, &link_from_joint, &[], |motion, link, []| {
        let seen = |k: usize| rotate(&link, [motion[k], motion[k + 1], motion[k + 2]]);
        join3(seen(0), seen(3), seen(6))
    });
    for link in 0..N {
        let motion = splat(of_joint(&motions, link));
        let third = |k: usize| [motion[k], motion[k + 1], motion[k + 2]];
        let (w, alpha, accel) = (third(0), third(3), third(6));
        let base_from_link = splat(of_joint(&base_from_link, link));
        let here = splat(of_joint(&chain.origins, link));
        let mut found = [[Lanes::ZERO; G]; 10];
        for group in 0..=link / LANES {
            let (r, o) = (
                |k: usize| chain.rotations[k][group],
                |k: usize| chain.origins[k][group],
            );
            let axis = [r(6), r(7), r(8)];
            let origin = [o(0), o(1), o(2)];
            let linear = cross(axis, sub(here, origin));
            let e = rotate_back(&base_from_link, axis);
            let v = rotate_back(&base_from_link, linear);
            // Joints beyond the link do not move it.
            let moves = places[group].simd_le(Lanes::splat(link as f64));
            for (row, x) in found.iter_mut().zip(power(e, v, w, alpha, accel)) {
                row[group] = x & moves;
            }
        }
        for (parameter, row) in found.iter().enumerate() {
            put(link, parameter, per_joint(row));
        }
    }
}

/// Power of the twist `(e, v)` on the wrench of a link, as a function of the link's ten parameters.
#[inline(always)]
fn power<T: Number>(e: V3<T>, v: V3<T>, w: V3<T>, alpha: V3<T>, accel: V3<T>) -> [T; 10] {
    let h = add_cross(add_cross(cross(v, alpha), cross(v, w), w), accel, e);
    let u = cross(e, w);
    let square = |i: usize| e[i].times_plus(alpha[i], u[i] * w[i]);
    let mixed = |i: usize, j: usize| {
        let spun = u[i].times_plus(w[j], u[j] * w[i]);
        e[i].times_plus(alpha[j], e[j].times_plus(alpha[i], spun))
    };
    [
        dot(v, accel),
        h[0],
        h[1],
        h[2],
        square(0),
        mixed(0, 1),
        square(1),
        mixed(0, 2),
        mixed(1, 2),
        square(2),
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
