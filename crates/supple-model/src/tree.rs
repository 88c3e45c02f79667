//! The links and joints of a URDF as a tree, and the tree as a chain of moving bodies.
//!
//! The arm is the chain of movable joints from the root link to the tip frame. Links that are fixed to
//! another link, by a `fixed` joint or because their joint is frozen ([`crate::frozen`]), are lumped into it:
//! masses, first moments and inertias add, frames are composed. Links that are fixed to the base have no effect and are not read.
//! An inertia that no rigid body has is rejected on the path from the base to the tip, or replaced on request; on other
//! links it is always replaced, with a warning ([`crate::repair`]), as is a mass without inertia on a fixed link.

use crate::error::{Finding, ModelError, Reporter};
use crate::frozen::{self, FrozenJoints, is_revolute};
use crate::repair;
use std::cell::RefCell;
use std::collections::BTreeMap;
use supple_core::math::{Matrix3, Vector3, sin_cos};
use supple_core::{Body, Pose};
use urdf_rs::{JointType, Robot};

/// A movable joint of the chain, with the link that it moves.
#[derive(Clone, Debug)]
pub(crate) struct MovingJoint {
    /// Index in the URDF's list of joints.
    pub joint: usize,
    /// Frame of the link in the frame of the previous link, at zero angle.
    pub parent_from_link: Pose,
    /// Unit axis in the link frame.
    pub axis: Vector3<f64>,
    /// Inertia of the link and of all links lumped into it, in the link frame.
    pub body: Body,
}

/// A URDF link with its frame.
#[derive(Clone, Debug)]
pub(crate) struct PlacedLink {
    /// Index in the URDF's list of links.
    pub link: usize,
    /// Moving joint whose link carries this link, counted along the chain; `None` for the base.
    pub carrier: Option<usize>,
    /// Frame of this link in the frame of the carrier.
    pub carrier_from_link: Pose,
}

/// The chain from root to tip.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub moving: Vec<MovingJoint>,
    pub links: Vec<PlacedLink>,
    pub last_link_from_tip: Pose,
    /// Joints that do not move.
    pub frozen: FrozenJoints,
    /// Warnings about joints that were frozen and inertias that were replaced without a request.
    pub warnings: Vec<Finding>,
}

/// Settings of the TOML about the chain.
pub(crate) struct ChainSettings<'a> {
    pub tip_frame: &'a str,
    /// Joints that the TOML freezes, with their positions.
    pub fixed: &'a BTreeMap<String, f64>,
    /// Whether joints on the path to the tip may also be frozen.
    pub freeze_on_path: bool,
    /// Whether to replace every inertia that no rigid body has.
    pub repair: bool,
}

/// Reads the chain.
pub(crate) fn chain(
    report: Reporter<'_>,
    toml: Reporter<'_>,
    robot: &Robot,
    settings: &ChainSettings<'_>,
) -> Result<Chain, ModelError> {
    let tree = Tree::new(report, robot)?;
    let tip = tree
        .link(settings.tip_frame)
        .ok_or_else(|| no_tip(toml, robot, settings.tip_frame))?;
    let path = tree.path_to(tip);
    let (frozen, mut warnings) = frozen::frozen(
        report,
        robot,
        &path,
        settings.fixed,
        settings.freeze_on_path,
    );
    let on_chain = |joint: usize| {
        path.contains(&joint)
            && is_movable(&robot.joints[joint].joint_type)
            && !frozen.contains_key(&robot.joints[joint].name)
    };
    let on_path = |link: usize| tree.parent_joint[link].is_some_and(|joint| path.contains(&joint));
    let mut builder = Builder {
        tree: &tree,
        frozen: &frozen,
        on_chain: &on_chain,
        on_path: &on_path,
        repair: settings.repair,
        repaired: RefCell::default(),
        body: None,
        next: None,
        links: Vec::new(),
    };
    let mut moving: Vec<MovingJoint> = Vec::new();
    let (mut root, mut carrier) = (tree.root, None);
    loop {
        builder.body = None;
        builder.next = None;
        builder.lump(root, carrier)?;
        if let Some(index) = carrier {
            let joint: &mut MovingJoint = &mut moving[index];
            let Some(body) = builder.body else {
                return Err(report.invalid(
                    format!("link `{}`", robot.links[root].name),
                    "a moving link must have an <inertial>",
                    "none",
                    format!(
                        "give it mass, centre of mass and inertia, or fix joint `{}` under \
                         [fixed_joints_rad]",
                        robot.joints[joint.joint].name
                    ),
                ));
            };
            joint.body = body;
        }
        let Some((joint, parent_from_link)) = builder.next else {
            break;
        };
        moving.push(MovingJoint {
            joint,
            parent_from_link,
            axis: tree.axis(joint)?,
            body: Body::ball(1.0, 1.0, Vector3::zeros()),
        });
        root = tree.child[joint];
        carrier = Some(moving.len() - 1);
    }
    warnings.extend(builder.repaired.take());
    let links = builder.links;
    let last_link_from_tip = links
        .iter()
        .find(|placed| placed.link == tip)
        .map_or(Pose::IDENTITY, |placed| placed.carrier_from_link);
    Ok(Chain {
        moving,
        links,
        last_link_from_tip,
        frozen,
        warnings,
    })
}

/// Replaces the zero inertia of links with mass by the inertia of a solid ball of `radius_m`.
pub(crate) fn set_point_mass_inertia(robot: &mut Robot, radius_m: f64) {
    for link in &mut robot.links {
        let mass_kg = link.inertial.mass.value;
        let i = &mut link.inertial.inertia;
        if mass_kg > 0.0 && [i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz] == [0.0; 6] {
            let ball = Body::ball(mass_kg, radius_m, Vector3::zeros());
            [i.ixx, i.iyy, i.izz] = [ball.inertia_kg_m2[(0, 0)]; 3];
        }
    }
}

struct Tree<'a> {
    report: Reporter<'a>,
    robot: &'a Robot,
    root: usize,
    /// Link index of each joint's parent.
    parent: Vec<usize>,
    /// Link index of each joint's child.
    child: Vec<usize>,
    /// Child joints of each link.
    child_joints: Vec<Vec<usize>>,
    /// Parent joint of each link.
    parent_joint: Vec<Option<usize>>,
}

impl<'a> Tree<'a> {
    fn new(report: Reporter<'a>, robot: &'a Robot) -> Result<Self, ModelError> {
        let index: BTreeMap<&str, usize> = robot
            .links
            .iter()
            .map(|l| l.name.as_str())
            .zip(0..)
            .collect();
        let (mut parents, mut child) = (Vec::new(), Vec::new());
        let mut child_joints = vec![Vec::new(); robot.links.len()];
        let mut parent_joint: Vec<Option<usize>> = vec![None; robot.links.len()];
        for (j, joint) in robot.joints.iter().enumerate() {
            let find = |role: &str, link: &str| {
                index.get(link).copied().ok_or_else(|| {
                    report.invalid(
                        format!("joint `{}` <{role}>", joint.name),
                        "must name a link that exists",
                        format!("`{link}`"),
                        format!("add <link name=\"{link}\"/> or correct the name"),
                    )
                })
            };
            let parent = find("parent", &joint.parent.link)?;
            let own = find("child", &joint.child.link)?;
            if let Some(other) = parent_joint[own] {
                return Err(report.invalid(
                    format!("joint `{}` <child>", joint.name),
                    "a link may be the child of one joint only",
                    format!(
                        "`{}`, already the child of joint `{}`",
                        joint.child.link, robot.joints[other].name
                    ),
                    "remove one of the joints: closed loops are not supported",
                ));
            }
            parent_joint[own] = Some(j);
            child_joints[parent].push(j);
            parents.push(parent);
            child.push(own);
        }
        let roots: Vec<usize> = (0..robot.links.len())
            .filter(|l| parent_joint[*l].is_none())
            .collect();
        let names = |links: &[usize]| {
            let quoted = links.iter().map(|l| format!("`{}`", robot.links[*l].name));
            quoted.collect::<Vec<_>>().join(", ")
        };
        let root = match roots.as_slice() {
            [root] => *root,
            [] => {
                return Err(report.invalid(
                    "<robot>",
                    "one link must be the root, the child of no joint",
                    if robot.links.is_empty() {
                        "no link"
                    } else {
                        "a cycle through every link"
                    },
                    "open the cycle: remove the joint that leads back to the base",
                ));
            }
            several => {
                return Err(report.invalid(
                    format!("link `{}`", robot.links[several[1]].name),
                    "all links must be connected to one root",
                    format!("{} roots: {}", several.len(), names(several)),
                    "connect it with a joint or remove it",
                ));
            }
        };
        let tree = Self {
            report,
            robot,
            root,
            parent: parents,
            child,
            child_joints,
            parent_joint,
        };
        let mut reached = vec![false; robot.links.len()];
        let mut open = vec![root];
        while let Some(link) = open.pop() {
            reached[link] = true;
            open.extend(tree.child_joints[link].iter().map(|j| tree.child[*j]));
        }
        let lost: Vec<usize> = (0..reached.len()).filter(|l| !reached[*l]).collect();
        if !lost.is_empty() {
            return Err(report.invalid(
                format!("link `{}`", robot.links[lost[0]].name),
                "must be connected to the root",
                format!("a cycle of {}", names(&lost)),
                "open the cycle: remove the joint that leads back",
            ));
        }
        Ok(tree)
    }

    fn link(&self, name: &str) -> Option<usize> {
        self.robot.links.iter().position(|link| link.name == name)
    }

    /// Returns the joints from the root to the tip.
    fn path_to(&self, tip: usize) -> Vec<usize> {
        let mut path = Vec::new();
        let mut link = tip;
        while let Some(joint) = self.parent_joint[link] {
            path.push(joint);
            link = self.parent[joint];
        }
        path.reverse();
        path
    }

    /// Returns the unit axis of a movable joint. The URDF format requires axes of unit length; published ones are rounded,
    /// so any finite length above 1e-6 is scaled to 1.
    fn axis(&self, joint: usize) -> Result<Vector3<f64>, ModelError> {
        let joint = &self.robot.joints[joint];
        let axis = Vector3::from(joint.axis.xyz.0);
        let length = supple_core::math::sqrt(axis.dot(&axis));
        if length > 1e-6 && length.is_finite() {
            return Ok(axis / length);
        }
        Err(self.report.invalid(
            format!("joint `{}` <axis>", joint.name),
            "must have a length above 1e-6",
            format!("{:?}", joint.axis.xyz.0),
            "give the direction of the joint's rotation axis, such as xyz=\"0 0 1\"",
        ))
    }

    /// Returns the pose of the child link of a frozen joint at `position` (rad or m), relative to its pose at zero.
    fn displaced(&self, joint: usize, position: f64) -> Result<Pose, ModelError> {
        if position == 0.0 {
            return Ok(Pose::IDENTITY);
        }
        Ok(match self.robot.joints[joint].joint_type {
            JointType::Revolute | JointType::Continuous => turn(&self.axis(joint)?, position),
            JointType::Prismatic => Pose {
                translation: self.axis(joint)? * position,
                ..Pose::IDENTITY
            },
            _ => Pose::IDENTITY,
        })
    }

    /// Returns the unmodified inertial data of a link in its frame, and the pose of the centre of mass; `None` if there are no
    /// data.
    fn written_body(&self, link: usize) -> Option<(Body, Pose)> {
        let urdf_rs::Inertial {
            origin,
            mass,
            inertia: i,
        } = &self.robot.links[link].inertial;
        let entries = [i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz];
        // urdf-rs returns zeros for a missing <inertial>; an explicit all-zero one means the same.
        if mass.value == 0.0 && entries == [0.0; 6] {
            return None;
        }
        let body = Body {
            mass_kg: mass.value,
            com_m: Vector3::zeros(),
            #[rustfmt::skip]
            inertia_kg_m2: Matrix3::new(
                i.ixx, i.ixy, i.ixz,
                i.ixy, i.iyy, i.iyz,
                i.ixz, i.iyz, i.izz,
            ),
        };
        Some((body, Pose::from_xyz_rpy(origin.xyz.0, origin.rpy.0)))
    }

    fn inconsistent(&self, link: usize, body: &Body, error: &supple_core::BodyError) -> ModelError {
        let i = &body.inertia_kg_m2;
        let entries = [
            i[(0, 0)],
            i[(1, 1)],
            i[(2, 2)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 2)],
        ];
        self.report.invalid(
            format!("link `{}` <inertial>", self.robot.links[link].name),
            error.to_string(),
            format!(
                "mass {} kg, inertia (xx, yy, zz, xy, xz, yz) {entries:?}",
                body.mass_kg
            ),
            "give inertia about the centre of mass in kg m^2 and mass in kg, or remove \
             <inertial> from a link that has no mass; point_mass_radius_m gives a mass without \
             inertia that of a ball, --repair (repair_inertia = true in the TOML) the nearest one \
             that a rigid body can have",
        )
    }
}

struct Builder<'a, 'b> {
    tree: &'b Tree<'a>,
    frozen: &'b FrozenJoints,
    on_chain: &'b dyn Fn(usize) -> bool,
    /// For each link, whether it is on the path from the base to the tip.
    on_path: &'b dyn Fn(usize) -> bool,
    /// Whether to replace inconsistent inertias also on that path.
    repair: bool,
    /// Warnings about replaced inertias.
    repaired: RefCell<Vec<Finding>>,
    /// Sum of the bodies lumped into the current moving link.
    body: Option<Body>,
    /// Next joint of the chain, with the frame of its child link at zero angle.
    next: Option<(usize, Pose)>,
    links: Vec<PlacedLink>,
}

impl Builder<'_, '_> {
    /// Lumps the link `root` and all links fixed to it, parents before children.
    fn lump(&mut self, root: usize, carrier: Option<usize>) -> Result<(), ModelError> {
        // The traversal is iterative, because the file determines the nesting depth.
        let mut open = vec![(root, Pose::IDENTITY)];
        while let Some((link, carrier_from_link)) = open.pop() {
            let first = open.len();
            self.lump_one(link, carrier, carrier_from_link, &mut open)?;
            // The links are added in file order, on which the rounding of the mass sums depends.
            open[first..].reverse();
        }
        Ok(())
    }

    /// Lumps one link and adds the links fixed to it to `open`.
    fn lump_one(
        &mut self,
        link: usize,
        carrier: Option<usize>,
        carrier_from_link: Pose,
        open: &mut Vec<(usize, Pose)>,
    ) -> Result<(), ModelError> {
        self.links.push(PlacedLink {
            link,
            carrier,
            carrier_from_link,
        });
        // A link that is fixed to the base does not move and has no effect.
        if carrier.is_some()
            && let Some(body) = self.body(link)?
        {
            let body = body.expressed_in(&carrier_from_link);
            self.body = Some(self.body.map_or(body, |sum| sum.merged(&body)));
        }
        for joint in self.tree.child_joints[link].iter().copied() {
            let urdf = &self.tree.robot.joints[joint];
            let link_from_child =
                carrier_from_link * Pose::from_xyz_rpy(urdf.origin.xyz.0, urdf.origin.rpy.0);
            if (self.on_chain)(joint) {
                check_chain_joint(self.tree.report, urdf)?;
                self.next = Some((joint, link_from_child));
            } else if matches!(urdf.joint_type, JointType::Fixed) {
                open.push((self.tree.child[joint], link_from_child));
            } else {
                let position = self.frozen.get(&urdf.name).copied().unwrap_or_default();
                let moved = link_from_child * self.tree.displaced(joint, position)?;
                open.push((self.tree.child[joint], moved));
            }
        }
        Ok(())
    }

    /// Returns the inertia of a link in its frame; replaces an inertia that no rigid body has, where this is permitted.
    fn body(&self, link: usize) -> Result<Option<Body>, ModelError> {
        let Some((body, frame)) = self.tree.written_body(link) else {
            return Ok(None);
        };
        let Err(error) = body.validate() else {
            return Ok(Some(body.expressed_in(&frame)));
        };
        let moves = self.tree.parent_joint[link].is_some_and(|joint| (self.on_chain)(joint));
        let is_point = body.mass_kg > 0.0 && body.inertia_kg_m2 == Matrix3::zeros();
        if (self.on_path)(link) && !self.repair && (moves || !is_point) {
            return Err(self.tree.inconsistent(link, &body, &error));
        }
        let nearest = repair::nearest(&body);
        let name = &self.tree.robot.links[link].name;
        let finding = repair::finding(self.tree.report, name, &body, nearest.as_ref(), &error);
        self.repaired.borrow_mut().push(finding);
        Ok(nearest.map(|body| body.expressed_in(&frame)))
    }
}

fn no_tip(toml: Reporter<'_>, robot: &Robot, tip_frame: &str) -> ModelError {
    let names: Vec<&str> = robot.links.iter().map(|l| l.name.as_str()).collect();
    toml.invalid(
        "tip_frame",
        "must name a link of the URDF",
        format!("`{tip_frame}`"),
        format!("use one of {}", names.join(", ")),
    )
}

fn is_movable(kind: &JointType) -> bool {
    !matches!(kind, JointType::Fixed)
}

fn unsupported(report: Reporter<'_>, joint: &urdf_rs::Joint) -> ModelError {
    report.invalid(
        format!("joint `{}`", joint.name),
        "only revolute, continuous and fixed joints are supported",
        format!("{:?}", joint.joint_type).to_lowercase(),
        "fix it under [fixed_joints_rad] of the TOML (in m if it is prismatic), or take another tip_frame",
    )
}

fn check_chain_joint(report: Reporter<'_>, joint: &urdf_rs::Joint) -> Result<(), ModelError> {
    if !is_revolute(&joint.joint_type) {
        return Err(unsupported(report, joint));
    }
    if let Some(mimic) = &joint.mimic {
        return Err(report.invalid(
            format!("joint `{}` <mimic>", joint.name),
            "a mimic joint is not supported between root and tip",
            format!("`{}`", mimic.joint),
            "remove <mimic>, or fix the joint at an angle under [fixed_joints_rad]",
        ));
    }
    Ok(())
}

/// Returns the rotation about a unit axis.
pub(crate) fn turn(axis: &Vector3<f64>, angle_rad: f64) -> Pose {
    let onto = Pose::z_onto(axis);
    let (s, c) = sin_cos(angle_rad);
    let about_z = Pose {
        rotation: Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
        translation: Vector3::zeros(),
    };
    onto * about_z * onto.inverse()
}
