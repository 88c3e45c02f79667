//! Checks the TOML against the kinematic chain: all numbers validated, all defaults filled in, everything in
//! chain order.

mod bus;
mod entry_count;
mod hardware;
mod joints;

pub(crate) use bus::bus;
pub use bus::{BusDescription, BusMotor};
pub use hardware::{Motors, Tool};
pub(crate) use hardware::{motors, tool};
pub(crate) use joints::{JointResolved, joints, stow};

use crate::error::{ModelError, Reporter};
use crate::settings::Settings;
use std::collections::BTreeSet;
use supple_core::math::Matrix3;
use urdf_rs::{JointType, Robot};

/// Maximum magnitude of gravity along each axis, above that of any solid planet \[m/s^2\].
const MAX_GRAVITY_M_PER_S2: f64 = 30.0;
/// Allowed cycle periods, 10 kHz to 10 Hz \[s\].
const PERIODS_S: core::ops::RangeInclusive<f64> = 1e-4..=0.1;
/// Maximum magnitude of a given angle: ten turns \[rad\].
const MAX_GIVEN_ANGLE_RAD: f64 = 63.0;

/// Rejects unknown joint names under `[fixed_joints_rad]` and `[[joints]]`. Runs before the chain is read, so that
/// a misspelt name is not reported as a movable branch.
pub(crate) fn check_names(
    report: Reporter<'_>,
    settings: &Settings,
    robot: &Robot,
) -> Result<(), ModelError> {
    let movable: Vec<&urdf_rs::Joint> = robot
        .joints
        .iter()
        .filter(|joint| !matches!(joint.joint_type, JointType::Fixed))
        .collect();
    let names: Vec<&str> = movable.iter().map(|joint| joint.name.as_str()).collect();
    let unknown = |element: String, name: &str| {
        report.invalid(
            element,
            "must name a movable joint of the URDF",
            format!("`{name}`"),
            format!("use one of {}", names.join(", ")),
        )
    };
    for (name, angle_rad) in &settings.fixed_joints_rad {
        let element = format!("[fixed_joints_rad] {name}");
        let joint = movable.iter().find(|joint| joint.name == *name);
        let joint = joint.ok_or_else(|| unknown(element.clone(), name))?;
        report.finite(&element, *angle_rad)?;
        report.within(
            &element,
            *angle_rad,
            -MAX_GIVEN_ANGLE_RAD..=MAX_GIVEN_ANGLE_RAD,
            "rad",
        )?;
        let limited = matches!(joint.joint_type, JointType::Revolute);
        let (lower, upper) = (joint.limit.lower, joint.limit.upper);
        if limited && lower < upper && !(lower..=upper).contains(angle_rad) {
            return Err(report.invalid(
                element,
                "must be within the joint's limits",
                format!("{angle_rad} rad"),
                format!("give an angle from {lower} to {upper} rad"),
            ));
        }
    }
    let mut seen = BTreeSet::new();
    for joint in &settings.joints {
        let element = format!("[[joints]] `{}`", joint.name);
        if !names.contains(&joint.name.as_str()) {
            return Err(unknown(element, &joint.name));
        }
        if settings.fixed_joints_rad.contains_key(&joint.name) {
            return Err(report.invalid(
                element,
                "a joint must be either fixed or moving",
                "an entry under [fixed_joints_rad] too",
                "remove one of the two",
            ));
        }
        if !seen.insert(&joint.name) {
            return Err(report.invalid(element, "one entry per joint", "two", "merge them"));
        }
    }
    Ok(())
}

/// Checks the numbers that apply to the whole arm.
pub(crate) fn check_rest(report: Reporter<'_>, settings: &Settings) -> Result<(), ModelError> {
    let (law, latch, limits) = (&settings.law, &settings.latch, &settings.limits);
    for (axis, g) in settings.gravity_m_per_s2.iter().enumerate() {
        let element = format!("gravity_m_per_s2[{axis}]");
        report.finite(&element, *g)?;
        report.within(
            &element,
            *g,
            -MAX_GRAVITY_M_PER_S2..=MAX_GRAVITY_M_PER_S2,
            "m/s^2",
        )?;
    }
    report.positive("period_s", settings.period_s)?;
    report.within("period_s", settings.period_s, PERIODS_S, "s")?;
    for (element, value) in [
        ("estimator_rad_per_s", settings.estimator_rad_per_s),
        ("handover_s", settings.handover_s),
        ("[limits] soft_zone_rad", limits.soft_zone_rad),
        ("[limits] tip_speed_m_per_s", limits.tip_speed_m_per_s),
        ("[limits] tracking_error_m", limits.tracking_error_m),
        (
            "[limits] joint_tracking_error_rad",
            limits.joint_tracking_error_rad,
        ),
        ("[limits] start_error_m", limits.start_error_m),
        (
            "[limits] max_stiffness_n_per_m",
            limits.max_stiffness_n_per_m,
        ),
        (
            "[limits] max_damping_n_s_per_m",
            limits.max_damping_n_s_per_m,
        ),
        ("[latch] observer_rad_per_s", latch.observer_rad_per_s),
        ("[latch] threshold_n", latch.threshold_n),
        ("[latch] fade_s", latch.fade_s),
        ("[latch] restore_s", latch.restore_s),
    ] {
        report.positive(element, value)?;
    }
    let (stiffness, damping) = (limits.max_stiffness_n_per_m, limits.max_damping_n_s_per_m);
    for (element, values, limit, key) in [
        (
            "[law] stiffness_n_per_m",
            law.stiffness_n_per_m,
            stiffness,
            "max_stiffness_n_per_m",
        ),
        (
            "[law] damping_n_s_per_m",
            law.damping_n_s_per_m,
            damping,
            "max_damping_n_s_per_m",
        ),
    ] {
        for (axis, value) in values.iter().enumerate() {
            let element = format!("{element}[{axis}]");
            report.not_negative(&element, *value)?;
            if *value > limit {
                return Err(report.invalid(
                    element,
                    format!("must be at most [limits] {key}, {limit}"),
                    value,
                    "lower it, or raise the limit if the arm is known to be stable there",
                ));
            }
        }
    }
    for (element, value) in [
        (
            "[law] nullspace_damping_nm_s_per_rad",
            law.nullspace_damping_nm_s_per_rad,
        ),
        ("[latch] friction_error", latch.friction_error),
        ("[latch] reversal_s", latch.reversal_s),
        ("[latch] settle_s", latch.settle_s),
    ] {
        report.not_negative(element, value)?;
    }
    for (element, value) in [
        ("[latch] false_alarms_per_hour", latch.false_alarms_per_hour),
        ("[latch] release_s", latch.release_s),
    ] {
        if value.is_nan() || value <= 0.0 {
            return Err(report.invalid(
                element,
                "must be positive",
                value,
                "give a positive number, or inf for none",
            ));
        }
    }
    if !(0.0..=1.0).contains(&latch.contact_share) {
        return Err(report.invalid(
            "[latch] contact_share",
            "must be a fraction, 0 to 1",
            latch.contact_share,
            "give the part of the dry-friction feed-forward that remains in contact",
        ));
    }
    if let Some(rows) = law.apparent_inertia_kg {
        let m = Matrix3::from_fn(|i, j| rows[i][j]);
        if !(m.iter().all(|x| x.is_finite()) && m == m.transpose() && m.cholesky().is_some()) {
            return Err(report.invalid(
                "[law] apparent_inertia_kg",
                "must be symmetric and positive definite",
                format!("{rows:?}"),
                "give a symmetric matrix in kg, or leave it out for the arm's own",
            ));
        }
    }
    Ok(())
}
