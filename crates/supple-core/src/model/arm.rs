//! The arm: a serial chain of `N` revolute joints, immutable once built.
//!
//! Each joint frame is rotated at construction so that the joint rotates about its own z axis; the
//! sweeps rely on it. Every public item states its frame: the *link frame* is the frame of the
//! description (for a URDF, the child link's frame), the *joint frame* is the rotated one. They
//! share their origin and differ by a constant rotation.

use crate::math::{Matrix3, Vector, Vector3, abs, sin_cos, sqrt};
use crate::model::body::{Body, BodyError};
use crate::model::link_rows::LinkRows;
use crate::model::pose::Pose;

pub use crate::model::link::Link;
use core::fmt;

/// One joint and the link that it moves, as given in the description.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Pose of this link's frame in the parent link's frame at `q = 0`.
    pub parent_from_link: Pose,
    /// Unit vector of the joint axis in the link frame.
    pub axis: Vector3<f64>,
    /// The link's inertial properties in the link frame.
    pub body: Body,
    /// Rotor inertia reflected to the joint \[kg m^2\], zero or more.
    pub armature_kg_m2: f64,
}

/// Error of building an arm. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArmError {
    /// The link moved by this joint is not a physical body.
    Body {
        /// Joint index.
        joint: usize,
        /// Problem.
        error: BodyError,
    },
    /// The tool is not a physical body.
    Tool(BodyError),
    /// The joint axis is not a unit vector.
    Axis {
        /// Joint index.
        joint: usize,
        /// Length found.
        length: f64,
    },
    /// The rotor inertia is negative or not finite \[kg m^2\].
    Armature {
        /// Joint index.
        joint: usize,
        /// Value found.
        value: f64,
    },
    /// A transform is not a finite rigid motion.
    Pose {
        /// Joint index; `N` for the tip.
        joint: usize,
        /// The first entry that is not finite, or the deviation of the rotation from orthogonality.
        value: f64,
    },
    /// A component of gravity is not finite \[m/s^2\].
    Gravity(f64),
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            ArmError::Body { joint, error } => write!(f, "link of joint {joint}: {error}"),
            ArmError::Tool(error) => write!(f, "tool: {error}"),
            ArmError::Axis { joint, length } => write!(
                f,
                "joint {joint}: axis has length {length}, it must be a unit vector"
            ),
            ArmError::Armature { joint, value } => write!(
                f,
                "joint {joint}: rotor inertia is {value} kg m^2, it must be finite and not negative"
            ),
            ArmError::Pose { joint, value } => write!(
                f,
                "origin of joint {joint}, counting the tip as the last: transform is not a finite \
                 rigid motion ({value})"
            ),
            ArmError::Gravity(value) => {
                write!(f, "gravity has an entry {value} m/s^2, it must be finite")
            }
        }
    }
}

impl core::error::Error for ArmError {}

/// Serial chain of `N` revolute joints with a tip frame on the last link.
#[derive(Clone, Copy, Debug)]
pub struct Arm<const N: usize> {
    pub(crate) links: [Link; N],
    pub(crate) armature: Vector<N>,
    pub(crate) joint_from_tip: Pose,
    pub(crate) gravity: Vector3<f64>,
    pub(crate) rows: LinkRows<N>,
}

impl<const N: usize> Arm<N> {
    /// Builds and validates an arm.
    ///
    /// `last_link_from_tip` places the tip frame on the last link; `tool` is a body in the tip frame
    /// welded to the last link; `gravity_m_per_s2` is the acceleration of free fall in base
    /// coordinates, usually `(0, 0, -9.81)`.
    ///
    /// # Errors
    /// [`ArmError`] names the joint and the value that is not physical.
    pub fn new(
        joints: &[Joint; N],
        last_link_from_tip: Pose,
        tool: Option<Body>,
        gravity_m_per_s2: Vector3<f64>,
    ) -> Result<Self, ArmError> {
        const { assert!(N > 0, "an arm has at least one joint") };
        check_gravity(&gravity_m_per_s2)?;
        check_pose(N, &last_link_from_tip)?;
        let mut armature = Vector::zeros();
        let mut links = [Link::EMPTY; N];
        let mut parent_link_from_joint = Pose::IDENTITY;
        for (i, joint) in joints.iter().enumerate() {
            check_pose(i, &joint.parent_from_link)?;
            let length = sqrt(joint.axis.dot(&joint.axis));
            if !length.is_finite() || abs(length - 1.0) > 1e-6 {
                return Err(ArmError::Axis { joint: i, length });
            }
            check_armature(i, joint.armature_kg_m2)?;
            joint
                .body
                .validate()
                .map_err(|error| ArmError::Body { joint: i, error })?;
            let mut body = joint.body;
            if i + 1 == N
                && let Some(tool) = tool
            {
                tool.validate().map_err(ArmError::Tool)?;
                body = body.merged(&tool.expressed_in(&last_link_from_tip));
            }
            let link_from_joint = Pose::z_onto(&(joint.axis / length));
            let body = body.expressed_in(&link_from_joint.inverse());
            // Inertias that pass the symmetry check are symmetrised exactly, because some sweeps
            // read one triangle and others the full matrix.
            let inertia = body.inertia_about_origin();
            armature[i] = joint.armature_kg_m2;
            links[i] = Link {
                parent_from_joint: parent_link_from_joint.inverse()
                    * joint.parent_from_link
                    * link_from_joint,
                mass: body.mass_kg,
                first_moment: body.com_m * body.mass_kg,
                inertia: (inertia + inertia.transpose()) * 0.5,
                link_from_joint: link_from_joint.rotation,
            };
            parent_link_from_joint = link_from_joint;
        }
        Ok(Self {
            links,
            armature,
            joint_from_tip: parent_link_from_joint.inverse() * last_link_from_tip,
            gravity: gravity_m_per_s2,
            rows: LinkRows::new(&links),
        })
    }

    /// Rebuilds an arm from the results of [`Arm::links`], [`Arm::armature`],
    /// [`Arm::joint_from_tip`] and [`Arm::gravity`], bit for bit. Log replay needs this, because
    /// [`Arm::new`] from the [bodies](Arm::body) rounds.
    ///
    /// # Errors
    /// [`ArmError`] names the joint and the value that is not physical.
    pub fn from_links(
        links: [Link; N],
        armature_kg_m2: Vector<N>,
        joint_from_tip: Pose,
        gravity_m_per_s2: Vector3<f64>,
    ) -> Result<Self, ArmError> {
        check_gravity(&gravity_m_per_s2)?;
        check_pose(N, &joint_from_tip)?;
        let arm = Self {
            links,
            armature: armature_kg_m2,
            joint_from_tip,
            gravity: gravity_m_per_s2,
            rows: LinkRows::new(&links),
        };
        for (i, link) in links.iter().enumerate() {
            check_pose(i, &link.parent_from_joint)?;
            let rotation = Pose {
                rotation: link.link_from_joint,
                ..Pose::IDENTITY
            };
            check_pose(i, &rotation)?;
            check_armature(i, armature_kg_m2[i])?;
            let body = arm.body(i).validate();
            body.map_err(|error| ArmError::Body { joint: i, error })?;
        }
        Ok(arm)
    }

    /// Returns the links in their joint frames; the last link includes the tool.
    pub fn links(&self) -> &[Link; N] {
        &self.links
    }

    /// Returns the acceleration of free fall in base coordinates \[m/s^2\].
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// Returns the rotor inertia of each joint \[kg m^2\].
    pub fn armature(&self) -> Vector<N> {
        self.armature
    }

    /// Returns the pose of joint frame `i` in joint frame `i - 1` (the base for `i = 0`) at `q = 0`; the joint rotates
    /// about its z axis.
    pub fn parent_from_joint(&self, i: usize) -> Pose {
        self.links[i].parent_from_joint
    }

    /// Returns the pose of joint frame `i` in joint frame `i - 1` at angle `q_rad`.
    pub fn parent_from_joint_at(&self, i: usize, q_rad: f64) -> Pose {
        let (s, c) = sin_cos(q_rad);
        let pose = self.links[i].parent_from_joint;
        Pose {
            rotation: pose.rotation * Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
            translation: pose.translation,
        }
    }

    /// Returns the rotation of joint frame `i` in link frame `i`: `z` is the joint axis in the link frame.
    pub fn link_from_joint(&self, i: usize) -> Matrix3<f64> {
        self.links[i].link_from_joint
    }

    /// Returns the body of link `i` in joint frame `i`; the last link includes the tool.
    pub fn body(&self, i: usize) -> Body {
        self.links[i].body()
    }

    /// Returns the pose of the tip frame in the last joint frame.
    pub fn joint_from_tip(&self) -> Pose {
        self.joint_from_tip
    }
}

fn check_gravity(gravity_m_per_s2: &Vector3<f64>) -> Result<(), ArmError> {
    let wrong = gravity_m_per_s2.iter().find(|g| !g.is_finite());
    wrong.map_or(Ok(()), |g| Err(ArmError::Gravity(*g)))
}

fn check_armature(joint: usize, value: f64) -> Result<(), ArmError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(ArmError::Armature { joint, value })
    }
}

fn check_pose(joint: usize, pose: &Pose) -> Result<(), ArmError> {
    let entries = pose.rotation.iter().chain(pose.translation.iter());
    if let Some(value) = entries.copied().find(|x| !x.is_finite()) {
        return Err(ArmError::Pose { joint, value });
    }
    let gram = pose.rotation.transpose() * pose.rotation - Matrix3::identity();
    let value = gram.iter().fold(0.0, |w: f64, x| w.max(abs(*x)));
    let right_handed = pose.rotation.determinant() > 0.0;
    if value > 1e-9 || !right_handed {
        return Err(ArmError::Pose { joint, value });
    }
    Ok(())
}
