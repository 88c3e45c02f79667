//! Inverse dynamics and gravity torque by the recursive Newton-Euler algorithm.
//!
//! The sweeps run in joint frames, so that precision does not depend on the distance of the wrist
//! from the base.
#![allow(
    clippy::needless_range_loop,
    reason = "each index is used in several arrays"
)]

use super::body_motion::body_motions;
use super::chain::parent_rotations;
use crate::math::Vector;
use crate::math::lanes::{Number, in_groups, joint_values};
use crate::math::vec3::{V3, add, add_cross, add_rotated, add_scaled, dot, rotate, rotate_back};
use crate::model::arm::Arm;

/// Returns the joint torques for the accelerations `qdd`: `H qdd + C qd + G` \[N m\], without friction.
///
/// `q` \[rad\], `qd` \[rad/s\], `qdd` \[rad/s^2\]. Eq. (3.1).
#[cfg_attr(not(debug_assertions), inline)]
pub fn rnea<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> Vector<N> {
    in_groups!(N, inverse_dynamics(arm, q, qd, qdd))
}

#[cfg_attr(not(debug_assertions), inline)]
fn inverse_dynamics<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> Vector<N> {
    let rotations = parent_rotations::<N, G>(arm, q);
    let motions = body_motions(arm, &rotations, qd, qdd);
    let mut tau = Vector::zeros();
    let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
    for i in (0..N).rev() {
        let motion = &motions[i];
        let body = |k: usize| arm.rows.inertial_parameter(k, i);
        let mass_moment = [body(1), body(2), body(3)];
        let inertia_times = |v: V3| -> V3 {
            [
                dot([body(4), body(5), body(7)], v),
                dot([body(5), body(6), body(8)], v),
                dot([body(7), body(8), body(9)], v),
            ]
        };
        moment = add(moment, inertia_times(motion.angular_acceleration));
        moment = add_cross(moment, mass_moment, motion.accel);
        moment = add_cross(
            moment,
            motion.angular_velocity,
            inertia_times(motion.angular_velocity),
        );
        tau[i] = arm.armature[i].multiply_add(qdd[i], moment[2]);
        if i > 0 {
            force = add_scaled(force, motion.accel, body(0));
            force = add_rotated(force, &motion.acceleration_gradient, mass_moment);
            let r = joint_values(&rotations, i);
            let origin = arm.links[i].parent_from_joint.translation.data.0[0];
            force = rotate(&r, force);
            moment = add_cross(rotate(&r, moment), origin, force);
        }
    }
    tau
}

/// Returns the joint torques that hold the arm at rest against gravity, `G(q)` \[N m\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn gravity<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Vector<N> {
    in_groups!(N, gravity_torques(arm, q))
}

#[cfg_attr(not(debug_assertions), inline)]
fn gravity_torques<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Vector<N> {
    let rotations = parent_rotations::<N, G>(arm, q);
    let mut gravity_in_joints = [[0.0; 3]; N];
    let mut gravity_in_joint = arm.gravity.data.0[0];
    for i in 0..N {
        gravity_in_joint = rotate_back(&joint_values(&rotations, i), gravity_in_joint);
        gravity_in_joints[i] = gravity_in_joint;
    }
    let (mut outboard_mass, mut mass_moment) = (0.0, [0.0; 3]);
    let mut tau = Vector::zeros();
    for i in (0..N).rev() {
        let body = |k: usize| arm.rows.inertial_parameter(k, i);
        outboard_mass += body(0);
        mass_moment = add(mass_moment, [body(1), body(2), body(3)]);
        tau[i] = mass_moment[1].multiply_add(
            gravity_in_joints[i][0],
            -(mass_moment[0] * gravity_in_joints[i][1]),
        );
        if i > 0 {
            let origin = arm.links[i].parent_from_joint.translation.data.0[0];
            mass_moment = add_scaled(
                rotate(&joint_values(&rotations, i), mass_moment),
                origin,
                outboard_mass,
            );
        }
    }
    tau
}
