//! Damiao joint motors on CAN or CAN FD: no safety module, no brakes. The arm falls when they are disabled.
//!
//! `supple-damiao` has the codec, the checks of start-up and the monitoring in a cycle. [`start_up`] reads the registers of
//! every motor and refuses a motor that does not match the description; [`Damiao`] is the drive.

mod drive;
mod error;
mod host;
mod motor;
mod program;
mod start_up;

pub use drive::{Damiao, budget};
pub use error::DamiaoError;
pub use motor::Motor;
pub use program::{DamiaoLoop, stow_config, with_drive};
pub use start_up::{differing_torque_constants, rates, start_up};

use crate::backend::DriveBackend;
use supple_model::BusKind;
use supple_process::Failure;

/// The backend of Damiao motors.
pub const BACKEND: DriveBackend = DriveBackend {
    name: "damiao",
    supports: |description| {
        description
            .bus()
            .is_some_and(|bus| bus.kind == BusKind::Damiao)
    },
    run: |description, options, stop| match program::run(description, options, stop) {
        Err(DamiaoError::Stopped) => Ok(None),
        Err(error) => Err(Failure::new(error.code(), error)),
        Ok(counters) => Ok(counters),
    },
};
