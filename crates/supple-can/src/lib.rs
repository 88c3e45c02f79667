//! Runs an arm's CAN bus and owns the clock.
//!
//! Each type of drives is a folder of [`drives`] and a line of [`registry`]. Its start-up prepares an arm after
//! power-up and rejects one that does not match its description; then it is a [`supple_drive::Drive`], and the plant
//! loop of that crate polls positions, publishes the arm's state, waits a bounded time for the controller's torques,
//! sends them and checks that they were sent. What happens after a loss is the same for all drives.
//!
//! It computes no torques and does not depend on the controller. Time is bus time ([`supple_bus::Bus`]): the same
//! code runs on a CAN card, on an emulator, and in virtual time.

#![forbid(unsafe_code)]

pub mod drives;
pub mod registry;

mod backend;
mod cycles;
mod options;
mod program;
mod run;

pub use backend::DriveBackend;
pub use drives::barrett::bus_time::{Budget, BusTime, Overload};
pub use drives::barrett::start_up::{
    ARM_GROUPS, MotorPuck, Progress, Ready, StartupConfig, start_up,
};
pub use drives::barrett::transmission::{self, Transmission};
pub use drives::barrett::{Barrett, BarrettLoop, CanError, new_plant_loop};
pub use options::Options;
pub use program::main;
