//! The active configuration as TOML, bit-exact in both directions: numbers are printed with enough digits.
//!
//! The active configuration may differ from the TOML of the arm: a perturbed or identified model, other gains, another law.
//! Links are in joint frames, as in [`Arm::links`].

use crate::toml_types::{
    CollisionDef, ContactLatchDef, FrictionDef, JointGainsDef, LawDef, LimitsDef, LinkDef,
    PlausibilityDef, PoseDef, PoseLawDef, RippleDef, RoleDef, WorkspaceDef, column, rows,
};
use serde::{Deserialize, Serialize};
use supple_core::config::{
    Collision, ContactLatch, JointGains, JointNames, Law, Limits, PlausibilityLimits, PoseLaw,
    Role, Workspace,
};
use supple_core::learned::LearnedTerms;
use supple_core::math::Vector3;
use supple_core::{Arm, Config, Friction, Link, Matrix, Pose, Vector};
use supple_model::LearnedSettings;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredConfig<const N: usize> {
    period_s: f64,
    estimator_rad_per_s: f64,
    handover_s: f64,
    #[serde(with = "column")]
    hold_damping_nm_s_per_rad: Vector<N>,
    /// Older logs have a gravity hold without position loops.
    #[serde(default)]
    hold_pose: bool,
    #[serde(with = "rows")]
    joint_from_motor: Matrix<N, N>,
    #[serde(with = "column")]
    gravity_m_per_s2: Vector3<f64>,
    #[serde(with = "PoseDef")]
    last_joint_from_tip: Pose,
    #[serde(with = "LawDef")]
    law: Law,
    /// Harmonics of the motors' torque ripple.
    #[serde(default)]
    ripple: Vec<RippleDef>,
    #[serde(with = "ContactLatchDef")]
    latch: ContactLatch,
    /// Terms in force at the start, if any; older logs have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    learned: Option<LearnedSettings>,
    /// Compliance of the joints, if any; older logs have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    compliance_rad_per_nm: Option<Vec<f64>>,
    #[serde(with = "JointGainsDef")]
    move_gains: JointGains<N>,
    /// Older logs have neither joint impedance nor float.
    #[serde(with = "JointGainsDef", default = "JointGains::zero")]
    joint_gains: JointGains<N>,
    #[serde(default)]
    float_friction_share: f64,
    /// Older logs have no pose mode.
    #[serde(with = "PoseLawDef", default)]
    pose: PoseLaw<N>,
    #[serde(with = "LimitsDef")]
    limits: Limits<N>,
    /// Older logs have no collision thresholds.
    #[serde(default)]
    collision: Option<CollisionDef<N>>,
    #[serde(with = "PlausibilityDef", default = "PlausibilityLimits::disabled")]
    plausible: PlausibilityLimits,
    #[serde(default)]
    workspace: Option<WorkspaceDef>,
    joints: Vec<StoredJoint>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredJoint {
    /// Older logs have no names here.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    armature_kg_m2: f64,
    #[serde(with = "RoleDef")]
    role: Role,
    #[serde(with = "FrictionDef")]
    friction: Friction,
    #[serde(with = "LinkDef")]
    link: Link,
}

pub(crate) fn to_toml<const N: usize>(config: &Config<N>) -> Result<String, toml::ser::Error> {
    let Config {
        joint_names,
        arm,
        friction,
        roles,
        joint_from_motor,
        ripple,
        learned,
        compliance_rad_per_nm,
        period_s,
        estimator_rad_per_s,
        law,
        latch,
        move_gains,
        joint_gains,
        pose,
        float_friction_share,
        hold_damping_nm_s_per_rad,
        hold_pose,
        handover_s,
        limits,
        collision,
        plausible,
        workspace,
    } = *config;
    let stored = StoredConfig {
        period_s,
        estimator_rad_per_s,
        handover_s,
        hold_damping_nm_s_per_rad,
        hold_pose,
        joint_from_motor,
        gravity_m_per_s2: arm.gravity(),
        last_joint_from_tip: arm.joint_from_tip(),
        law,
        ripple: RippleDef::list(&ripple),
        learned: (learned != LearnedTerms::zero()).then(|| LearnedSettings::new(&learned)),
        compliance_rad_per_nm: (compliance_rad_per_nm != Vector::<N>::zeros())
            .then(|| compliance_rad_per_nm.iter().copied().collect()),
        latch,
        move_gains,
        joint_gains,
        float_friction_share,
        pose,
        limits,
        collision: Some(CollisionDef::new(&collision)),
        plausible,
        workspace: Some(WorkspaceDef::new(&workspace)),
        joints: (0..N)
            .map(|i| StoredJoint {
                name: joint_names.as_slice()[i].as_str().to_owned(),
                armature_kg_m2: arm.armature()[i],
                role: roles[i],
                friction: friction[i],
                link: arm.links()[i],
            })
            .collect(),
    };
    toml::to_string(&stored as &dyn erased_serde::Serialize)
}

/// # Errors
/// Description of the problem.
pub(crate) fn from_toml<const N: usize>(text: &str) -> Result<Config<N>, String> {
    // Parse into a table first: for each number of joints, the deserializer of tables compiles to less code than that of text.
    let table: toml::Table = toml::from_str(text).map_err(|error| error.to_string())?;
    let stored: StoredConfig<N> = table.try_into().map_err(|error| error.to_string())?;
    let joints: [StoredJoint; N] =
        stored
            .joints
            .try_into()
            .map_err(|joints: Vec<StoredJoint>| {
                format!(
                    "the configuration has {} joints, expected {N}",
                    joints.len()
                )
            })?;
    let arm = Arm::from_links(
        joints.each_ref().map(|joint| joint.link),
        Vector::from_fn(|i, _| joints[i].armature_kg_m2),
        stored.last_joint_from_tip,
        stored.gravity_m_per_s2,
    );
    let names = joints.each_ref().map(|joint| joint.name.as_str());
    Ok(Config {
        joint_names: JointNames::new(&names),
        arm: arm.map_err(|error| error.to_string())?,
        friction: joints.each_ref().map(|joint| joint.friction),
        roles: joints.each_ref().map(|joint| joint.role),
        joint_from_motor: stored.joint_from_motor,
        ripple: RippleDef::tables(&stored.ripple)?,
        learned: match &stored.learned {
            Some(learned) => learned.terms()?,
            None => LearnedTerms::zero(),
        },
        compliance_rad_per_nm: match &stored.compliance_rad_per_nm {
            Some(values) if values.len() == N => Vector::from_column_slice(values),
            Some(values) => {
                return Err(format!(
                    "compliance_rad_per_nm has {} values for {N} joints",
                    values.len()
                ));
            }
            None => Vector::zeros(),
        },
        period_s: stored.period_s,
        estimator_rad_per_s: stored.estimator_rad_per_s,
        law: stored.law,
        latch: stored.latch,
        move_gains: stored.move_gains,
        joint_gains: stored.joint_gains,
        pose: stored.pose,
        float_friction_share: stored.float_friction_share,
        hold_damping_nm_s_per_rad: stored.hold_damping_nm_s_per_rad,
        hold_pose: stored.hold_pose,
        handover_s: stored.handover_s,
        limits: stored.limits,
        collision: match &stored.collision {
            Some(collision) => collision.collision(),
            None => Collision::disabled(),
        },
        plausible: stored.plausible,
        workspace: match &stored.workspace {
            Some(workspace) => workspace.workspace()?,
            None => Workspace::UNBOUNDED,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::RippleTable;
    use supple_core::config::{ApparentInertia, Border, FrictionVelocity, Zone};
    use supple_core::math::Matrix3;
    use supple_core::ripple::Harmonic;
    use supple_model::Description;

    fn round_trip<const N: usize>(config: &Config<N>) {
        let text = to_toml(config).expect("writes");
        let again = from_toml::<N>(&text).expect("reads");
        // Debug format prints the shortest unique decimal of every number: equal texts mean equal bits.
        assert_eq!(format!("{again:?}"), format!("{config:?}"), "{text}");
    }

    #[test]
    fn the_configuration_of_every_built_in_arm_is_read_back_bit_exactly() {
        round_trip(&config::<3>("paper3"));
        round_trip(&config::<4>("wam4"));
        round_trip(&config::<7>("wam7"));
    }

    #[test]
    fn every_option_of_the_law_is_read_back_bit_exactly() {
        let mut config = config::<4>("wam4");
        config.law.inertia = ApparentInertia::Chosen(Matrix3::new(
            2.0,
            0.1,
            -0.0,
            0.1,
            3.0,
            1e-300,
            -0.0,
            1e-300,
            1.0 / 3.0,
        ));
        config.law.friction_velocity = FrictionVelocity::Measured;
        config.law.measured_stribeck = true;
        config.law.presliding_share = 1.0 / 3.0;
        config.law.inertial_feedforward = false;
        config.latch.fade = false;
        config.friction[2].offset_nm = f64::from_bits(0x3fb9_9999_9999_999b);
        config.friction[2].breakaway_nm = config.friction[2].coulomb_nm + 0.5;
        config.friction[2].stribeck_offset_nm = -1.0 / 3.0;
        let line = |harmonic| Harmonic {
            harmonic,
            sine_nm: 1.0 / 3.0,
            cosine_nm: -0.0,
            sine_share: 0.01,
            cosine_share: -0.02,
        };
        config.workspace = Workspace {
            borders: core::array::from_fn(|i| match i {
                0 => Some(Border::Wall {
                    normal: Vector3::new(0.6, 0.0, -0.8),
                    offset_m: 1.0 / 3.0,
                }),
                1 => Some(Border::KeepOut {
                    lower_m: Vector3::new(-0.1, -0.2, -0.3),
                    upper_m: Vector3::new(0.1, 0.2, 0.3),
                }),
                _ => None,
            }),
            zones: core::array::from_fn(|i| {
                (i == 0).then_some(Zone {
                    lower_m: Vector3::repeat(-1.0),
                    upper_m: Vector3::repeat(1.0),
                    tip_speed_m_per_s: 0.25,
                    tip_force_n: f64::MAX,
                })
            }),
            ..config.workspace
        };
        config.learned.parameters.tilt_rad.y = 1.0 / 3.0;
        config.learned.map[3].dry_nm[15] = -0.0;
        config.ripple[1] = RippleTable::new(&[line(2), line(42)]).expect("a table");
        round_trip(&config);
    }

    #[test]
    fn a_wrong_number_of_joints_and_an_unknown_key_are_rejected() {
        let text = to_toml(&config::<4>("wam4")).expect("writes");
        assert!(from_toml::<3>(&text).is_err());
        assert!(from_toml::<4>(&format!("stiff = 1\n{text}")).is_err());
    }

    fn config<const N: usize>(arm: &str) -> Config<N> {
        let description = Description::asset(arm).expect("a built-in arm");
        description.config().expect("its configuration")
    }
}
