//! Runs the arm's CAN bus and owns the clock.
//!
//! [`start_up()`] prepares an arm for polling after power-up and rejects one that does not match its
//! description. [`Cycle`] then polls positions, publishes the arm's state, waits a bounded time for the
//! controller's torques, sends them and checks that they were sent. [`guard`] defines the safe action after a
//! loss. The host sets the arm's safety module to idle and never activates it: that requires a person at the
//! pendant.
//!
//! It computes no torques and does not depend on the controller, which it reaches through a [`Link`]. Time is
//! bus time ([`supple_bus::Bus`]): the same code runs on a CAN card, on an emulator, and in virtual time.

#![forbid(unsafe_code)]

pub mod bus_time;
pub mod guard;
pub mod transmission;

mod cycle;
mod error;
mod host;
mod link;
mod options;
mod program;
mod sensor;
mod shared_memory;
mod start_up;
mod unconfirmed;

pub use bus_time::{Budget, BusTime, Overload};
pub use cycle::{Cycle, CycleConfig};
pub use error::CanError;
pub use guard::{LossReason, SafeActionMachine};
pub use link::{Answer, ArmReport, Command, Counters, Drives, Link};
pub use program::main;
pub use shared_memory::SharedMemoryLink;
pub use start_up::{ARM_GROUPS, MotorPuck, Progress, Ready, StartupConfig, start_up};
pub use transmission::Transmission;
