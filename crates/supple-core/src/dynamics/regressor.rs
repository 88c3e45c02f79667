//! The torques as a linear function of the inertial parameters.
//!
//! Each link has ten numbers in its *link frame* (the frame of the description): mass, first moments
//! `m cx, m cy, m cz`, and inertia about the frame's origin `Ixx, Ixy, Iyy, Ixz, Iyz, Izz`.
//!
//! A link's force is linear in its ten numbers: each number has its own wrench, here in base axes
//! about the last joint. With `a` the acceleration of the link frame's origin, which is at `p`,
//! with `r_i` the frame's axes and `W = [alpha x] + [w x][w x]`, these are
//!
//! ```text
//!               force    moment
//! m             a        p x a
//! m c_i         W r_i    p x W r_i + r_i x a
//! I_ii          0        r_i alpha_i + w x r_i w_i
//! I_ij          0        r_i alpha_j + r_j alpha_i + w x (r_i w_j + r_j w_i)
//! ```
//!
//! The row of a joint is the power of these wrenches for unit speed of the joint. Wrenches are
//! computed for four links at once, then rows for four numbers at once.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::body_motion::acceleration_gradient;
use super::chain::Chain;
use super::frames::joint_motions;
use super::motion::Motion;
use crate::math::Vector;
use crate::math::lanes::{
    LANES, Lanes, in_groups, joint_values, load_group, splat, to_joint_arrays,
};
use crate::math::vec3::{
    V3, add_cross, add_scaled, cross, dot, halves, product, rotate, rotate_back, scale, sub,
    transposed,
};
use crate::model::arm::Arm;

/// `[i][k]` is the contribution of each of the ten numbers of link `k` to the torque of joint `i`;
/// zero if the link comes before the joint.
pub type Regressor<const N: usize> = [[Vector<10>; N]; N];

/// Returns the joint-torque regressor: `rnea = Y p + armature qdd`, with [`parameters`] `p` and [`regressor_times`] for
/// the product. `q` \[rad\], `qd` \[rad/s\], `qdd` \[rad/s^2\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn regressor<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> Regressor<N> {
    let mut whole = [[Vector::zeros(); N]; N];
    let put = |joint: usize, link: usize, row| whole[joint][link] = Vector::from(row);
    regressor_rows(arm, q, qd, qdd, put);
    whole
}

/// Computes [`regressor`] row by row: calls `put(joint, link, row)` for every joint and every link that
/// the joint moves.
#[cfg_attr(not(debug_assertions), inline)]
pub fn regressor_rows<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
    put: impl FnMut(usize, usize, [f64; 10]),
) {
    in_groups!(N, rows(arm, q, qd, qdd, put));
}

#[cfg_attr(not(debug_assertions), inline)]
fn rows<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
    mut put: impl FnMut(usize, usize, [f64; 10]),
) {
    let chain = Chain::<G>::new(arm, q);
    let point = joint_values(&chain.origins, N - 1);
    let motions = joint_motions(&chain, point);
    let motion = Motion::new(&motions, qd, arm.gravity.data.0[0]);
    let motion = motion.accelerated(&motions, &qdd.data.0[0]);
    let links_from_joints = arm.rows.links_from_joints::<G>();
    let motions = to_joint_arrays::<6, N, G>(&motions);
    for group in 0..G {
        let links = wrenches(&Links {
            axes: product(
                &load_group(&chain.rotations, group),
                &transposed(&load_group(&links_from_joints, group)),
            ),
            origin: sub(load_group(&chain.origins, group), splat(point)),
            twist: load_group(&motion.twists, group),
            acceleration: load_group(&motion.accelerations, group),
        });
        for link in group * LANES..N.min(group * LANES + LANES) {
            let lane = link - group * LANES;
            let of_link = |part: usize| {
                let [x, y, z] = &links[part];
                [x[lane], y[lane], z[lane]]
            };
            let (forces, moments) = (of_link(0), of_link(1));
            let (couples, more) = (of_link(2), of_link(3));
            for joint in 0..=link {
                let (linear, angular) = halves(splat(motions[joint]));
                let [m, cx, cy, cz] = (dot(linear, forces) + dot(angular, moments)).to_array();
                let [xx, xy, yy, xz] = dot(angular, couples).to_array();
                let [yz, zz, ..] = dot(angular, more).to_array();
                put(joint, link, [m, cx, cy, cz, xx, xy, yy, xz, yz, zz]);
            }
        }
    }
}

/// Motion of four links.
struct Links {
    axes: [Lanes; 9],
    origin: V3<Lanes>,
    twist: [Lanes; 6],
    /// Spatial acceleration: of the link's point that coincides with the reference point.
    acceleration: [Lanes; 6],
}

/// Wrenches of the ten numbers of four links: forces of the mass and the first moments, their
/// moments, then moments of the inertia, the last two padded with two unused values. Each by
/// components, then links.
type Wrenches = [V3<[Lanes; LANES]>; 4];

/// Wrenches of four links.
#[inline(always)]
fn wrenches(links: &Links) -> Wrenches {
    let ((velocity, w), (linear, alpha)) = (halves(links.twist), halves(links.acceleration));
    let p = links.origin;
    let accel = add_cross(linear, alpha, p);
    let accel = add_cross(accel, w, add_cross(velocity, w, p));
    let acceleration_gradient = acceleration_gradient(w, alpha);
    let a = &links.axes;
    let axis = [[a[0], a[1], a[2]], [a[3], a[4], a[5]], [a[6], a[7], a[8]]];
    let push = |r: V3<Lanes>| rotate(&acceleration_gradient, r);
    let pushed = [push(axis[0]), push(axis[1]), push(axis[2])];
    let lever = |i: usize| add_cross(cross(p, pushed[i]), axis[i], accel);
    let levers = [lever(0), lever(1), lever(2)];
    let moment = cross(p, accel);

    let (own_w, own_alpha) = (rotate_back(&links.axes, w), rotate_back(&links.axes, alpha));
    let spun = [cross(w, axis[0]), cross(w, axis[1]), cross(w, axis[2])];
    let single = |i: usize| add_scaled(scale(axis[i], own_alpha[i]), spun[i], own_w[i]);
    let mixed = |i: usize, j: usize| {
        let mixed = add_scaled(scale(axis[i], own_alpha[j]), axis[j], own_alpha[i]);
        add_scaled(add_scaled(mixed, spun[i], own_w[j]), spun[j], own_w[i])
    };
    let (xx, xy, yy, xz) = (single(0), mixed(0, 1), single(1), mixed(0, 2));
    let (yz, zz) = (mixed(1, 2), single(2));
    [
        transposed_lanes([accel, pushed[0], pushed[1], pushed[2]]),
        transposed_lanes([moment, levers[0], levers[1], levers[2]]),
        transposed_lanes([xx, xy, yy, xz]),
        transposed_lanes([yz, zz, zz, zz]),
    ]
}

/// Transposes four vectors of four links each: per component one row per link, with the vectors in
/// the lanes.
#[inline(always)]
fn transposed_lanes([a, b, c, d]: [V3<Lanes>; 4]) -> V3<[Lanes; LANES]> {
    [
        Lanes::transpose([a[0], b[0], c[0], d[0]]),
        Lanes::transpose([a[1], b[1], c[1], d[1]]),
        Lanes::transpose([a[2], b[2], c[2], d[2]]),
    ]
}

/// Returns the joint torques of links with these parameters, `Y p` \[N m\].
pub fn regressor_times<const N: usize>(y: &Regressor<N>, p: &[Vector<10>; N]) -> Vector<N> {
    Vector::from_fn(|i, _| y[i].iter().zip(p).map(|(row, p)| row.dot(p)).sum())
}

/// Returns the ten inertial parameters of every link in its link frame; the last link includes the tool.
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
