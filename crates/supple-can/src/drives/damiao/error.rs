//! Errors of start-up and operation with Damiao motors.

use supple_bus::{BusError, BusFault};
use supple_damiao::position::PositionError;
use supple_damiao::refusal::Refusal;
use supple_drive::{LoopError, Overload};
use supple_ipc::IpcError;
use supple_model::ModelError;

/// Errors of start-up and operation. Each message gives the value found, the value expected, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum DamiaoError {
    /// The description of the arm has an error.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The description does not list the motors.
    #[error("arm `{arm}`: [bus] must list one Damiao motor per joint: complete it in the TOML")]
    NoMotors {
        /// Name of the arm.
        arm: String,
    },
    /// Error of the bus itself.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The CAN controller reported a fault during start-up.
    #[error("the bus failed: {0}")]
    BusFault(BusFault),
    /// A motor does not match the description.
    #[error("joint {joint}: {refusal}")]
    Refused {
        /// Name of the joint.
        joint: String,
        /// Register, found, expected, remedy.
        refusal: Refusal,
    },
    /// No whole number of turns brings the start position within the limits of the joint.
    #[error("joint {joint}: {source}")]
    Position {
        /// Name of the joint.
        joint: String,
        /// The position.
        source: PositionError,
    },
    /// The arm's motors use CAN FD, but the bus carries classic frames only.
    #[error(
        "arm `{arm}` has motors on CAN FD ([bus] format), but the bus carries classic frames only: set the interface to \
         CAN FD (ip link set can0 type can bitrate 1000000 dbitrate 5000000 fd on), or motors and TOML to classic CAN"
    )]
    NoFd {
        /// Name of the arm.
        arm: String,
    },
    /// The period is too short for the bus.
    #[error(transparent)]
    Rate(#[from] Box<Overload>),
    /// The plant loop cannot continue.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// Shared memory failed.
    #[error("shared memory: {0}")]
    Ipc(#[from] IpcError),
    /// A shutdown was requested.
    #[error("stopped before start-up was complete")]
    Stopped,
}

impl DamiaoError {
    /// Returns the exit code of the program: 3 for a wrong arm or description, 4 for an arm that fails a check, 10 for
    /// the bus, shared memory or the system.
    pub fn code(&self) -> u8 {
        match self {
            DamiaoError::Model(_) | DamiaoError::NoMotors { .. } | DamiaoError::Rate(_) => 3,
            DamiaoError::Refused { .. } | DamiaoError::Position { .. } => 4,
            _ => 10,
        }
    }
}
