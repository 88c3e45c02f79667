//! Errors of start-up and operation.

use super::bus_time::Overload;
use supple_bus::{BusError, BusFault};
use supple_drive::LoopError;
use supple_model::ModelError;
use supple_puck::Property;
use supple_puck::position::{CountsError, PositionScaleError};
use supple_puck::property::FirmwareTooOld;
use supple_puck::safety::{SafetyLimitsError, SafetyMode};
use supple_puck::torque::TorqueError;

/// Errors of start-up and operation. Each message gives the value found, the value expected, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum CanError {
    /// Error of the bus itself.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The CAN controller reported a fault on the bus.
    #[error("the bus failed: {0}")]
    BusFault(BusFault),
    /// The plant loop cannot continue.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// The cycle rate exceeds the bandwidth of the bus, as computed by the plant loop.
    #[error(transparent)]
    Rate(#[from] Box<supple_drive::Overload>),
    /// The cycle rate exceeds the bandwidth of the bus, as computed before the arm is contacted.
    #[error(transparent)]
    Overload(#[from] Overload),
    /// The description of the arm has an error.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The arm is not a WAM with 4 or 7 joints.
    #[error(
        "arm `{arm}` has {found} moving joints, a WAM has 4 or 7 motor pucks: select a WAM with --arm, or an arm with [bus] in its TOML; any other arm can \
         be simulated, `supple up --plant sim`"
    )]
    Joints {
        /// Name of the arm.
        arm: String,
        /// Joints found.
        found: usize,
    },
    /// The description lacks a value that start-up compares with the pucks.
    #[error(
        "arm `{arm}`: [motors] {key} is missing: add it to the TOML, start-up compares the pucks with it"
    )]
    MissingKey {
        /// Name of the arm.
        arm: String,
        /// Key of the TOML.
        key: &'static str,
    },
    /// A node does not answer.
    #[error("{what} (node {node}) does not answer: {remedy}")]
    Missing {
        /// Kind of node.
        what: &'static str,
        /// Number of the node.
        node: u8,
        /// Remedy.
        remedy: &'static str,
    },
    /// The bus has more motor pucks than the arm has joints.
    #[error(
        "motor puck {node} answers, but arm `{arm}` has {joints} joints: select the connected arm with --arm"
    )]
    UnexpectedMotor {
        /// Number of the node.
        node: u8,
        /// Name of the arm.
        arm: String,
        /// Joints of the arm.
        joints: usize,
    },
    /// A node has another role than expected.
    #[error(
        "node {node} has role {role:#06x}, expected {expected}: check that the arm is wired as described"
    )]
    Role {
        /// Number of the node.
        node: u8,
        /// Role found.
        role: u16,
        /// Expected role.
        expected: &'static str,
    },
    /// The firmware of a node is too old: its property ids are not known.
    #[error("node {node}: {source}; update it")]
    FirmwareTooOld {
        /// Number of the node.
        node: u8,
        /// Version found and minimum version.
        source: FirmwareTooOld,
    },
    /// The firmware of a node lacks a property.
    #[error("firmware {version} of node {node} has no property {property}: update the firmware")]
    UnsupportedProperty {
        /// Number of the node.
        node: u8,
        /// Version found.
        version: i32,
        /// Property.
        property: Property,
    },
    /// The firmware of two pucks has torque or position under different property ids.
    #[error(
        "node {node} has the {property} under property id {found}, the first motor puck under {expected}: give all motor pucks the \
         same firmware"
    )]
    MixedPropertyIds {
        /// Number of the node.
        node: u8,
        /// The property: torque or position.
        property: &'static str,
        /// Id found.
        found: u8,
        /// Id of the first motor puck.
        expected: u8,
    },
    /// A puck does not wake up.
    #[error("motor puck {node} stays at STAT {stat} after the wake-up: switch the arm off and on")]
    NotAwake {
        /// Number of the node.
        node: u8,
        /// Value found.
        stat: i32,
    },
    /// A node did not apply a setting.
    #[error(
        "{property} of node {node} is {found} after it was set to {expected}: switch the arm off and on"
    )]
    SettingIgnored {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
        /// Value set.
        expected: i32,
    },
    /// A property of a puck differs from the description of the arm.
    #[error(
        "{property} of motor puck {node} is {found}, the arm's {key} requires {expected}: correct the TOML, or the property of the puck"
    )]
    DescriptionMismatch {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
        /// Key of the TOML.
        key: &'static str,
        /// Value of the description.
        expected: f64,
    },
    /// A puck is above its temperature limit.
    #[error(
        "motor puck {node} is at {found} degrees Celsius, its limit is {limit}: let it cool down"
    )]
    OverTemperature {
        /// Node.
        node: u8,
        /// Temperature.
        found: i32,
        /// Limit.
        limit: i32,
    },
    /// A puck reports an invalid number of encoder counts per revolution.
    #[error("motor puck {node}, encoder counts per revolution (CTS): {source}")]
    InvalidCountsPerRevolution {
        /// Node.
        node: u8,
        /// The error in CTS.
        source: PositionScaleError,
    },
    /// A puck reports invalid torque units.
    #[error("motor puck {node}, torque units per newton metre (IPNM): {source}")]
    InvalidTorqueUnits {
        /// Node.
        node: u8,
        /// The error in IPNM.
        source: TorqueError,
    },
    /// The home pose exceeds the range of the motor positions.
    #[error("home pose: {0}; correct home_rad")]
    InvalidHomePose(#[from] CountsError),
    /// The limits for the safety module are inconsistent.
    #[error("safety limits: {0}")]
    InvalidSafetyLimits(#[from] SafetyLimitsError),
    /// The arm has no position reference, and start-up may not ask the operator.
    #[error(
        "the safety module's ZERO is {zero}: the arm has lost its position reference; move it to its home pose \
         {home} rad, and start again with --zero-at-home"
    )]
    NotZeroed {
        /// Value found.
        zero: i32,
        /// Home pose as text.
        home: String,
    },
    /// The file that asks the operator to confirm the home pose cannot be written.
    #[error("the file that asks the operator to confirm the home pose cannot be written: {0}")]
    HomePoseQuestion(#[source] std::io::Error),
    /// The safety module is in another mode than requested.
    #[error(
        "the safety module is in {found:?}, expected {expected:?}: press Shift-Idle on the pendant and start again"
    )]
    Mode {
        /// Found.
        found: SafetyMode,
        /// Expected.
        expected: SafetyMode,
    },
    /// A property has a value that the protocol does not define.
    #[error("{property} of node {node} is {found}, an unknown value: check the node's firmware")]
    UnknownPropertyValue {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
    },
    /// A shutdown was requested.
    #[error("stopped before start-up was complete")]
    Stopped,
    /// Error of the link to the controller.
    #[error("shared memory: {0}")]
    Link(Box<dyn std::error::Error + Send + Sync>),
}

impl CanError {
    /// Returns the exit code of the program: 3 for a wrong arm or description, 4 for an arm that fails a check, 10
    /// for the bus, shared memory or the system.
    pub fn code(&self) -> u8 {
        match self {
            CanError::Model(_)
            | CanError::Joints { .. }
            | CanError::MissingKey { .. }
            | CanError::Overload(_)
            | CanError::Rate(_)
            | CanError::InvalidHomePose(_)
            | CanError::InvalidSafetyLimits(_) => 3,
            CanError::Bus(_)
            | CanError::BusFault(_)
            | CanError::Link(_)
            | CanError::Loop(LoopError::Bus(_) | LoopError::Link(_)) => 10,
            _ => 4,
        }
    }
}

impl From<supple_ipc::IpcError> for CanError {
    fn from(error: supple_ipc::IpcError) -> CanError {
        CanError::Link(Box::new(error))
    }
}
