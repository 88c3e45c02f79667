//! Barrett's arms: pucks, safety module and pendant on classic CAN.

pub mod bus_time;
pub mod start_up;
pub mod transmission;

mod drive;
mod error;
mod host;
mod plant_loop;
mod program;
mod sensor;

pub use plant_loop::{BarrettLoop, new_plant_loop};

pub use drive::Barrett;
pub use error::CanError;

use crate::backend::DriveBackend;
use supple_process::Failure;

/// The backend of Barrett's drives; it accepts every arm that no backend before it in the registry accepts.
pub const BACKEND: DriveBackend = DriveBackend {
    name: "barrett",
    supports: |_| true,
    run: |description, options, stop| match program::run(description, options, stop) {
        Err(CanError::Stopped) => Ok(None),
        Err(error) => Err(Failure::new(error.code(), error)),
        Ok(counters) => Ok(counters),
    },
};
