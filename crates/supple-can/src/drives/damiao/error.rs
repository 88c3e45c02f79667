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
    /// Error in the description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The description lacks its motors.
    #[error("arm `{arm}`: [bus] must list one Damiao motor per joint")]
    NoMotors {
        /// Name of the arm.
        arm: String,
    },
    /// Error of the bus itself.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A fault on the bus during start-up.
    #[error("the bus failed: {0}")]
    BusFault(BusFault),
    /// A motor that does not fit.
    #[error("joint {joint}: {refusal}")]
    Refused {
        /// Name of the joint.
        joint: String,
        /// Register, found, expected, remedy.
        refusal: Refusal,
    },
    /// A start position that no whole number of turns explains.
    #[error("joint {joint}: {source}")]
    Position {
        /// Name of the joint.
        joint: String,
        /// The position.
        source: PositionError,
    },
    /// The arm's motors speak CAN FD, the bus does not carry it.
    #[error(
        "arm `{arm}` has motors on CAN FD ([bus] format), and the bus carries classic frames only: set the interface to \
         CAN FD (ip link set can0 type can bitrate 1000000 dbitrate 5000000 fd on), or motors and TOML to classic CAN"
    )]
    NoFd {
        /// Name of the arm.
        arm: String,
    },
    /// The period is too short for the bus.
    #[error(transparent)]
    Rate(#[from] Overload),
    /// The plant loop cannot continue.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// Shared memory.
    #[error("shared memory: {0}")]
    Ipc(#[from] IpcError),
    /// A shutdown was requested.
    #[error("stopped before start-up was complete")]
    Stopped,
}

impl DamiaoError {
    /// Exit code, as for the command line: 3 for a wrong arm or description, 4 for an arm that fails a check, 10 for
    /// the bus, shared memory or the system.
    pub fn code(&self) -> u8 {
        match self {
            DamiaoError::Model(_) | DamiaoError::NoMotors { .. } | DamiaoError::Rate(_) => 3,
            DamiaoError::Refused { .. } | DamiaoError::Position { .. } => 4,
            _ => 10,
        }
    }
}
