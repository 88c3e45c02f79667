//! Emulated Damiao joint motors on their bus, which move the simulated plant: an OpenArm or a YAM as the host observes it.
//!
//! Facts that the maker has not published are parameters or assumptions; each is documented at its definition. A frame that
//! would write flash ends the emulation with a panic, because no drive may send one, unless [`DamiaoConfig::allow_flash`] is
//! set.

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
