//! Damiao joint motors on their bus, over the simulated plant: what a host sees of an OpenArm or a YAM.
//!
//! Facts that the maker has not published are parameters or assumptions, each stated where it is made. A frame that would
//! write flash ends the emulation with a panic unless [`DamiaoConfig::allow_flash`] is set: no running program may send
//! one.

mod arm;
mod config;
mod misbehaviour;
mod motor;
mod program;
mod registers;

pub use arm::{DamiaoArm, MotorEvent};
pub use config::{DamiaoConfig, MotorConfig};
pub use misbehaviour::{HELP, Misbehaviour, MisbehaviourError, MisbehaviourKind};
pub use motor::Motor;
pub(crate) use program::run;
