//! Kinetic and potential energy.

use super::joint_poses;
use super::rotations::parent_rotations;
use crate::math::{Vector, Vector3};
use crate::model::arm::Arm;

/// Returns the kinetic energy with the rotors, `qd^T H qd / 2` \[J\].
pub fn kinetic_energy<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> f64 {
    let rotations = parent_rotations(arm, q);
    let mut omega = Vector3::zeros();
    let mut velocity = Vector3::zeros();
    let mut twice = 0.0;
    for i in 0..N {
        let link = &arm.links[i];
        velocity += omega.cross(&link.parent_from_joint.translation);
        velocity = rotations[i].tr_mul(&velocity);
        omega = rotations[i].tr_mul(&omega);
        omega.z += qd[i];
        twice += link.mass * velocity.dot(&velocity)
            + 2.0 * velocity.dot(&omega.cross(&link.first_moment))
            + omega.dot(&(link.inertia * omega))
            + arm.armature[i] * qd[i] * qd[i];
    }
    0.5 * twice
}

/// Returns the potential energy, zero for a centre of mass at the base origin \[J\].
pub fn potential_energy<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> f64 {
    let poses = joint_poses(arm, q);
    let mut energy = 0.0;
    for (pose, link) in poses.iter().zip(&arm.links) {
        let moment = pose.rotation * link.first_moment + pose.translation * link.mass;
        energy -= arm.gravity.dot(&moment);
    }
    energy
}
