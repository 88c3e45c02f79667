//! Poses and shapes of the links, for drawing and for transform trees. The dynamics do not use them.
//!
//! Shapes are the `<visual>` primitives of the URDF: a cylinder or a capsule becomes a capsule along its axis,
//! a sphere becomes a capsule of zero length. Boxes and meshes have no capsule; viewers read them from the URDF.

use crate::tree::Chain;
use supple_core::Pose;
use supple_core::math::Vector3;
use urdf_rs::{Geometry, JointType, Robot};

/// A capsule fixed to a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// Moving joint of the link that carries the capsule, counted from the base; `None` for the base.
    pub joint: Option<usize>,
    /// Ends of the capsule's axis in that link's frame \[m\].
    pub ends_m: [Vector3<f64>; 2],
    /// Radius \[m\].
    pub radius_m: f64,
}

/// Pose of a URDF link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<'a> {
    /// Name of the parent link.
    pub parent: &'a str,
    /// Name of the link.
    pub child: &'a str,
    /// Frame of the link in the parent link's frame.
    pub parent_from_child: Pose,
}

pub(crate) fn capsules(robot: &Robot, chain: &Chain) -> Vec<Capsule> {
    let mut capsules = Vec::new();
    for placed in &chain.links {
        for visual in &robot.links[placed.link].visual {
            let (radius_m, length_m) = match visual.geometry {
                Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => {
                    (radius, length)
                }
                Geometry::Sphere { radius } => (radius, 0.0),
                Geometry::Box { .. } | Geometry::Mesh { .. } => continue,
            };
            let origin = Pose::from_xyz_rpy(visual.origin.xyz.0, visual.origin.rpy.0);
            let frame = placed.carrier_from_link * origin;
            let end = |z: f64| frame.transform_point(&Vector3::new(0.0, 0.0, z));
            capsules.push(Capsule {
                joint: placed.carrier,
                ends_m: [end(-0.5 * length_m), end(0.5 * length_m)],
                radius_m,
            });
        }
    }
    capsules
}

pub(crate) fn transforms<'a>(robot: &'a Robot, chain: &Chain, q_rad: &[f64]) -> Vec<Transform<'a>> {
    let angle = |index: usize| {
        let moving = chain.moving.iter().position(|moving| moving.joint == index);
        let frozen = || chain.frozen.get(&robot.joints[index].name).copied();
        moving.map(|i| q_rad[i]).or_else(frozen)
    };
    let is_moving = |index: usize| chain.moving.iter().any(|moving| moving.joint == index);
    let joints = robot.joints.iter().enumerate();
    joints
        .map(|(index, joint)| {
            let origin = Pose::from_xyz_rpy(joint.origin.xyz.0, joint.origin.rpy.0);
            let displaced = |position: f64| {
                let axis = Vector3::from(joint.axis.xyz.0);
                let axis = axis / supple_core::math::sqrt(axis.dot(&axis));
                origin
                    * match joint.joint_type {
                        JointType::Prismatic => Pose {
                            translation: axis * position,
                            ..Pose::IDENTITY
                        },
                        _ => crate::tree::turn(&axis, position),
                    }
            };
            // A joint at zero may have no axis.
            let is_displaced = |position: &f64| *position != 0.0 || is_moving(index);
            let turned = angle(index).filter(is_displaced).map(displaced);
            Transform {
                parent: &joint.parent.link,
                child: &joint.child.link,
                parent_from_child: turned.unwrap_or(origin),
            }
        })
        .collect()
}
