//! Codec of Damiao joint motors ("DM-J") on CAN and CAN FD, between frames and typed values.
//!
//! Pure conversions: this crate opens no socket, reads no clock and allocates nothing. Besides the codec it holds the
//! pure parts of a drive: what a start-up compares ([`inspection`]), what an error code means ([`status`]), how hot a
//! motor may be ([`temperature`]), and which angle a position means ([`position`]).
//!
//! Three rules keep an arm safe here:
//! - A command never equals a special frame: the code of the motor's own stiffness stops at 0xFFE.
//! - No type of the running path can write flash or set a zero; [`flash`] holds these frames apart.
//! - Ranges are values that the motor reported ([`Ranges`]), never a table by type.
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
pub use special::Special;
pub use status::Status;
