//! Movable joints that are frozen: joints that the TOML fixes, joints that are not on the path from the base to the tip, and, if
//! the TOML has no entry about single joints, joints on the path that no controller moves (prismatic joints, mimics, and the
//! first joints of a chain of more than seven).
//!
//! Each frozen joint stays at the angle that the TOML gives, otherwise at zero or at the end of its range that is closest to
//! zero; one warning lists the joints of each kind.

use crate::error::{Finding, Reporter};
use std::collections::BTreeMap;
use urdf_rs::{JointType, Robot};

/// Positions of the frozen joints by name \[rad, m for a prismatic joint\].
pub(crate) type FrozenJoints = BTreeMap<String, f64>;

/// Maximum number of moving joints.
const MAX_MOVING: usize = 7;

/// Returns the frozen joints: the joints `given` by the TOML and those that this function finds. `path` are the joints from the
/// root to the tip, in order; `on_path` permits freezing some of them.
pub(crate) fn frozen(
    report: Reporter<'_>,
    robot: &Robot,
    path: &[usize],
    given: &BTreeMap<String, f64>,
    on_path: bool,
) -> (FrozenJoints, Vec<Finding>) {
    let mut frozen = given.clone();
    let mut warnings = Vec::new();
    let is_free = |joint: usize| {
        let joint = &robot.joints[joint];
        joint.joint_type != JointType::Fixed && !given.contains_key(&joint.name)
    };
    let free_on_path = || {
        path.iter()
            .copied()
            .filter(|joint| on_path && is_free(*joint))
    };
    let cannot_move = |joint: &usize| {
        let joint = &robot.joints[*joint];
        joint.mimic.is_some() || !is_revolute(&joint.joint_type)
    };
    let moving: Vec<usize> = free_on_path().filter(|joint| !cannot_move(joint)).collect();
    let surplus = moving.len().saturating_sub(MAX_MOVING);
    let beside: Vec<usize> = (0..robot.joints.len())
        .filter(|joint| !path.contains(joint) && is_free(*joint))
        .collect();
    let kinds = [
        (beside, "does not carry the tip"),
        (
            free_on_path().filter(cannot_move).collect(),
            "is prismatic or a mimic, which no controller here moves",
        ),
        (
            moving[..surplus].to_vec(),
            "is one more than the seven joints that a controller here moves",
        ),
    ];
    for (joints, why) in kinds {
        let mut places: Vec<String> = Vec::new();
        for joint in joints {
            let joint = &robot.joints[joint];
            let position = resting_position(joint);
            places.push(format!("`{}` at {position}", joint.name));
            frozen.insert(joint.name.clone(), position);
        }
        if let Some(first) = places.first() {
            let name = first.split(" at ").next().unwrap_or_default();
            warnings.push(Finding {
                file: report.file.to_owned(),
                element: format!("joint {name}"),
                problem: format!("it {why}, it is frozen"),
                value: places.join(", "),
                remedy: "give other positions under [fixed_joints_rad] of the TOML (m for a prismatic joint)"
                    .to_owned(),
            });
        }
    }
    (frozen, warnings)
}

/// Returns whether a controller can move the joint.
pub(crate) fn is_revolute(kind: &JointType) -> bool {
    matches!(kind, JointType::Revolute | JointType::Continuous)
}

/// Returns zero, or the end of the joint's range that is closest to zero.
fn resting_position(joint: &urdf_rs::Joint) -> f64 {
    let (lower, upper) = (joint.limit.lower, joint.limit.upper);
    match joint.joint_type {
        JointType::Revolute | JointType::Prismatic if lower < upper => 0.0_f64.clamp(lower, upper),
        _ => 0.0,
    }
}
