//! Compares the arm's integration step by step with the multibody of the rapier engine, which has the same discretisation.

use crate::common::{random_arm, wam4};
use core::array;
use rapier3d_f64::dynamics::{
    GenericJointBuilder, JointAxesMask, MassProperties, MultibodyJointHandle, RigidBodyBuilder,
    RigidBodyHandle,
};
use rapier3d_f64::math as glam;
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::dynamics::joint_poses;
use supple_core::nalgebra::{Matrix3, Vector3};
use supple_core::{Arm, Pose, Vector};
use supple_plant::{Plant, PlantConfig};

const STEP_S: f64 = 2e-4;
/// Index of the angular x coordinate, the free coordinate of a revolute joint.
const ANGULAR_X: usize = 3;

fn vector(v: &Vector3<f64>) -> glam::Vector {
    glam::Vector::new(v.x, v.y, v.z)
}

fn matrix(m: &Matrix3<f64>) -> glam::Matrix {
    let column = |i: usize| glam::Vector::new(m[(0, i)], m[(1, i)], m[(2, i)]);
    glam::Matrix::from_cols(column(0), column(1), column(2))
}

fn pose(pose: &Pose) -> glam::Pose {
    glam::Pose::from_parts(
        vector(&pose.translation),
        glam::Rotation::from_mat3(&matrix(&pose.rotation)),
    )
}

/// The arm as a multibody of the engine.
struct Multibody<const N: usize> {
    physics: PhysicsWorld,
    links: [RigidBodyHandle; N],
    last: MultibodyJointHandle,
    arm: Arm<N>,
}

impl<const N: usize> Multibody<N> {
    fn new(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = vector(&arm.gravity());
        physics.integration_parameters.num_solver_iterations = 1;
        let base = physics.insert_body(RigidBodyBuilder::fixed());
        let links = array::from_fn(|i| {
            let body = arm.body(i);
            let properties = MassProperties::with_inertia_matrix(
                vector(&body.com_m),
                body.mass_kg,
                matrix(&body.inertia_kg_m2),
            );
            let builder = RigidBodyBuilder::dynamic().can_sleep(false);
            physics.insert_body(builder.additional_mass_properties(properties))
        });
        // The engine's revolute joint turns about x.
        let joint_from_turning = Pose {
            rotation: Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0),
            translation: Vector3::zeros(),
        };
        let mut last = MultibodyJointHandle::invalid();
        for (i, link) in links.iter().enumerate() {
            let parent = if i == 0 { base } else { links[i - 1] };
            let joint = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
                .local_frame1(pose(&(arm.parent_from_joint(i) * joint_from_turning)))
                .local_frame2(pose(&joint_from_turning));
            last = physics
                .insert_multibody_joint(parent, *link, joint)
                .unwrap();
        }
        // A step of zero duration initialises masses and degrees of freedom.
        physics.integration_parameters.dt = 0.0;
        physics.step();
        let PhysicsWorld {
            multibody_joints,
            bodies,
            ..
        } = &mut physics;
        let (multibody, _) = multibody_joints.get_mut(last).unwrap();
        multibody.damping_mut().fill(0.0);
        multibody
            .armature_mut()
            .copy_from_slice(arm.armature().as_slice());
        multibody.apply_displacements(q.as_slice());
        multibody.generalized_velocity_mut().copy_from(qd);
        multibody.forward_kinematics(bodies, false);
        multibody.update_rigid_bodies(bodies, true);
        Multibody {
            physics,
            links,
            last,
            arm: *arm,
        }
    }

    fn state(&self) -> (Vector<N>, Vector<N>) {
        let (multibody, _) = self.physics.multibody_joints.get(self.last).unwrap();
        let (mut q, mut qd) = (Vector::zeros(), Vector::zeros());
        for (i, link) in multibody.links().skip(1).enumerate() {
            q[i] = link.joint().coords()[ANGULAR_X];
            qd[i] = multibody.generalized_velocity()[i];
        }
        (q, qd)
    }

    fn step(&mut self, torque: &Vector<N>) {
        let poses = joint_poses(&self.arm, &self.state().0);
        let about_axis: [Vector3<f64>; N] =
            array::from_fn(|i| poses[i].rotation.column(2) * torque[i]);
        for (i, handle) in self.links.iter().enumerate() {
            let reaction = about_axis.get(i + 1).copied().unwrap_or_default();
            let link = &mut self.physics.bodies[*handle];
            link.reset_torques(false);
            link.add_torque(vector(&(about_axis[i] - reaction)), true);
        }
        self.physics.integration_parameters.dt = STEP_S;
        self.physics.step();
    }
}

fn same_motion<const N: usize>(arm: &Arm<N>, q: Vector<N>, qd: Vector<N>, steps: u32) {
    let config = PlantConfig {
        step_s: STEP_S,
        cycle_s: STEP_S,
        ..PlantConfig::ideal(*arm)
    };
    let mut plant = Plant::new(config, q, qd).unwrap();
    let mut multibody = Multibody::new(arm, &q, &qd);
    for step in 0..steps {
        let time_s = STEP_S * f64::from(step);
        let torque = Vector::from_fn(|i, _| 2.0 * (3.0 * time_s + i as f64).sin());
        plant.cycle(&torque);
        multibody.step(&torque);
        let (q, qd) = multibody.state();
        let truth = plant.truth();
        // Rounding grows with the motion, by some 1e-16 a step at first.
        let error = (truth.position_rad - q).norm() + 1e-2 * (truth.velocity_rad_per_s - qd).norm();
        assert!(error < 1e-9 * (1.0 + qd.norm()), "step {step}: {error}");
    }
}

#[test]
fn a_moving_wam_equals_the_multibody_of_the_engine_in_every_step() {
    let q = Vector::from([0.3, 0.5, -0.4, 1.2]);
    same_motion(&wam4(), q, Vector::from([0.5, -0.3, 0.8, 1.0]), 5000);
}

#[test]
fn fast_motion_with_its_energy_check_equals_the_multibody_of_the_engine() {
    // From 5 rad/s on the velocity products are checked.
    for seed in 0..5 {
        let arm = random_arm::<5>(seed);
        let qd = Vector::from([6.0, -7.0, 8.0, -9.0, 10.0]);
        same_motion(&arm, Vector::repeat(0.3), qd, 500);
    }
}
