//! The messages between the processes: plain data of fixed size and layout.
//!
//! Values are in SI units, times as integers in ns (`_ns`); arrays over the joints have [`MAX_DOF`] entries and are zero
//! beyond the arm's joints. Flags are bytes, kinds are the codes of [`supple_core::codes`]. The messages have no padding, so
//! no uninitialised byte is shared. The type name in shared memory (`supple.ArmState.v4`) contains a version: every change of
//! meaning or layout increments it, and a process with another version is refused.

mod arm_state;
mod common;
mod operator;
mod telemetry;
mod text;
mod torque_command;
mod wake_request;

pub use common::{Drives, MAX_DOF, MessageError};

pub use arm_state::{ArmState, PlantReport};
pub use operator::{OperatorReply, OperatorRequest, Outcome};
pub use telemetry::{CycleTiming, Telemetry};
pub use text::Text;
pub use torque_command::TorqueCommand;
pub use wake_request::WakeRequest;
