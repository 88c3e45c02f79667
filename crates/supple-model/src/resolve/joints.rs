//! Moving joints: limits from both files, everything else from the TOML.

use super::entry_count::wrong_count;
use crate::error::{ModelError, Reporter};
use crate::settings::{HeldSettings, JointSettings, Settings};
use crate::tree::Chain;
use std::f64::consts::TAU;
use supple_core::Friction;
use urdf_rs::{JointType, Robot};

/// One moving joint with all defaults filled in; fields as in [`JointSettings`].
#[derive(Clone, Debug)]
pub(crate) struct JointResolved {
    pub name: String,
    pub held: Option<HeldSettings>,
    pub armature_kg_m2: f64,
    pub friction: Friction,
    pub position_lower_rad: f64,
    pub position_upper_rad: f64,
    pub speed_rad_per_s: f64,
    pub torque_nm: f64,
    pub home_rad: f64,
    pub gains: JointSettings,
}

/// Returns the moving joints in the chain's order.
pub(crate) fn joints(
    urdf: Reporter<'_>,
    toml: Reporter<'_>,
    settings: &Settings,
    robot: &Robot,
    chain: &Chain,
) -> Result<Vec<JointResolved>, ModelError> {
    if let Some(home) = &settings.home_rad
        && home.len() != chain.moving.len()
    {
        return Err(wrong_count(
            toml,
            "home_rad",
            home.len(),
            chain.moving.len(),
        ));
    }
    let resolved = chain.moving.iter().enumerate().map(|(i, moving)| {
        let joint = &robot.joints[moving.joint];
        let entry = settings
            .joints
            .iter()
            .find(|entry| entry.name == joint.name);
        let entry = entry
            .cloned()
            .unwrap_or_else(|| JointSettings::named(&joint.name));
        let home_rad = settings.home_rad.as_ref().map(|home| home[i]);
        self::joint(
            urdf,
            toml,
            joint,
            entry,
            home_rad,
            settings.limits.soft_zone_rad,
        )
    });
    resolved.collect()
}

/// Returns the pose without torque, within the joints' limits: it may lie in a soft zone, where the arm rests on a stop.
pub(crate) fn stow(
    toml: Reporter<'_>,
    settings: &Settings,
    joints: &[JointResolved],
) -> Result<Option<Vec<f64>>, ModelError> {
    let Some(stow) = &settings.stow_rad else {
        return Ok(None);
    };
    if stow.len() != joints.len() {
        return Err(wrong_count(toml, "stow_rad", stow.len(), joints.len()));
    }
    for (joint, angle_rad) in joints.iter().zip(stow) {
        let (lower, upper) = (joint.position_lower_rad, joint.position_upper_rad);
        if !(lower..=upper).contains(angle_rad) {
            return Err(toml.invalid(
                format!("stow_rad of joint `{}`", joint.name),
                "must be within the joint's limits",
                format!("{angle_rad} rad"),
                format!("give an angle from {lower} to {upper} rad"),
            ));
        }
    }
    Ok(Some(stow.clone()))
}

fn joint(
    urdf: Reporter<'_>,
    toml: Reporter<'_>,
    joint: &urdf_rs::Joint,
    entry: JointSettings,
    home_rad: Option<f64>,
    soft_zone_rad: f64,
) -> Result<JointResolved, ModelError> {
    let at = |key: &str| format!("[[joints]] `{}` {key}", entry.name);
    let (lower, upper) = position(urdf, toml, joint, &entry, soft_zone_rad)?;
    let within = |element: String, angle_rad: f64| {
        if (lower..=upper).contains(&angle_rad) {
            return Ok(());
        }
        Err(toml.invalid(
            element,
            "must be within the joint's limits",
            format!("{angle_rad} rad"),
            format!("give an angle from {lower} to {upper} rad"),
        ))
    };
    if let Some(held) = &entry.held {
        within(at("held.position_rad"), held.position_rad)?;
        toml.positive(&at("held.stiffness_nm_per_rad"), held.stiffness_nm_per_rad)?;
        toml.not_negative(&at("held.damping_nm_s_per_rad"), held.damping_nm_s_per_rad)?;
    }
    let home = home_rad.or(entry.held.map(|held| held.position_rad));
    let home = home.unwrap_or(0.5 * (lower + upper));
    let element = || format!("home_rad of joint `{}`", entry.name);
    within(element(), home)?;
    // The soft stop would push the arm away from a home pose inside its zone.
    let (inner_lower, inner_upper) = (lower + soft_zone_rad, upper - soft_zone_rad);
    if home_rad.is_some() && !(inner_lower..=inner_upper).contains(&home) {
        return Err(toml.invalid(
            element(),
            "must be outside the soft stops",
            format!("{home} rad"),
            format!(
                "give an angle from {inner_lower} to {inner_upper} rad, or make [limits] soft_zone_rad \
                 ({soft_zone_rad} rad) smaller"
            ),
        ));
    }
    let or_urdf = |key: &str, given: Option<f64>, attribute: &str, from_urdf: f64| match given {
        Some(value) => toml.positive(&at(key), value).map(|()| value),
        None if from_urdf > 0.0 && from_urdf.is_finite() => Ok(from_urdf),
        None => Err(urdf.invalid(
            format!("joint `{}` <limit {attribute}>", joint.name),
            "must be above zero",
            from_urdf,
            format!("give it here, or {key} in the TOML under [[joints]]"),
        )),
    };
    for (key, value) in [
        ("armature_kg_m2", entry.armature_kg_m2),
        ("soft_stiffness_nm_per_rad", entry.soft_stiffness_nm_per_rad),
        ("soft_damping_nm_s_per_rad", entry.soft_damping_nm_s_per_rad),
        ("move_damping_nm_s_per_rad", entry.move_damping_nm_s_per_rad),
        ("hold_damping_nm_s_per_rad", entry.hold_damping_nm_s_per_rad),
    ] {
        toml.not_negative(&at(key), value)?;
    }
    toml.positive(&at("torque_rate_nm_per_s"), entry.torque_rate_nm_per_s)?;
    toml.positive(
        &at("move_stiffness_nm_per_rad"),
        entry.move_stiffness_nm_per_rad,
    )?;
    Ok(JointResolved {
        name: joint.name.clone(),
        held: entry.held,
        armature_kg_m2: entry.armature_kg_m2,
        friction: friction(urdf, toml, joint, &entry)?,
        position_lower_rad: lower,
        position_upper_rad: upper,
        speed_rad_per_s: or_urdf(
            "speed_rad_per_s",
            entry.speed_rad_per_s,
            "velocity",
            joint.limit.velocity,
        )?,
        torque_nm: or_urdf("torque_nm", entry.torque_nm, "effort", joint.limit.effort)?,
        home_rad: home,
        gains: entry,
    })
}

/// Returns the hard stops of a joint: those of the URDF, which the TOML may narrow.
fn position(
    urdf: Reporter<'_>,
    toml: Reporter<'_>,
    joint: &urdf_rs::Joint,
    entry: &JointSettings,
    soft_zone_rad: f64,
) -> Result<(f64, f64), ModelError> {
    let continuous = joint.joint_type == JointType::Continuous;
    let (lower, upper) = if continuous {
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        (joint.limit.lower, joint.limit.upper)
    };
    if !(continuous || lower < upper) {
        return Err(urdf.invalid(
            format!("joint `{}` <limit>", joint.name),
            "a revolute joint must have lower below upper",
            format!("lower {lower}, upper {upper} rad"),
            "swap or correct them, or make the joint continuous",
        ));
    }
    let bound = |key: &str, given: Option<f64>, otherwise: f64| {
        let Some(value) = given else {
            return Ok(otherwise);
        };
        let element = format!("[[joints]] `{}` {key}", entry.name);
        toml.finite(&element, value)?;
        if (lower..=upper).contains(&value) {
            return Ok(value);
        }
        Err(toml.invalid(
            element,
            "may narrow the URDF's limits, not widen them",
            format!("{value} rad"),
            format!("give an angle from {lower} to {upper} rad"),
        ))
    };
    let lower = bound(
        "position_lower_rad",
        entry.position_lower_rad,
        lower.max(-TAU),
    )?;
    let upper = bound(
        "position_upper_rad",
        entry.position_upper_rad,
        upper.min(TAU),
    )?;
    if lower + 2.0 * soft_zone_rad < upper {
        return Ok((lower, upper));
    }
    Err(toml.invalid(
        format!("joint `{}` range of positions", entry.name),
        "must be wider than its two soft zones",
        format!("{lower} to {upper} rad with zones of {soft_zone_rad} rad"),
        "widen the range, or make [limits] soft_zone_rad smaller",
    ))
}

fn friction(
    urdf: Reporter<'_>,
    toml: Reporter<'_>,
    joint: &urdf_rs::Joint,
    entry: &JointSettings,
) -> Result<Friction, ModelError> {
    let (report, element, friction) = match (entry.friction, &joint.dynamics) {
        (Some(friction), _) => (
            toml,
            format!("[[joints]] `{}` friction", entry.name),
            Friction::from(friction),
        ),
        (None, Some(dynamics)) => (
            urdf,
            format!("joint `{}` <dynamics>", joint.name),
            Friction::coulomb(dynamics.damping, dynamics.friction),
        ),
        (None, None) => return Ok(Friction::NONE),
    };
    friction.validate().map_err(|error| {
        report.invalid(
            format!("{element} {}", error.entry),
            format!("must be {}", error.must),
            error.value,
            "correct it: invalid friction would add energy to the joint",
        )
    })?;
    Ok(friction)
}
