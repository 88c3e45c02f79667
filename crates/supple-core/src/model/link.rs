//! One link of an arm.

use crate::math::{Matrix3, Vector3};
use crate::model::body::{Body, steiner};
use crate::model::pose::Pose;

/// Inertial parameters and pose of a link in its joint frame, in the form that the sweeps use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Joint frame in the parent's joint frame at `q = 0`.
    pub parent_from_joint: Pose,
    /// Mass \[kg\].
    pub mass: f64,
    /// First moment of mass \[kg m\].
    pub first_moment: Vector3<f64>,
    /// Inertia about the joint frame's origin \[kg m^2\].
    pub inertia: Matrix3<f64>,
    /// Rotation of the joint frame in the link frame.
    pub link_from_joint: Matrix3<f64>,
}

impl Link {
    pub(crate) const EMPTY: Link = Link {
        parent_from_joint: Pose::IDENTITY,
        mass: 0.0,
        first_moment: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        link_from_joint: Pose::IDENTITY.rotation,
    };

    /// Returns the body with its inertia about the centre of mass, in the joint frame.
    pub(crate) fn body(&self) -> Body {
        let com_m = self.first_moment / self.mass;
        Body {
            mass_kg: self.mass,
            com_m,
            inertia_kg_m2: self.inertia - steiner(self.mass, &com_m),
        }
    }
}
