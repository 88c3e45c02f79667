//! The arm as a multibody of the engine.

use super::convert::{to_glam_matrix, to_glam_pose, to_glam_vector};
use core::array;
use rapier3d_f64::dynamics::{
    GenericJointBuilder, JointAxesMask, MassProperties, MultibodyJointHandle, RigidBodyBuilder,
    RigidBodyHandle,
};
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::nalgebra::{Matrix3, Vector3};
use supple_core::{Arm, Body, Pose};

/// Inserts a chain of links on a fixed base; each body's frame is the joint frame, whose z is the joint's axis.
pub fn insert_arm<const N: usize>(
    physics: &mut PhysicsWorld,
    arm: &Arm<N>,
) -> ([RigidBodyHandle; N], MultibodyJointHandle) {
    let base = physics.insert_body(RigidBodyBuilder::fixed());
    let links = array::from_fn(|i| {
        let builder = RigidBodyBuilder::dynamic()
            .can_sleep(false)
            .additional_mass_properties(mass_properties(&arm.body(i)));
        physics.insert_body(builder)
    });
    // The engine's revolute joint rotates about x.
    let joint_from_turning = Pose {
        rotation: Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0),
        translation: Vector3::zeros(),
    };
    let mut last = MultibodyJointHandle::invalid();
    for (i, link) in links.iter().enumerate() {
        let parent = if i == 0 { base } else { links[i - 1] };
        let joint = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(to_glam_pose(
                &(arm.parent_from_joint(i) * joint_from_turning),
            ))
            .local_frame2(to_glam_pose(&joint_from_turning));
        if let Some(handle) = physics.insert_multibody_joint(parent, *link, joint) {
            last = handle;
        }
    }
    (links, last)
}

/// Mass properties of a body in the engine's type.
pub fn mass_properties(body: &Body) -> MassProperties {
    MassProperties::with_inertia_matrix(
        to_glam_vector(&body.com_m),
        body.mass_kg,
        to_glam_matrix(&body.inertia_kg_m2),
    )
}
