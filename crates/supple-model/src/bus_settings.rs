//! `[bus]` of the TOML: the motors as their drives address them.
//!
//! Ranges are what the arm's motors are expected to have. A drive reads them from each motor and refuses a motor
//! that has others; it never computes with the numbers of this file.

use schemars::JsonSchema;
use serde::Deserialize;

/// Motors on a CAN bus, and the bus itself.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BusSettings {
    /// Source of these numbers.
    pub source: Option<String>,
    /// Type of the drives.
    pub kind: BusKind,
    /// Frames that the drives are set to. Classic and FD frames are never mixed on one bus.
    pub format: BusFormat,
    /// Bit rate of the arbitration phase (bit/s). Default 1000000.
    #[serde(default = "default::bit_rate")]
    pub bit_rate: u32,
    /// Bit rate of the data phase of FD frames (bit/s). Default 5000000.
    #[serde(default = "default::data_bit_rate")]
    pub data_bit_rate: u32,
    /// Silence of the host after which a motor switches its torque off by itself (s), set in every motor at each
    /// start and read back. Default 0.02.
    #[serde(default = "default::watchdog_s")]
    pub watchdog_s: f64,
    /// Temperature of a motor from which a warning is reported (degrees Celsius). Default 70.
    #[serde(default = "default::warning_celsius")]
    pub warning_celsius: f64,
    /// Temperature from which the torque limit of a motor decreases (degrees Celsius). Default 80.
    #[serde(default = "default::derating_celsius")]
    pub derating_celsius: f64,
    /// Temperature that is a fault (degrees Celsius); the torque limit reaches its minimum there. Default 95.
    #[serde(default = "default::fault_celsius")]
    pub fault_celsius: f64,
    /// Motors, one per moving joint, from the base to the tip.
    pub motors: Vec<BusMotorSettings>,
}

/// Type of the drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BusKind {
    /// Damiao joint motors ("DM-J").
    Damiao,
}

/// Frames of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BusFormat {
    /// Classic CAN.
    Classic,
    /// CAN FD with bit rate switch.
    Fd,
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BusMotorSettings {
    /// Joint that the motor moves, by its name in the URDF.
    pub joint: String,
    /// Type of the motor, for messages.
    pub model: String,
    /// Id that the motor listens to, 1 to 15.
    pub id: u16,
    /// Id of the motor's replies, 16 to 2046. Default: `id` + 16.
    pub reply_id: Option<u16>,
    /// Expected gear ratio, motor revolutions per revolution of its shaft.
    pub gear_ratio: f64,
    /// Expected range of the position in the frames, plus or minus (rad).
    pub position_range_rad: f64,
    /// Expected range of the velocity in the frames, plus or minus (rad/s).
    pub velocity_range_rad_per_s: f64,
    /// Expected range of the torque in the frames, plus or minus (N m).
    pub torque_range_nm: f64,
    /// Series that begins the motor's firmware version, as in "50" of "5017". Default: any known one.
    pub firmware_series: Option<String>,
    /// 1 if the motor turns as the joint, -1 if against it. Default 1.
    #[serde(default = "default::direction")]
    pub direction: i8,
    /// Angle of the joint where the motor's position is zero (rad). Default 0.
    #[serde(default)]
    pub zero_offset_rad: f64,
    /// Torque of the motor over the commanded one, as calibration finds it; commands are divided by it. Default 1.
    #[serde(default = "default::torque_scale")]
    pub torque_scale: f64,
    /// Damping that the motor itself adds while it holds or stows (N m s/rad), 0 to 5.
    pub hold_damping_nm_s_per_rad: f64,
    /// Allows a motor whose watchdog cannot be set. Default false: such a motor is refused.
    #[serde(default)]
    pub without_watchdog: bool,
}

mod default {
    pub fn bit_rate() -> u32 {
        1_000_000
    }
    pub fn data_bit_rate() -> u32 {
        5_000_000
    }
    pub fn watchdog_s() -> f64 {
        0.02
    }
    pub fn warning_celsius() -> f64 {
        70.0
    }
    pub fn derating_celsius() -> f64 {
        80.0
    }
    pub fn fault_celsius() -> f64 {
        95.0
    }
    pub fn direction() -> i8 {
        1
    }
    pub fn torque_scale() -> f64 {
        1.0
    }
}
