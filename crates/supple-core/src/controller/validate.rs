//! Validation of a configuration.

use super::words::{JointLabel, NamesJoints};
use crate::config::{ApparentInertia, Config, Gains, PoseLaw, Role};
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector};
use crate::model::friction::FrictionError;
use crate::model::learned::LearnedBounds;
use crate::record::Text;
use core::fmt;

/// The invalid entry of a configuration. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfigError {
    /// Name of the entry.
    pub entry: &'static str,
    /// Joint index, if the entry has one value per joint.
    pub joint: Option<usize>,
    /// Value found.
    pub value: f64,
    /// Requirement.
    pub must: &'static str,
}

impl NamesJoints for ConfigError {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        let ConfigError {
            entry, value, must, ..
        } = self;
        match self.joint {
            Some(joint) => write!(
                f,
                "{entry} of {} is {value}, it must be {must}",
                label(joint)
            ),
            None => write!(f, "{entry} is {value}, it must be {must}"),
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

impl core::error::Error for ConfigError {}

const POSITIVE: &str = "finite and positive";
const NOT_NEGATIVE: &str = "finite and not negative";

fn check_positive(entry: &'static str, value: f64) -> Result<(), ConfigError> {
    check(
        value.is_finite() && value > 0.0,
        entry,
        None,
        value,
        POSITIVE,
    )
}

fn check_not_negative(entry: &'static str, value: f64) -> Result<(), ConfigError> {
    check(
        value.is_finite() && value >= 0.0,
        entry,
        None,
        value,
        NOT_NEGATIVE,
    )
}

fn check(
    valid: bool,
    entry: &'static str,
    joint: Option<usize>,
    value: f64,
    must: &'static str,
) -> Result<(), ConfigError> {
    if valid {
        Ok(())
    } else {
        Err(ConfigError {
            entry,
            joint,
            value,
            must,
        })
    }
}

fn check_each_joint<const N: usize>(
    entry: &'static str,
    values: &Vector<N>,
    zero_allowed: bool,
) -> Result<(), ConfigError> {
    for (joint, value) in values.iter().enumerate() {
        let result = if zero_allowed {
            check_not_negative(entry, *value)
        } else {
            check_positive(entry, *value)
        };
        result.map_err(|error| ConfigError {
            joint: Some(joint),
            ..error
        })?;
    }
    Ok(())
}

pub(super) fn gains(gains: &Gains, stiffness: f64, damping: f64) -> Result<(), ConfigError> {
    let within = |entry, value: f64, limit: f64| {
        check(
            value.is_finite() && (0.0..=limit).contains(&value),
            entry,
            None,
            value,
            "finite, not negative and within its limit",
        )
    };
    for axis in 0..3 {
        within(
            "stiffness_n_per_m",
            gains.stiffness_n_per_m[axis],
            stiffness,
        )?;
        within("damping_n_s_per_m", gains.damping_n_s_per_m[axis], damping)?;
    }
    Ok(())
}

fn pose<const N: usize>(pose: &PoseLaw<N>) -> Result<(), ConfigError> {
    let (stiffest, most) = (pose.max_stiffness_nm_per_rad, pose.max_damping_nm_s_per_rad);
    check_positive("rotational stiffness limit", stiffest)?;
    check_positive("rotational damping limit", most)?;
    for (entry, values, limit) in [
        (
            "rotational stiffness_nm_per_rad",
            &pose.gains.stiffness_nm_per_rad,
            stiffest,
        ),
        (
            "rotational damping_nm_s_per_rad",
            &pose.gains.damping_nm_s_per_rad,
            most,
        ),
    ] {
        for value in values {
            check(
                (0.0..=limit).contains(value),
                entry,
                None,
                *value,
                "finite, not negative and within its limit",
            )?;
        }
    }
    check_positive("angular_speed_rad_per_s", pose.angular_speed_rad_per_s)?;
    check_positive("rotation_error_rad", pose.rotation_error_rad)?;
    check_each_joint(
        "posture_stiffness_nm_per_rad",
        &pose.posture_stiffness_nm_per_rad,
        true,
    )?;
    check_each_joint("posture_torque_nm", &pose.posture_torque_nm, true)
}

/// Maximum compliance \[rad/(N m)\]: for softer joints a static correction of the angle is not sufficient.
const MAX_COMPLIANCE_RAD_PER_NM: f64 = 0.02;

pub(super) fn validate<const N: usize>(config: &Config<N>) -> Result<(), ConfigError> {
    let Config {
        law, latch, limits, ..
    } = config;
    for (joint, friction) in config.friction.iter().enumerate() {
        friction
            .validate()
            .map_err(|FrictionError { entry, value, must }| ConfigError {
                entry,
                joint: Some(joint),
                value,
                must,
            })?;
    }
    check_positive("soft_zone_rad", limits.soft_zone_rad)?;
    check_positive("stiffness limit", limits.stiffness_n_per_m)?;
    check_positive("damping limit", limits.damping_n_s_per_m)?;
    roles(config)?;
    let square = config.joint_from_motor * config.joint_from_motor.transpose();
    let scale = square.trace() / N as f64;
    // Without this shift, rounding could let a singular matrix pass the Cholesky decomposition.
    let shift = Matrix::from_diagonal_element(1e-12);
    check(
        scale.is_finite() && Cholesky::new(&(square / scale - shift)).is_some(),
        "joint_from_motor",
        None,
        scale,
        "an invertible matrix",
    )?;
    for (joint, value) in config.compliance_rad_per_nm.iter().enumerate() {
        check(
            (0.0..=MAX_COMPLIANCE_RAD_PER_NM).contains(value),
            "compliance_rad_per_nm",
            Some(joint),
            *value,
            "from 0 to 0.02",
        )?;
    }
    check_positive("period_s", config.period_s)?;
    check_positive("estimator_rad_per_s", config.estimator_rad_per_s)?;
    check_positive("handover_s", config.handover_s)?;
    gains(
        &law.gains,
        limits.stiffness_n_per_m,
        limits.damping_n_s_per_m,
    )?;
    if let ApparentInertia::Chosen(mass) = &law.inertia {
        let symmetric = (mass - mass.transpose()).iter().all(|x| *x == 0.0);
        check(
            symmetric && Cholesky::new(mass).is_some(),
            "apparent inertia",
            None,
            mass.determinant(),
            "symmetric and positive definite (the value is its determinant)",
        )?;
    }
    check_not_negative(
        "nullspace_damping_nm_s_per_rad",
        law.nullspace_damping_nm_s_per_rad,
    )?;
    check(
        law.presliding_share > 0.0 && law.presliding_share <= 1.0,
        "presliding_share",
        None,
        law.presliding_share,
        "above 0, at most 1",
    )?;
    check_positive("observer_rad_per_s", latch.observer_rad_per_s)?;
    check_positive("threshold_n", latch.threshold_n)?;
    check_not_negative("friction_error", latch.friction_error)?;
    check_not_negative("reversal_s", latch.reversal_s)?;
    check(
        (0.0..=1.0).contains(&latch.contact_share),
        "contact_share",
        None,
        latch.contact_share,
        "from 0 to 1",
    )?;
    check_positive("fade_s", latch.fade_s)?;
    check_positive("restore_s", latch.restore_s)?;
    check_not_negative("settle_s", latch.settle_s)?;
    for (name, value) in [
        ("false_alarms_per_hour", latch.false_alarms_per_hour),
        ("release_s", latch.release_s),
    ] {
        check(value > 0.0, name, None, value, "positive; infinite is off")?;
    }
    check_each_joint(
        "move stiffness_nm_per_rad",
        &config.move_gains.stiffness_nm_per_rad,
        false,
    )?;
    check_each_joint(
        "move damping_nm_s_per_rad",
        &config.move_gains.damping_nm_s_per_rad,
        true,
    )?;
    check_each_joint(
        "impedance_stiffness_nm_per_rad",
        &config.joint_gains.stiffness_nm_per_rad,
        true,
    )?;
    check_each_joint(
        "impedance_damping_nm_s_per_rad",
        &config.joint_gains.damping_nm_s_per_rad,
        true,
    )?;
    let stiffest = &config.move_gains.stiffness_nm_per_rad;
    for joint in 0..N {
        let value = config.joint_gains.stiffness_nm_per_rad[joint];
        check(
            value <= stiffest[joint],
            "impedance_stiffness_nm_per_rad",
            Some(joint),
            value,
            "at most the joint's move_stiffness_nm_per_rad",
        )?;
    }
    pose(&config.pose)?;
    check(
        (0.0..=1.0).contains(&config.float_friction_share),
        "float friction_share",
        None,
        config.float_friction_share,
        "from 0 to 1",
    )?;
    check_each_joint(
        "hold_damping_nm_s_per_rad",
        &config.hold_damping_nm_s_per_rad,
        true,
    )?;
    check_each_joint(
        "soft_stiffness_nm_per_rad",
        &limits.soft_stiffness_nm_per_rad,
        true,
    )?;
    check_each_joint(
        "soft_damping_nm_s_per_rad",
        &limits.soft_damping_nm_s_per_rad,
        true,
    )?;
    check_each_joint(
        "joint_speed_rad_per_s",
        &limits.joint_speed_rad_per_s,
        false,
    )?;
    check_each_joint("joint_torque_nm", &limits.joint_torque_nm, false)?;
    check_each_joint("motor_torque_nm", &limits.motor_torque_nm, false)?;
    check_each_joint("torque_rate_nm_per_s", &limits.torque_rate_nm_per_s, false)?;
    check_positive("tip_speed_m_per_s", limits.tip_speed_m_per_s)?;
    check_positive(
        "tip_acceleration_m_per_s2",
        limits.tip_acceleration_m_per_s2,
    )?;
    check_each_joint(
        "joint_acceleration_rad_per_s2",
        &limits.joint_acceleration_rad_per_s2,
        false,
    )?;
    check_each_joint(
        "joint_jerk_rad_per_s3",
        &limits.joint_jerk_rad_per_s3,
        false,
    )?;
    let collision = &config.collision;
    check_each_joint(
        "collision joint_torque_nm",
        &collision.joint_torque_nm,
        false,
    )?;
    check_positive("collision tip_force_n", collision.tip_force_n)?;
    let plausible = &config.plausible;
    check_positive("plausible stuck_rad", plausible.stuck_rad)?;
    check_positive("plausible against_share", plausible.against_share)?;
    check(
        plausible.stiction_factor.is_finite() && plausible.stiction_factor >= 1.0,
        "plausible stiction_factor",
        None,
        plausible.stiction_factor,
        "finite and at least 1",
    )?;
    check_positive("plausible load_n", plausible.load_n)?;
    check_each_joint(
        "collision move_joint_torque_nm",
        &collision.move_joint_torque_nm,
        false,
    )?;
    check_positive("collision move_tip_force_n", collision.move_tip_force_n)?;
    if let Some((entry, value, must)) = config.workspace.first_invalid() {
        return check(false, entry, None, value, must);
    }
    learned(config)?;
    check_positive("tracking_error_m", limits.tracking_error_m)?;
    check_positive("joint_tracking_error_rad", limits.joint_tracking_error_rad)?;
    check_positive("start_error_m", limits.start_error_m)
}

fn learned<const N: usize>(config: &Config<N>) -> Result<(), ConfigError> {
    let bounds = LearnedBounds::new(&config.friction, &config.limits.joint_torque_nm);
    let maps = config.learned.map.iter().enumerate();
    let checked = maps.fold(
        bounds
            .check(&config.learned.parameters)
            .map_err(|wrong| (None, wrong)),
        |checked, (joint, map)| {
            let in_map = || bounds.check_map(joint, map);
            checked.and_then(|()| in_map().map_err(|wrong| (Some(joint), wrong)))
        },
    );
    checked.map_err(|(joint, wrong)| ConfigError {
        entry: wrong.entry,
        joint,
        value: wrong.value,
        must: "within the bounds of what is learned",
    })
}

fn roles<const N: usize>(config: &Config<N>) -> Result<(), ConfigError> {
    let limits = &config.limits;
    let mut active = 0;
    for (joint, role) in config.roles.iter().enumerate() {
        let (lower, upper) = (
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
        );
        check(
            lower.is_finite() && upper.is_finite() && lower + 2.0 * limits.soft_zone_rad < upper,
            "position range",
            Some(joint),
            upper - lower,
            "finite and wider than its two soft zones",
        )?;
        let Role::Held {
            position_rad,
            stiffness_nm_per_rad,
            damping_nm_s_per_rad,
        } = *role
        else {
            active += 1;
            continue;
        };
        let at = |entry, valid, value, must| check(valid, entry, Some(joint), value, must);
        at(
            "held position_rad",
            (lower..=upper).contains(&position_rad),
            position_rad,
            "within the joint's position range",
        )?;
        at(
            "held stiffness_nm_per_rad",
            stiffness_nm_per_rad.is_finite() && stiffness_nm_per_rad > 0.0,
            stiffness_nm_per_rad,
            POSITIVE,
        )?;
        at(
            "held damping_nm_s_per_rad",
            damping_nm_s_per_rad.is_finite() && damping_nm_s_per_rad >= 0.0,
            damping_nm_s_per_rad,
            NOT_NEGATIVE,
        )?;
    }
    check(
        active >= 3,
        "number of active joints",
        None,
        f64::from(active),
        "at least 3, because the law controls the tip's position in three directions",
    )
}
