//! Emulates the arm as seen from the bus: motor pucks, force/torque sensor, safety module and pendant, driven by
//! the simulated plant.
//!
//! An [`Emulator`] receives every frame of the host, answers as the arm's nodes do, and models the transmission
//! time of every frame at 1 Mbit/s. It is event-driven and runs in virtual time; the program `supple-emu`
//! synchronises it to the wall clock on Unix datagrams or a CAN interface, or lets a host in another process
//! advance it in lockstep.
//!
//! An arm of Damiao motors ([`damiao`]) is emulated in the same way, without module and pendant.
//!
//! It checks the host independently: it shares only the codec and the bus with `supple-can`, and does not depend
//! on the controller. Properties that the manufacturer has not published are parameters of [`EmulatorConfig`],
//! each with the reason for its value.

#![forbid(unsafe_code)]

pub mod config;
pub mod damiao;
pub mod elbow;
pub mod puck;
pub mod safety;
pub mod sensor;
pub mod wire;

mod emulator;
mod error;
mod options;
mod pendant;
mod pendant_clients;
mod process;
mod program;
mod real_time;
mod store;

pub use config::{EmulatorConfig, PuckConfig, SafetyConfig};
pub use emulator::{ArmEvent, Emulator};
pub use error::EmulatorError;
pub use pendant::{SOCKET as PENDANT_SOCKET, answer as answer_pendant};
pub use program::main;
pub use real_time::{ArmBus, EmulatedArm, advance_to_bus_time, receive_host_frame};
pub use safety::{ButtonPress, Cause};
