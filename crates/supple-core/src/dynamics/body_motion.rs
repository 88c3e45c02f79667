//! Motion of every link in its own joint frame.
//!
//! With `W = [alpha x] + [omega x][omega x]`, the acceleration of a point `p` of a link is `a + W
//! p`.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::Vector;
use crate::math::lanes::{Number, Rows, joint_values};
use crate::math::vec3::{V3, add_rotated, rotate_back};
use crate::model::arm::Arm;

/// Motion of a joint frame, in its own axes.
#[derive(Clone, Copy)]
pub(super) struct BodyMotion {
    /// `omega` \[rad/s\].
    pub angular_velocity: V3,
    /// `alpha` \[rad/s^2\].
    pub angular_acceleration: V3,
    /// Acceleration of the origin, with the base accelerated upwards \[m/s^2\].
    pub accel: V3,
    /// `W`, by columns.
    pub acceleration_gradient: [f64; 9],
}

impl BodyMotion {
    const REST: BodyMotion = BodyMotion {
        angular_velocity: [0.0; 3],
        angular_acceleration: [0.0; 3],
        accel: [0.0; 3],
        acceleration_gradient: [0.0; 9],
    };
}

/// Returns the motions of all joint frames, from the base outwards.
#[inline(always)]
pub(super) fn body_motions<const N: usize, const G: usize>(
    arm: &Arm<N>,
    rotations: &Rows<9, G>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> [BodyMotion; N] {
    let mut motions = [BodyMotion::REST; N];
    let mut last = BodyMotion::REST;
    last.accel = arm.gravity.map(|g| -g).data.0[0];
    for i in 0..N {
        let r = joint_values(rotations, i);
        let origin = arm.links[i].parent_from_joint.translation.data.0[0];
        let (mut angular_velocity, mut angular_acceleration, mut accel) =
            ([0.0; 3], [0.0; 3], last.accel);
        if i > 0 {
            angular_velocity = rotate_back(&r, last.angular_velocity);
            angular_acceleration = rotate_back(&r, last.angular_acceleration);
            angular_acceleration[0] =
                angular_velocity[1].multiply_add(qd[i], angular_acceleration[0]);
            angular_acceleration[1] =
                (-angular_velocity[0]).multiply_add(qd[i], angular_acceleration[1]);
            accel = add_rotated(accel, &last.acceleration_gradient, origin);
        }
        angular_acceleration[2] += qdd[i];
        angular_velocity[2] += qd[i];
        last = BodyMotion {
            angular_velocity,
            angular_acceleration,
            accel: rotate_back(&r, accel),
            acceleration_gradient: acceleration_gradient(angular_velocity, angular_acceleration),
        };
        motions[i] = last;
    }
    motions
}

/// Returns `W`, by columns.
#[inline(always)]
pub(super) fn acceleration_gradient<T: Number>(w: V3<T>, angular_acceleration: V3<T>) -> [T; 9] {
    let zz = w[2] * w[2];
    [
        -w[1].multiply_add(w[1], zz),
        w[0].multiply_add(w[1], angular_acceleration[2]),
        w[0].multiply_add(w[2], -angular_acceleration[1]),
        w[0].multiply_add(w[1], -angular_acceleration[2]),
        -w[0].multiply_add(w[0], zz),
        w[1].multiply_add(w[2], angular_acceleration[0]),
        w[0].multiply_add(w[2], angular_acceleration[1]),
        w[1].multiply_add(w[2], -angular_acceleration[0]),
        -w[0].multiply_add(w[0], w[1] * w[1]),
    ]
}
