//! What the tip can touch: the scene as bodies of the engine and surfaces of ours.

use super::TipMotion;
use super::convert::{back, pose_back, pose_of, vector};
use crate::contact::{Bristle, Contact, Material};
use crate::scene::{Layer, Scene, SceneError};
use rapier3d_f64::dynamics::{MassProperties, RigidBody, RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{Ball, ColliderBuilder, SharedShape};
use rapier3d_f64::math as glam;
use rapier3d_f64::parry::query;
use rapier3d_f64::pipeline::PhysicsWorld;
use supple_core::Pose;
use supple_core::nalgebra::Vector3;

/// What an object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectKind {
    /// The half-space below its origin.
    Ground,
    /// A cuboid that does not move.
    FixedBlock,
    /// A cuboid that does.
    FreeBox,
    /// A cuboid that lies on one of the others.
    Layer,
}

/// Something around the arm, as it stands now; for drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// The name in the scene; a layer has that of what it lies on, the ground is "ground".
    pub name: String,
    /// What it is.
    pub kind: ObjectKind,
    /// Edge lengths \[m\]; zero for the ground.
    pub size_m: Vector3<f64>,
    /// `base_from_object`, origin at the centre of a cuboid, on the surface of the ground.
    pub pose: Pose,
    /// Name of its material.
    pub material: String,
}

/// A shape on a body, with what the tip needs to know of it.
pub struct Surface {
    object: Object,
    shape: SharedShape,
    body_from_surface: Pose,
    pub body: RigidBodyHandle,
    pub material: Material,
    pub bristle: Bristle,
}

impl Surface {
    /// The object as it stands, its body being `body`.
    pub fn object(&self, body: &RigidBody) -> Object {
        Object {
            pose: pose_back(body.position()) * self.body_from_surface,
            ..self.object.clone()
        }
    }

    /// Where the tip's ball is in the surface, if it is.
    pub fn contact(&self, body: &RigidBody, ball: &Ball, tip: &TipMotion) -> Option<Contact> {
        let tip_pose = glam::Pose::from_translation(vector(&tip.center_m));
        let surface_pose = *body.position() * pose_of(&self.body_from_surface);
        // The surface goes first: parry mirrors a half-space that comes second.
        let found = query::contact(&surface_pose, &*self.shape, &tip_pose, ball, 0.0);
        let found = found.ok().flatten()?;
        let depth_m = -found.dist;
        let normal = back(&found.normal1);
        // Halfway between the two surfaces.
        let point_m = back(&found.point2) + normal * (0.5 * depth_m);
        let lever = point_m - tip.center_m;
        let own = tip.linear_m_per_s + tip.angular_rad_per_s.cross(&lever);
        let other = back(&body.velocity_at_point(vector(&point_m)));
        (depth_m > 0.0).then_some(Contact {
            depth_m,
            normal,
            point_m,
            velocity_m_per_s: own - other,
        })
    }
}

/// Puts the scene into the world and lists its surfaces.
pub fn insert_scene(physics: &mut PhysicsWorld, scene: &Scene) -> Result<Vec<Surface>, SceneError> {
    let mut surfaces = Surfaces {
        scene,
        list: Vec::new(),
    };
    if let Some(ground) = &scene.ground {
        let pose = Pose::from_translation(Vector3::new(0.0, 0.0, ground.height_m));
        let body = physics.insert_body(RigidBodyBuilder::fixed().pose(pose_of(&pose)));
        let shape = SharedShape::halfspace(glam::Vector::Z);
        let what = ("ground", ObjectKind::Ground, Vector3::zeros());
        surfaces.add(what, shape, body, Pose::IDENTITY, &ground.material)?;
    }
    for block in &scene.fixed_blocks {
        let body = physics.insert_body(RigidBodyBuilder::fixed().pose(pose_of(&block.pose())));
        let size = Vector3::from(block.size_m);
        let what = (block.name.as_str(), ObjectKind::FixedBlock, size);
        surfaces.add_cuboid(what, body, &block.material, block.layer.as_ref())?;
    }
    for block in &scene.free_boxes {
        let size = Vector3::from(block.size_m);
        let square = size.component_mul(&size);
        let inertia = (Vector3::repeat(square.sum()) - square) * (block.mass_kg / 12.0);
        let zero = glam::Vector::ZERO;
        let properties = MassProperties::new(zero, block.mass_kg, vector(&inertia));
        let builder = RigidBodyBuilder::dynamic()
            .pose(pose_of(&block.pose()))
            .can_sleep(false)
            .additional_mass_properties(properties);
        let body = physics.insert_body(builder);
        let what = (block.name.as_str(), ObjectKind::FreeBox, size);
        surfaces.add_cuboid(what, body, &block.material, block.layer.as_ref())?;
    }
    // The engine's own contacts are between scene objects only, and some of these must move.
    if !scene.free_boxes.is_empty() {
        for surface in &surfaces.list {
            let collider = ColliderBuilder::new(surface.shape.clone())
                .position(pose_of(&surface.body_from_surface))
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
