//! Owns the arm's bus and the clock.
//!
//! [`start_up()`] takes an arm from power-up to where it may be polled and refuses one that does not fit its
//! description. [`Cycle`] then polls positions, publishes the arm's state, waits a bounded time for the
//! torques that answer it, sends them and sees that they left. What happens when anything is lost is
//! [`guard`]. The host lowers the arm's safety module and never raises it: that takes a person at the
//! pendant.
//!
//! It computes no torques and knows no controller; the way to one is a [`Link`]. Time is the bus's own
//! ([`supple_bus::Bus`]): the same code runs on a CAN card, on an emulator, and in virtual time.

#![forbid(unsafe_code)]

pub mod bus_time;
pub mod guard;
pub mod transmission;

mod cycle;
mod error;
mod host;
mod link;
mod options;
mod outbox;
mod program;
mod sensor;
mod shared_memory;
mod start_up;

pub use bus_time::{Budget, BusTime, Overload};
pub use cycle::{Cycle, Rhythm};
pub use error::CanError;
pub use guard::{Guard, Loss};
pub use link::{Answer, ArmReport, Command, Counters, Drives, Link};
pub use program::main;
pub use shared_memory::SharedMemory;
pub use start_up::{ARM_GROUPS, MotorPuck, Progress, Ready, StartUp, start_up};
pub use transmission::Transmission;
