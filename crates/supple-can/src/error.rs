//! Why the arm was not taken into service, and why service ended.

use crate::bus_time::Overload;
use supple_bus::{BusError, BusFault};
use supple_model::ModelError;
use supple_puck::Property;
use supple_puck::position::{CountsError, PositionScaleError};
use supple_puck::property::FirmwareTooOld;
use supple_puck::safety::{SafetyLimitsError, SafetyMode};
use supple_puck::torque::TorqueError;

/// What keeps the arm from service. Each says what was found, what was expected, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum CanError {
    /// The bus itself.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Something is wrong on the bus.
    #[error("the bus failed: {0}")]
    BusFault(BusFault),
    /// The rate that the bus does not carry.
    #[error(transparent)]
    Overload(#[from] Overload),
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An arm that this program does not drive.
    #[error(
        "arm `{arm}` has {found} moving joints, a WAM has 4 or 7 motor pucks: give such an arm"
    )]
    Joints {
        /// Name of the arm.
        arm: String,
        /// Joints found.
        found: usize,
    },
    /// A description without what the pucks are compared with.
    #[error("arm `{arm}`: [motors] {key} is missing: give it, the pucks are checked against it")]
    Described {
        /// Name of the arm.
        arm: String,
        /// Key of the TOML.
        key: &'static str,
    },
    /// A node that does not answer.
    #[error("{what} (node {node}) does not answer: {remedy}")]
    Missing {
        /// What it is.
        what: &'static str,
        /// Its number.
        node: u8,
        /// What to do.
        remedy: &'static str,
    },
    /// More motors than joints.
    #[error(
        "motor puck {node} answers, but arm `{arm}` has {joints} joints: give the arm that is there"
    )]
    Surplus {
        /// Its number.
        node: u8,
        /// Name of the arm.
        arm: String,
        /// Joints of the arm.
        joints: usize,
    },
    /// A puck that is something else.
    #[error(
        "node {node} has role {role:#06x}, expected {expected}: check that the arm is wired as described"
    )]
    Role {
        /// Its number.
        node: u8,
        /// Role found.
        role: u16,
        /// What was expected.
        expected: &'static str,
    },
    /// A firmware without a list of ids.
    #[error("node {node}: {source}; update it")]
    Firmware {
        /// Its number.
        node: u8,
        /// Version found and least version.
        source: FirmwareTooOld,
    },
    /// A firmware that lacks a property.
    #[error("firmware {version} of node {node} has no property {property}: update it")]
    Property {
        /// Its number.
        node: u8,
        /// Version found.
        version: i32,
        /// Property.
        property: Property,
    },
    /// Pucks that share a torque frame but not the id of the torque.
    #[error(
        "node {node} has torque at id {found}, its group at {expected}: give all pucks of a group one firmware"
    )]
    Mixed {
        /// Its number.
        node: u8,
        /// Id found.
        found: u8,
        /// Id of the first puck of the group.
        expected: u8,
    },
    /// A puck that does not wake up.
    #[error("motor puck {node} stays at STAT {stat} after the wake-up: switch the arm off and on")]
    Asleep {
        /// Its number.
        node: u8,
        /// Value found.
        stat: i32,
    },
    /// A value that was set and is not there.
    #[error(
        "{property} of node {node} is {found} after it was set to {expected}: switch the arm off and on"
    )]
    NotTaken {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
        /// Value set.
        expected: i32,
    },
    /// A puck that contradicts the description.
    #[error(
        "{property} of motor puck {node} is {found}, the arm's {key} means {expected}: correct the TOML or the puck"
    )]
    Contradiction {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
        /// Key of the TOML.
        key: &'static str,
        /// What the description says.
        expected: f64,
    },
    /// A hot puck.
    #[error(
        "motor puck {node} is at {found} degrees Celsius, its limit is {limit}: let it cool down"
    )]
    Hot {
        /// Node.
        node: u8,
        /// Temperature.
        found: i32,
        /// Limit.
        limit: i32,
    },
    /// Encoder of no counts.
    #[error("node {node}: {source}")]
    Counts {
        /// Node.
        node: u8,
        /// What is wrong with CTS.
        source: PositionScaleError,
    },
    /// Torque units that make no sense.
    #[error("node {node}: {source}")]
    Units {
        /// Node.
        node: u8,
        /// What is wrong with IPNM.
        source: TorqueError,
    },
    /// Home pose beyond what positions hold.
    #[error("home pose: {0}; correct home_rad")]
    Home(#[from] CountsError),
    /// Limits of the safety module that contradict themselves.
    #[error("safety limits: {0}")]
    Limits(#[from] SafetyLimitsError),
    /// Positions are not known.
    #[error(
        "the safety module's ZERO is {zero}: the arm has lost its positions; put it into its home pose \
         {home} rad, and start again with --zero-at-home"
    )]
    NotZeroed {
        /// Value found.
        zero: i32,
        /// Home pose in words.
        home: String,
    },
    /// The module is in another mode than it was brought to.
    #[error(
        "the safety module is in {found:?}, expected {expected:?}: press Shift-Idle at the pendant and start again"
    )]
    Mode {
        /// Found.
        found: SafetyMode,
        /// Expected.
        expected: SafetyMode,
    },
    /// A value that the protocol does not have.
    #[error("{property} of node {node} is {found}, which means nothing: check the node's firmware")]
    Value {
        /// Property.
        property: Property,
        /// Node.
        node: u8,
        /// Value found.
        found: i32,
    },
    /// The operator ended it.
    #[error("ended before the arm was in service")]
    Stopped,
    /// The controller's side.
    #[error("shared memory: {0}")]
    Link(Box<dyn std::error::Error + Send + Sync>),
}

impl CanError {
    /// Exit code, as the command line has them: 3 a wrong arm or description, 4 an arm that is not as it has to be,
    /// 10 the bus, shared memory or the system.
    pub fn code(&self) -> u8 {
        match self {
            CanError::Model(_)
            | CanError::Joints { .. }
            | CanError::Described { .. }
            | CanError::Overload(_)
            | CanError::Home(_)
            | CanError::Limits(_) => 3,
            CanError::Bus(_) | CanError::BusFault(_) | CanError::Link(_) => 10,
            _ => 4,
        }
    }
}
