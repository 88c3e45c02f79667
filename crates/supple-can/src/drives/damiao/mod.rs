//! Damiao joint motors on CAN or CAN FD: no safety module, no brakes. The arm falls when they are disabled.
//!
//! `supple-damiao` is the codec, with what a start-up compares and what a cycle watches; [`start_up`] asks every motor
//! and refuses one that does not fit, [`Damiao`] is the drive.

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
pub use start_up::{rates, start_up};

use crate::backend::DriveBackend;
use supple_model::BusKind;
use supple_process::Failure;

/// Line of the registry.
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
