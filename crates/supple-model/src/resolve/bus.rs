//! The drives' bus: `[bus]`, checked against the chain.

use super::entry_count::wrong_count;
use super::joints::JointResolved;
use crate::bus_settings::{BusFormat, BusKind, BusMotorSettings, BusSettings};
use crate::error::{ModelError, Reporter};
use crate::settings::Settings;

/// Ids that a motor can listen to: its feedback carries four bits of them.
const IDS: core::ops::RangeInclusive<u16> = 1..=15;
/// Ids of replies: above all ids that motors listen to, below that of register frames.
const REPLY_IDS: core::ops::RangeInclusive<u16> = 0x10..=0x7FE;
/// Watchdog of the motors \[s\]: longer than the longest cycle, shorter than a fall of 5 mm from rest.
const WATCHDOG_S: core::ops::RangeInclusive<f64> = 0.001..=0.4;
/// Temperatures \[degrees Celsius\]: motors switch themselves off above.
const CELSIUS: core::ops::RangeInclusive<f64> = 0.0..=150.0;

/// Drives of an arm as its bus addresses them, in the order of the joints.
#[derive(Clone, Debug, PartialEq)]
pub struct BusDescription {
    /// Type of the drives.
    pub kind: BusKind,
    /// Frames of the bus.
    pub format: BusFormat,
    /// Bit rate of the arbitration phase \[bit/s\].
    pub bit_rate: u32,
    /// Bit rate of the data phase of FD frames \[bit/s\].
    pub data_bit_rate: u32,
    /// Silence of the host after which a motor switches its torque off \[s\].
    pub watchdog_s: f64,
    /// Temperature of the warning \[degrees Celsius\].
    pub warning_celsius: f64,
    /// Temperature from which the torque limit decreases \[degrees Celsius\].
    pub derating_celsius: f64,
    /// Temperature that is a fault \[degrees Celsius\].
    pub fault_celsius: f64,
    /// Motors, one per joint.
    pub motors: Vec<BusMotor>,
}

/// A motor of a bus; the ranges are expectations.
#[derive(Clone, Debug, PartialEq)]
pub struct BusMotor {
    /// Joint that it moves.
    pub joint: String,
    /// Type, for messages.
    pub model: String,
    /// Id that it listens to, 1 to 15.
    pub id: u16,
    /// Id of its replies.
    pub reply_id: u16,
    /// Gear ratio.
    pub gear_ratio: f64,
    /// Range of positions \[rad\].
    pub position_range_rad: f64,
    /// Range of velocities \[rad/s\].
    pub velocity_range_rad_per_s: f64,
    /// Range of torques \[N m\].
    pub torque_range_nm: f64,
    /// Beginning of its firmware version; `None` for any.
    pub firmware_series: Option<String>,
    /// 1 if it turns as the joint, else -1.
    pub direction: f64,
    /// Angle of the joint where its position is zero \[rad\].
    pub zero_offset_rad: f64,
    /// Its torque over the commanded one.
    pub torque_scale: f64,
    /// Damping that it adds while it holds or stows \[N m s/rad\].
    pub hold_damping_nm_s_per_rad: f64,
    /// Whether it may lack a watchdog.
    pub without_watchdog: bool,
}

/// Returns the bus of the TOML, if it has one.
pub(crate) fn bus(
    report: Reporter<'_>,
    settings: &Settings,
    joints: &[JointResolved],
) -> Result<Option<BusDescription>, ModelError> {
    let Some(bus) = &settings.bus else {
        return Ok(None);
    };
    if bus.motors.len() != joints.len() {
        let element = "[[bus.motors]]";
        return Err(wrong_count(report, element, bus.motors.len(), joints.len()));
    }
    report.within("[bus] watchdog_s", bus.watchdog_s, WATCHDOG_S, "s")?;
    check_rates(report, bus)?;
    check_temperatures(report, bus)?;
    let motors = bus
        .motors
        .iter()
        .zip(joints)
        .map(|(motor, joint)| resolve(report, motor, joint))
        .collect::<Result<Vec<_>, _>>()?;
    check_ids(report, &motors)?;
    Ok(Some(BusDescription {
        kind: bus.kind,
        format: bus.format,
        bit_rate: bus.bit_rate,
        data_bit_rate: bus.data_bit_rate,
        watchdog_s: bus.watchdog_s,
        warning_celsius: bus.warning_celsius,
        derating_celsius: bus.derating_celsius,
        fault_celsius: bus.fault_celsius,
        motors,
    }))
}

fn check_rates(report: Reporter<'_>, bus: &BusSettings) -> Result<(), ModelError> {
    for (key, rate) in [
        ("bit_rate", bus.bit_rate),
        ("data_bit_rate", bus.data_bit_rate),
    ] {
        if !(10_000..=10_000_000).contains(&rate) {
            return Err(report.invalid(
                format!("[bus] {key}"),
                "must be from 10000 to 10000000 bit/s",
                rate,
                "give the rate that the motors are set to, as 1000000",
            ));
        }
    }
    Ok(())
}

fn check_temperatures(report: Reporter<'_>, bus: &BusSettings) -> Result<(), ModelError> {
    let steps = [
        ("[bus] warning_celsius", bus.warning_celsius),
        ("[bus] derating_celsius", bus.derating_celsius),
        ("[bus] fault_celsius", bus.fault_celsius),
    ];
    for (element, value) in steps {
        report.within(element, value, CELSIUS, "degrees Celsius")?;
    }
    for pair in steps.windows(2) {
        if pair[1].1 <= pair[0].1 {
            return Err(report.invalid(
                pair[1].0,
                format!("must be above {}, {}", pair[0].0, pair[0].1),
                pair[1].1,
                "let a warning come before derating, and derating before the fault",
            ));
        }
    }
    Ok(())
}

fn resolve(
    report: Reporter<'_>,
    motor: &BusMotorSettings,
    joint: &JointResolved,
) -> Result<BusMotor, ModelError> {
    let at = |key: &str| format!("[[bus.motors]] of `{}` {key}", joint.name);
    if motor.joint != joint.name {
        return Err(report.invalid(
            at("joint"),
            "must name the joints from the base to the tip",
            format!("`{}`", motor.joint),
            format!("sort the motors; here `{}` is next", joint.name),
        ));
    }
    if !IDS.contains(&motor.id) {
        return Err(report.invalid(
            at("id"),
            "must be from 1 to 15",
            motor.id,
            "give the motor another ESC_ID: its feedback carries four bits of it",
        ));
    }
    let reply_id = motor.reply_id.unwrap_or(motor.id + 0x10);
    if !REPLY_IDS.contains(&reply_id) {
        return Err(report.invalid(
            at("reply_id"),
            "must be from 16 to 2046",
            reply_id,
            "give the motor the MST_ID id + 16",
        ));
    }
    for (key, value) in [
        ("gear_ratio", motor.gear_ratio),
        ("position_range_rad", motor.position_range_rad),
        ("velocity_range_rad_per_s", motor.velocity_range_rad_per_s),
        ("torque_range_nm", motor.torque_range_nm),
    ] {
        report.positive(&at(key), value)?;
        report.within(&at(key), value, 0.0..=1e4, "")?;
    }
    if motor.direction != 1 && motor.direction != -1 {
        return Err(report.invalid(
            at("direction"),
            "must be 1 or -1",
            motor.direction,
            "give -1 if the motor turns against the joint",
        ));
    }
    let scale = (at("torque_scale"), motor.torque_scale);
    report.within(&scale.0, scale.1, 0.3..=3.0, "")?;
    let zero = (at("zero_offset_rad"), motor.zero_offset_rad);
    report.within(&zero.0, zero.1, -6.5..=6.5, "rad")?;
    let damping = motor.hold_damping_nm_s_per_rad;
    report.within(
        &at("hold_damping_nm_s_per_rad"),
        damping,
        0.0..=5.0,
        "N m s/rad",
    )?;
    Ok(BusMotor {
        joint: motor.joint.clone(),
        model: motor.model.clone(),
        id: motor.id,
        reply_id,
        gear_ratio: motor.gear_ratio,
        position_range_rad: motor.position_range_rad,
        velocity_range_rad_per_s: motor.velocity_range_rad_per_s,
        torque_range_nm: motor.torque_range_nm,
        firmware_series: motor.firmware_series.clone(),
        direction: f64::from(motor.direction),
        zero_offset_rad: motor.zero_offset_rad,
        torque_scale: motor.torque_scale,
        hold_damping_nm_s_per_rad: damping,
        without_watchdog: motor.without_watchdog,
    })
}

/// Motors compare the low eight bits of an id only, so no two ids of the bus may have them in common.
fn check_ids(report: Reporter<'_>, motors: &[BusMotor]) -> Result<(), ModelError> {
    let mut seen: Vec<(u16, String)> = Vec::new();
    for motor in motors {
        for (id, name) in [(motor.id, "id"), (motor.reply_id, "reply_id")] {
            let element = format!("[[bus.motors]] of `{}` {name}", motor.joint);
            if let Some((_, other)) = seen.iter().find(|(known, _)| known & 0xFF == id & 0xFF) {
                return Err(report.invalid(
                    element,
                    "must differ in its low eight bits from every other id of the bus",
                    format!("{id:#05x}, as of {other}"),
                    "give every motor its own id, and id + 16 as reply_id",
                ));
            }
            seen.push((id, element));
        }
    }
    Ok(())
}
