//! The rapier world behind types of this crate and of nalgebra.

mod arm;
mod convert;
mod surface;

pub use surface::{Object, ObjectKind};

use crate::config::PlantConfig;
use crate::contact::Bristle;
use crate::error::PlantError;
use arm::{insert_arm, mass_properties};
use convert::to_glam_vector;
use rapier3d_f64::dynamics::{MultibodyJointHandle, RigidBodyHandle};
use rapier3d_f64::geometry::Ball;
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Vector};
use surface::{Surface, insert_scene};

/// Index of the angular x coordinate, the free coordinate of a revolute joint.
const ANGULAR_X: usize = 3;

/// Motion of the spherical tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TipMotion {
    pub center_m: Vector3<f64>,
    pub linear_m_per_s: Vector3<f64>,
    pub angular_rad_per_s: Vector3<f64>,
}

/// A force on the tip and the moment it has about the tip's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TipForce {
    pub force_n: Vector3<f64>,
    pub moment_nm: Vector3<f64>,
    pub depth_m: f64,
}

pub(crate) struct World<const N: usize> {
    physics: PhysicsWorld,
    links: [RigidBodyHandle; N],
    last_joint: MultibodyJointHandle,
    surfaces: Vec<Surface>,
    tip: Ball,
}

impl<const N: usize> World<N> {
    /// The configuration has been validated.
    pub fn new(config: &PlantConfig<N>, q: &Vector<N>, qd: &Vector<N>) -> Result<Self, PlantError> {
        let mut physics = PhysicsWorld::new();
        physics.gravity = to_glam_vector(&config.arm.gravity());
        let parameters = &mut physics.integration_parameters;
        // One solver iteration equals one substep; the caller chooses the step.
        parameters.num_solver_iterations = 1;
        // With fewer iterations a box on the ground would drift.
        parameters.num_internal_pgs_iterations = 8;
        // Recycled contacts would be wrong by millimetres.
        parameters.contact_recycling = false;
        parameters.max_ccd_substeps = 0;
        let (links, last_joint) = insert_arm(&mut physics, &config.arm);
        let surfaces = insert_scene(&mut physics, &config.scene)?;
        // A step of zero duration initialises masses and degrees of freedom.
        physics.integration_parameters.dt = 0.0;
        physics.step();
        if let Some((arm, _)) = physics.multibody_joints.get_mut(last_joint) {
            // The engine damps joints by default.
            arm.damping_mut().fill(0.0);
            let armature = link_armature(config);
            arm.armature_mut().copy_from_slice(armature.as_slice());
        }
        let mut world = World {
            physics,
            links,
            last_joint,
            surfaces,
            tip: Ball::new(config.tip_radius_m),
        };
        world.set_state(q, qd);
        Ok(world)
    }

    /// Joint angles \[rad\] and velocities \[rad/s\].
    pub fn state(&self) -> (Vector<N>, Vector<N>) {
        let (mut q, mut qd) = (Vector::zeros(), Vector::zeros());
        if let Some((arm, _)) = self.physics.multibody_joints.get(self.last_joint) {
            for (i, link) in arm.links().skip(1).enumerate() {
                q[i] = link.joint().coords()[ANGULAR_X];
                qd[i] = arm.generalized_velocity()[i];
            }
        }
        (q, qd)
    }

    /// Diagonal of the inverse mass matrix of the links, with the rotors of rigid joints \[1/(kg m^2)\].
    pub fn link_inverse_inertia(&mut self) -> Vector<N> {
        let PhysicsWorld {
            multibody_joints,
            bodies,
            ..
        } = &mut self.physics;
        let arm = multibody_joints.get_mut(self.last_joint);
        let found = arm
            .map(|(arm, _)| Vector::from_column_slice(arm.dof_inverse_inertia(bodies).as_slice()));
        found.unwrap_or_else(Vector::zeros)
    }

    /// Sets the damping of the joints in the next steps, which the engine integrates implicitly \[N m s/rad\].
    pub fn set_joint_damping(&mut self, damping_nm_s_per_rad: &Vector<N>) {
        if let Some((arm, _)) = self.physics.multibody_joints.get_mut(self.last_joint) {
            let damping = damping_nm_s_per_rad.as_slice();
            arm.damping_mut().copy_from_slice(damping);
        }
    }

    pub fn set_state(&mut self, q: &Vector<N>, qd: &Vector<N>) {
        let (now, _) = self.state();
        let PhysicsWorld {
            multibody_joints,
            bodies,
            ..
        } = &mut self.physics;
        if let Some((arm, _)) = multibody_joints.get_mut(self.last_joint) {
            arm.apply_displacements((q - now).as_slice());
            arm.generalized_velocity_mut().copy_from(qd);
            arm.forward_kinematics(bodies, false);
            arm.update_rigid_bodies(bodies, true);
        }
        for surface in &mut self.surfaces {
            surface.bristle = Bristle::default();
        }
    }

    /// Adds to the joint velocities \[rad/s\], as an impulse does.
    pub fn apply_velocity_step(&mut self, change: &Vector<N>) {
        let PhysicsWorld {
            multibody_joints,
            bodies,
            ..
        } = &mut self.physics;
        if let Some((arm, _)) = multibody_joints.get_mut(self.last_joint) {
            for (speed, change) in arm.generalized_velocity_mut().iter_mut().zip(change.iter()) {
                *speed += change;
            }
            arm.forward_kinematics(bodies, false);
            arm.update_rigid_bodies(bodies, true);
        }
    }

    /// Sets gravity and the last link to those of `arm`, which is otherwise the same arm.
    pub fn set_last_link_and_gravity(&mut self, arm: &Arm<N>) {
        self.physics.gravity = to_glam_vector(&arm.gravity());
        let last = &mut self.physics.bodies[self.links[N - 1]];
        last.set_additional_mass_properties(mass_properties(&arm.body(N - 1)), true);
    }

    /// Computes the contact of the tip with every surface, applies the reaction to free objects, and returns the
    /// force on the tip.
    pub fn compute_tip_contact(&mut self, tip: &TipMotion, dt_s: f64) -> TipForce {
        let mut total = TipForce::default();
        for surface in &mut self.surfaces {
            let body = &self.physics.bodies[surface.body];
            let contact = surface.contact(body, &self.tip, tip);
            let force_n = surface
                .bristle
                .advance(contact.as_ref(), &surface.material, dt_s);
            let Some(contact) = contact else { continue };
            total.force_n += force_n;
            total.moment_nm += (contact.point_m - tip.center_m).cross(&force_n);
            total.depth_m = total.depth_m.max(contact.depth_m);
            if body.is_dynamic() {
                let (force, point) = (to_glam_vector(&-force_n), to_glam_vector(&contact.point_m));
                self.physics.bodies[surface.body].add_force_at_point(force, point, true);
            }
        }
        total
    }

    /// The object with the deepest penetration of the tip, and the depth \[m\].
    pub fn deepest(&self, tip: &TipMotion) -> Option<(String, f64)> {
        let met = self.surfaces.iter().filter_map(|surface| {
            let body = &self.physics.bodies[surface.body];
            let contact = surface.contact(body, &self.tip, tip)?;
            Some((surface.object(body).name, contact.depth_m))
        });
        met.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Advances everything by `dt_s` under a torque on each link and a force at a point of the last
    /// one, base axes.
    pub fn step(
        &mut self,
        link_torque_nm: &[Vector3<f64>; N],
        tip: &TipForce,
        tip_center_m: &Vector3<f64>,
        dt_s: f64,
    ) {
        for (i, handle) in self.links.iter().enumerate() {
            let link = &mut self.physics.bodies[*handle];
            link.reset_forces(false);
            link.reset_torques(false);
            link.add_torque(to_glam_vector(&link_torque_nm[i]), true);
            if i + 1 == N {
                link.add_torque(to_glam_vector(&tip.moment_nm), true);
                link.add_force_at_point(
                    to_glam_vector(&tip.force_n),
                    to_glam_vector(tip_center_m),
                    true,
                );
            }
        }
        self.physics.integration_parameters.dt = dt_s;
        self.physics.step();
        for surface in &self.surfaces {
            // Mutable access to a body makes the engine re-check it.
            if self.physics.bodies[surface.body].is_dynamic() {
                let body = &mut self.physics.bodies[surface.body];
                body.reset_forces(false);
                body.reset_torques(false);
            }
        }
    }

    /// Objects of the environment in their current state.
    pub fn objects(&self) -> impl Iterator<Item = Object> {
        let bodies = &self.physics.bodies;
        let surfaces = self.surfaces.iter();
        surfaces.map(|surface| surface.object(&bodies[surface.body]))
    }
}

/// Rotor inertias that turn with the joints: not those behind elastic transmissions.
fn link_armature<const N: usize>(config: &PlantConfig<N>) -> Vector<N> {
    match config.elasticity {
        Some(_) => Vector::zeros(),
        None => config.arm.armature(),
    }
}
