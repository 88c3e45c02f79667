//! Contact surfaces of the scene: bodies of the engine with surface shapes of this crate.

use super::convert::{from_glam, from_glam_pose, to_glam_pose, to_glam_vector};
use super::tip::TipMotion;
use crate::contact::{Bristle, Contact, Material};
use crate::scene::{Layer, Scene, SceneError};
use rapier3d_f64::dynamics::{MassProperties, RigidBody, RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{Ball, ColliderBuilder, SharedShape};
use rapier3d_f64::math as engine_math;
use rapier3d_f64::parry::query;
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::Pose;
use supple_core::nalgebra::Vector3;

/// Kind of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectKind {
    /// Ground: the half-space below its origin.
    Ground,
    /// A cuboid that does not move.
    FixedBlock,
    /// A cuboid that moves.
    FreeBox,
    /// A cuboid that lies on one of the others.
    Layer,
}

/// An object of the environment in its current state; for drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the scene; a layer has the name of its carrier, the ground is "ground".
    pub name: String,
    /// Kind of the object.
    pub kind: ObjectKind,
    /// Edge lengths \[m\]; zero for the ground.
    pub size_m: Vector3<f64>,
    /// `base_from_object`, origin at the centre of a cuboid, on the surface of the ground.
    pub pose: Pose,
    /// Name of its material.
    pub material: String,
}

/// A shape on a body, with its contact data.
pub struct Surface {
    object: Object,
    shape: SharedShape,
    body_from_surface: Pose,
    pub body: RigidBodyHandle,
    pub material: Material,
    /// Tangential friction state of the tip on this surface.
    pub bristle: Bristle,
}

impl Surface {
    /// Returns the object at the current pose of its body, `body`.
    pub fn object(&self, body: &RigidBody) -> Object {
        Object {
            pose: from_glam_pose(body.position()) * self.body_from_surface,
            ..self.object.clone()
        }
    }

    /// Returns the contact state of the spherical tip, if it penetrates the surface.
    pub fn contact(&self, body: &RigidBody, ball: &Ball, tip: &TipMotion) -> Option<Contact> {
        let tip_pose = engine_math::Pose::from_translation(to_glam_vector(&tip.center_m));
        let surface_pose = *body.position() * to_glam_pose(&self.body_from_surface);
        // The surface must be the first argument: with a half-space in second place parry does not
        // invert the relative pose, and returns a wrong contact.
        let found = query::contact(&surface_pose, &*self.shape, &tip_pose, ball, 0.0);
        let found = found.ok().flatten()?;
        let depth_m = -found.dist;
        let normal = from_glam(&found.normal1);
        // The contact point is halfway between the two surfaces.
        let point_m = from_glam(&found.point2) + normal * (0.5 * depth_m);
        let lever = point_m - tip.center_m;
        let own = tip.linear_m_per_s + tip.angular_rad_per_s.cross(&lever);
        let other = from_glam(&body.velocity_at_point(to_glam_vector(&point_m)));
        (depth_m > 0.0).then_some(Contact {
            depth_m,
            normal,
            point_m,
            velocity_m_per_s: own - other,
        })
    }
}

/// Inserts the scene into the world and returns its surfaces.
pub fn insert_scene(physics: &mut PhysicsWorld, scene: &Scene) -> Result<Vec<Surface>, SceneError> {
    let mut surfaces = Surfaces {
        scene,
        list: Vec::new(),
    };
    if let Some(ground) = &scene.ground {
        let pose = Pose::from_translation(Vector3::new(0.0, 0.0, ground.height_m));
        let body = physics.insert_body(RigidBodyBuilder::fixed().pose(to_glam_pose(&pose)));
        let shape = SharedShape::halfspace(engine_math::Vector::Z);
        let what = ("ground", ObjectKind::Ground, Vector3::zeros());
        surfaces.add(what, shape, body, Pose::IDENTITY, &ground.material)?;
    }
    for block in &scene.fixed_blocks {
        let body = physics.insert_body(RigidBodyBuilder::fixed().pose(to_glam_pose(&block.pose())));
        let size = Vector3::from(block.size_m);
        let what = (block.name.as_str(), ObjectKind::FixedBlock, size);
        surfaces.add_cuboid(what, body, &block.material, block.layer.as_ref())?;
    }
    for block in &scene.free_boxes {
        let size = Vector3::from(block.size_m);
        let square = size.component_mul(&size);
        let inertia = (Vector3::repeat(square.sum()) - square) * (block.mass_kg / 12.0);
        let zero = engine_math::Vector::ZERO;
        let properties = MassProperties::new(zero, block.mass_kg, to_glam_vector(&inertia));
        let builder = RigidBodyBuilder::dynamic()
            .pose(to_glam_pose(&block.pose()))
            .can_sleep(false)
            .additional_mass_properties(properties);
        let body = physics.insert_body(builder);
        let what = (block.name.as_str(), ObjectKind::FreeBox, size);
        surfaces.add_cuboid(what, body, &block.material, block.layer.as_ref())?;
    }
    // The engine's own contacts act between scene objects alone, never on the tip: without a free box none is needed.
    if !scene.free_boxes.is_empty() {
        for surface in &surfaces.list {
            let collider = ColliderBuilder::new(surface.shape.clone())
                .position(to_glam_pose(&surface.body_from_surface))
                .density(0.0)
                .friction(surface.material.friction);
            physics.insert_collider(collider, Some(surface.body));
        }
    }
    Ok(surfaces.list)
}

struct Surfaces<'a> {
    scene: &'a Scene,
    list: Vec<Surface>,
}

impl Surfaces<'_> {
    fn add_cuboid(
        &mut self,
        what: (&str, ObjectKind, Vector3<f64>),
        body: RigidBodyHandle,
        material: &str,
        layer: Option<&Layer>,
    ) -> Result<(), SceneError> {
        let cuboid = |size: &Vector3<f64>| {
            let half = size * 0.5;
            SharedShape::cuboid(half.x, half.y, half.z)
        };
        let (name, _, size) = what;
        self.add(what, cuboid(&size), body, Pose::IDENTITY, material)?;
        let Some(layer) = layer else { return Ok(()) };
        let sheet = Vector3::new(size.x, size.y, layer.thickness_m);
        let up = Vector3::new(0.0, 0.0, 0.5 * (size.z + layer.thickness_m));
        let what = (name, ObjectKind::Layer, sheet);
        let pose = Pose::from_translation(up);
        self.add(what, cuboid(&sheet), body, pose, &layer.material)
    }

    fn add(
        &mut self,
        (name, kind, size_m): (&str, ObjectKind, Vector3<f64>),
        shape: SharedShape,
        body: RigidBodyHandle,
        body_from_surface: Pose,
        material: &str,
    ) -> Result<(), SceneError> {
        let material = self.scene.resolve(name, material)?;
        self.list.push(Surface {
            object: Object {
                name: name.to_owned(),
                kind,
                size_m,
                pose: Pose::IDENTITY,
                material: material.name.clone(),
            },
            shape,
            body_from_surface,
            body,
            material,
            bristle: Bristle::default(),
        });
        Ok(())
    }
}
