//! The arm seen from the bus: motor pucks, force/torque sensor, safety module and pendant, moved by the
//! simulated plant.
//!
//! An [`Emulator`] hears every frame that the host sends, answers as the nodes of the arm do, and
//! accounts for the time of every frame at 1 Mbit/s. It runs in virtual time, an event at a time; the
//! program `supple-emu` holds it to the wall clock on Unix datagrams or a CAN interface, or lets a host
//! in another process advance it in lockstep.
//!
//! It is the independent check of the host: it shares nothing with `supple-can` but the codec and the
//! bus, and knows no controller. What the arm's makers have not published is a parameter of
//! [`EmulatorConfig`], with its reason.

#![forbid(unsafe_code)]

pub mod config;
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
mod program;
mod store;

pub use config::{EmulatorConfig, PuckConfig, SafetyConfig};
pub use emulator::{Emulator, Happening};
pub use error::EmulatorError;
pub use pendant::{SOCKET as PENDANT_SOCKET, answer as answer_pendant};
pub use program::{ArmsEnd, catch_up, listen, main};
pub use safety::{Cause, Press};
