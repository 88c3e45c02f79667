//! The arm, which `chain.rs` simulates, and the objects of its scene, which the rapier engine simulates; the interface has only
//! types of this crate and of nalgebra.

mod chain;
mod convert;
mod surface;
mod tip;

pub(crate) use tip::{TipForce, TipMotion};

pub(crate) use chain::{Chain, Forces};
pub use surface::{Object, ObjectKind};

use crate::config::PlantConfig;
use crate::contact::Bristle;
use crate::error::PlantError;
use convert::to_glam_vector;
use rapier3d_f64::geometry::Ball;
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::{Arm, Vector};
use surface::{Surface, insert_scene};

/// The arm in its scene. Only the tip's contact force couples the two, so that the engine of the scene runs only if
/// something in it can move.
pub(crate) struct World<const N: usize> {
    arm: Chain<N>,
    physics: PhysicsWorld,
    /// Whether the scene has objects that move.
    scene_moves: bool,
    surfaces: Vec<Surface>,
    tip: Ball,
}

impl<const N: usize> World<N> {
    /// Creates the world of a validated configuration.
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
        let surfaces = insert_scene(&mut physics, &config.scene)?;
        // A step of zero duration initialises masses.
        physics.integration_parameters.dt = 0.0;
        physics.step();
        let mut world = World {
            arm: Chain::new(&config.arm, link_armature(config)),
            physics,
            scene_moves: !config.scene.free_boxes.is_empty(),
            surfaces,
            tip: Ball::new(config.tip_radius_m),
        };
        world.set_state(q, qd);
        Ok(world)
    }

    /// Returns the arm.
    pub fn arm(&self) -> &Chain<N> {
        &self.arm
    }

    pub fn set_state(&mut self, q: &Vector<N>, qd: &Vector<N>) {
        self.arm.set_state(q, qd);
        for surface in &mut self.surfaces {
            surface.bristle = Bristle::default();
        }
    }

    /// Adds to the joint velocities \[rad/s\], as an impulse does.
    pub fn apply_velocity_step(&mut self, change: &Vector<N>) {
        self.arm.velocity_rad_per_s += change;
    }

    /// Sets gravity and the last link to those of `arm`, which is otherwise the same arm.
    pub fn set_last_link_and_gravity(&mut self, arm: &Arm<N>) {
        self.physics.gravity = to_glam_vector(&arm.gravity());
        self.arm.set_arm(arm);
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

    /// Returns the object with the deepest penetration of the tip, and the depth \[m\].
    pub fn deepest(&self, tip: &TipMotion) -> Option<(String, f64)> {
        let contacts = self.surfaces.iter().filter_map(|surface| {
            let body = &self.physics.bodies[surface.body];
            let contact = surface.contact(body, &self.tip, tip)?;
            Some((surface.object(body).name, contact.depth_m))
        });
        contacts.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Advances everything by `dt_s`.
    pub fn step(&mut self, forces: &Forces<'_, N>, dt_s: f64) {
        self.arm.step(forces, dt_s);
        if !self.scene_moves {
            return;
        }
        self.physics.integration_parameters.dt = dt_s;
        self.physics.step();
        for surface in &self.surfaces {
            // Mutable access to a body makes the engine re-check it: fixed bodies are only read.
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

/// Returns the rotor inertias that turn with the joints; rotors behind elastic transmissions do not.
fn link_armature<const N: usize>(config: &PlantConfig<N>) -> Vector<N> {
    match config.elasticity {
        Some(_) => Vector::zeros(),
        None => config.arm.armature(),
    }
}
