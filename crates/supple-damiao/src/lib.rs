//! Codec of Damiao joint motors ("DM-J") on CAN and CAN FD: converts between frames and typed values.
//!
//! This crate opens no socket, reads no clock and allocates no memory. Besides the codec, it contains those parts of a drive
//! that are pure functions: the checks of start-up ([`inspection`]), error codes ([`status`]), temperature limits
//! ([`temperature`]), and the conversion from positions to joint angles ([`position`]).
//!
//! Three rules of this crate keep an arm safe:
//! - A command never equals a special frame, because the code of the motor's stiffness is at most 0xFFE.
//! - No type that a drive uses can write flash or set a zero position; these frames are in [`flash`].
//! - Ranges are values that the motor reported ([`Ranges`]), never a table of motor types.
//!
//! The facts come from the makers' manuals and change log and from the public drivers openarm_can, i2rt,
//! python-damiao-driver and DM_Control_Python.
//!
//! ```
//! use supple_damiao::{MitCommand, Ranges};
//!
//! let ranges = Ranges::new(12.5, 30.0, 10.0)?;
//! let command = MitCommand { torque_nm: 2.0, ..MitCommand::ZERO };
//! let frame = command.encode(7, &ranges)?;
//! assert_eq!((frame.id(), frame.payload()[7]), (7, 0x99));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod code;
pub mod feedback;
pub mod firmware;
pub mod flash;
pub mod frame;
pub mod guard;
pub mod inspection;
pub mod mit;
pub mod modes;
pub mod position;
pub mod ranges;
pub mod refusal;
pub mod register;
pub mod request;
pub mod shaping;
pub mod special;
pub mod status;
pub mod temperature;

pub use feedback::Feedback;
pub use frame::Frame;
pub use mit::{MitCodes, MitCommand};
pub use ranges::Ranges;
pub use refusal::{Problem, Refusal};
pub use register::{Register, RegisterReply, Value};
pub use request::Request;
pub use shaping::TorqueShaper;
pub use special::SpecialCommand;
pub use status::Status;
