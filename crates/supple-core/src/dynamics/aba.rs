//! Forward dynamics by the articulated-body algorithm.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::chain::parent_rotations;
use crate::math::Vector;
use crate::math::lanes::{Number, in_groups, joint_values};
use crate::math::vec3::{
    V3, add, add_cross, add_rotated, add_scaled, cross, dot, rotate, rotate_back, scale,
};
use crate::model::arm::Arm;

/// Symmetric 3 x 3 matrix `xx, xy, yy, xz, yz, zz`.
type Symmetric = [f64; 6];

/// Articulated inertia about the joint frame's origin, `(moment, force) = [A B; B^T C] (alpha, a)`, `B` by
/// columns, and the bias wrench.
#[derive(Clone, Copy)]
struct Articulated {
    a: Symmetric,
    b: [f64; 9],
    c: Symmetric,
    moment: V3,
    force: V3,
}

/// Per-joint results of the inward sweep that the outward sweep needs.
#[derive(Clone, Copy)]
struct AbaJoint {
    /// Velocity-dependent acceleration added to that of the parent.
    bias_alpha: V3,
    bias_accel: V3,
    u_moment: V3,
    u_force: V3,
    inverse_d: f64,
    net_torque: f64,
}

impl AbaJoint {
    const NONE: AbaJoint = AbaJoint {
        bias_alpha: [0.0; 3],
        bias_accel: [0.0; 3],
        u_moment: [0.0; 3],
        u_force: [0.0; 3],
        inverse_d: 0.0,
        net_torque: 0.0,
    };
}

/// Returns the joint accelerations \[rad/s^2\] under the torques `tau` \[N m\], without friction.
///
/// `q` \[rad\], `qd` \[rad/s\]. This is the inverse of [`rnea`](super::rnea).
#[cfg_attr(not(debug_assertions), inline)]
pub fn aba<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    tau: &Vector<N>,
) -> Vector<N> {
    in_groups!(N, forward_dynamics(arm, q, qd, tau))
}

#[cfg_attr(not(debug_assertions), inline)]
fn forward_dynamics<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    tau: &Vector<N>,
) -> Vector<N> {
    let rotations = parent_rotations::<N, G>(arm, q);
    let origin = |i: usize| arm.links[i].parent_from_joint.translation.data.0[0];
    let mut hinges = [AbaJoint::NONE; N];
    let mut angular_velocities = [[0.0; 3]; N];
    let mut angular_velocity = [0.0; 3];
    for i in 0..N {
        let r = joint_values(&rotations, i);
        if i > 0 {
            hinges[i].bias_accel = rotate_back(
                &r,
                cross(angular_velocity, cross(angular_velocity, origin(i))),
            );
            angular_velocity = rotate_back(&r, angular_velocity);
            hinges[i].bias_alpha = [
                angular_velocity[1] * qd[i],
                -angular_velocity[0] * qd[i],
                0.0,
            ];
        }
        angular_velocity[2] += qd[i];
        angular_velocities[i] = angular_velocity;
    }
    let mut carried: Option<Articulated> = None;
    for i in (0..N).rev() {
        let mut body = link(arm, i, angular_velocities[i]);
        if let Some(carried) = &carried {
            body.add(carried);
        }
        let hinge = &mut hinges[i];
        hinge.u_moment = [body.a[3], body.a[4], body.a[5]];
        hinge.u_force = [body.b[2], body.b[5], body.b[8]];
        hinge.inverse_d = 1.0 / (hinge.u_moment[2] + arm.armature[i]);
        hinge.net_torque = tau[i] - body.moment[2];
        if i > 0 {
            body.project(hinge);
            carried = Some(body.in_parent(&joint_values(&rotations, i), origin(i)));
        }
    }
    let mut qdd = Vector::zeros();
    let mut alpha = [0.0; 3];
    let mut accel = arm.gravity.map(|g| -g).data.0[0];
    for i in 0..N {
        let (hinge, r) = (&hinges[i], joint_values(&rotations, i));
        if i > 0 {
            accel = add_cross(accel, alpha, origin(i));
        }
        accel = add(rotate_back(&r, accel), hinge.bias_accel);
        alpha = add(rotate_back(&r, alpha), hinge.bias_alpha);
        qdd[i] = (hinge.net_torque - dot(hinge.u_moment, alpha) - dot(hinge.u_force, accel))
            * hinge.inverse_d;
        alpha[2] += qdd[i];
    }
    qdd
}

/// Returns the articulated body of link `i` alone.
#[inline(always)]
fn link<const N: usize>(arm: &Arm<N>, i: usize, angular_velocity: V3) -> Articulated {
    let body = |k: usize| arm.rows.inertial_parameter(k, i);
    let (mass, h) = (body(0), [body(1), body(2), body(3)]);
    let a = core::array::from_fn(|k| body(4 + k));
    Articulated {
        a,
        b: [0.0, h[2], -h[1], -h[2], 0.0, h[0], h[1], -h[0], 0.0],
        c: [mass, 0.0, mass, 0.0, 0.0, mass],
        moment: cross(angular_velocity, times(&a, angular_velocity)),
        force: cross(angular_velocity, cross(angular_velocity, h)),
    }
}

#[inline(always)]
fn times(m: &Symmetric, v: V3) -> V3 {
    [
        dot([m[0], m[1], m[3]], v),
        dot([m[1], m[2], m[4]], v),
        dot([m[3], m[4], m[5]], v),
    ]
}

/// Returns `R M R^T`.
#[inline(always)]
fn rotated(r: &[f64; 9], m: &Symmetric) -> Symmetric {
    let (x, y, z) = (
        rotate(r, [m[0], m[1], m[3]]),
        rotate(r, [m[1], m[2], m[4]]),
        rotate(r, [m[3], m[4], m[5]]),
    );
    let entry = |i: usize, j: usize| dot([x[i], y[i], z[i]], [r[j], r[3 + j], r[6 + j]]);
    [
        entry(0, 0),
        entry(1, 0),
        entry(1, 1),
        entry(2, 0),
        entry(2, 1),
        entry(2, 2),
    ]
}

/// Row and column of each entry of a [`Symmetric`].
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

impl Articulated {
    #[inline(always)]
    fn add(&mut self, other: &Articulated) {
        for k in 0..6 {
            self.a[k] += other.a[k];
            self.c[k] += other.c[k];
        }
        for k in 0..9 {
            self.b[k] += other.b[k];
        }
        self.moment = add(self.moment, other.moment);
        self.force = add(self.force, other.force);
    }

    /// Replaces articulated inertia and bias force by those that the parent feels: projects out the joint's free
    /// direction.
    #[inline(always)]
    fn project(&mut self, hinge: &AbaJoint) {
        let (um, uf) = (hinge.u_moment, hinge.u_force);
        let (dm, df) = (scale(um, hinge.inverse_d), scale(uf, hinge.inverse_d));
        for (k, (i, j)) in ENTRIES.into_iter().enumerate() {
            self.a[k] = (-um[i]).multiply_add(dm[j], self.a[k]);
            self.c[k] = (-uf[i]).multiply_add(df[j], self.c[k]);
        }
        for k in 0..9 {
            self.b[k] = (-um[k % 3]).multiply_add(df[k / 3], self.b[k]);
        }
        let (alpha, accel) = (hinge.bias_alpha, hinge.bias_accel);
        let moment = add_rotated(times(&self.a, alpha), &self.b, accel);
        let force = add(rotate_back(&self.b, alpha), times(&self.c, accel));
        self.moment = add(self.moment, add_scaled(moment, dm, hinge.net_torque));
        self.force = add(self.force, add_scaled(force, df, hinge.net_torque));
    }

    /// Returns the body in the parent's joint frame; `p` and `r` are position and rotation of the body's frame in the
    /// parent's frame.
    #[inline(always)]
    fn in_parent(&self, r: &[f64; 9], p: V3) -> Articulated {
        let (a, c) = (rotated(r, &self.a), rotated(r, &self.c));
        let half = crate::math::vec3::product(r, &self.b);
        let b = crate::math::vec3::product(&half, &crate::math::vec3::transposed(r));
        // With P = [p x]: B' = B + P C and A' = A - B' P - (B P)^T.
        let shifted = crate::math::vec3::join3(
            add_cross([b[0], b[1], b[2]], p, [c[0], c[1], c[3]]),
            add_cross([b[3], b[4], b[5]], p, [c[1], c[2], c[4]]),
            add_cross([b[6], b[7], b[8]], p, [c[3], c[4], c[5]]),
        );
        // Entry (i, j) of M P is the j-th of (row i of M) x p.
        let row = |m: &[f64; 9], i: usize| cross([m[i], m[3 + i], m[6 + i]], p);
        let (left, right) = (
            [row(&shifted, 0), row(&shifted, 1), row(&shifted, 2)],
            [row(&b, 0), row(&b, 1), row(&b, 2)],
        );
        let force = rotate(r, self.force);
        Articulated {
            a: core::array::from_fn(|k| {
                let (i, j) = ENTRIES[k];
                a[k] - left[i][j] - right[j][i]
            }),
            b: shifted,
            c,
            moment: add_cross(rotate(r, self.moment), p, force),
            force,
        }
    }
}
