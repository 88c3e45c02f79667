//! Codec of Barrett's puck protocol: converts between CAN frames and typed values.
//!
//! This crate opens no socket, reads no clock, allocates no memory and keeps no state; `supple-can` defines the polling
//! sequence. Parsing a frame may fail, and the error contains the found and the expected value; encoding cannot fail,
//! because the types hold only encodable values.
//!
//! The bus is classical CAN 2.0A with 11-bit ids at 1 Mbit/s; other frames are not parsed. The facts come from Barrett's libbarrett (2018)
//! and btclient (2013), OWD (2015) and the WAM Arm User's Manual D1001 (2008); each module names its sources.
//!
//! ```
//! use supple_can_frame::CanFrame;
//! use supple_puck::{Counts, GroupId, MessageId, NodeId, PositionReply};
//!
//! let id = MessageId::to_group(NodeId::joint(1).unwrap(), GroupId::POSITION);
//! let frame = CanFrame::new(id, &[0x00, 0x10, 0x00])?;
//! let reply = PositionReply::parse(&frame)?;
//! assert_eq!(reply.motor, Counts::new(4096)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod force_torque;
pub mod frame;
pub mod id;
pub mod inbound;
pub mod position;
pub mod property;
pub mod safety;
pub mod status;
pub mod torque;

pub use id::{Destination, GroupId, MessageId, NodeId};
pub use inbound::Inbound;
pub use position::{Counts, PositionReply, PositionScale};
pub use property::{Property, PropertyId, PropertyMessage, PropertyTable, PuckKind, Value, Width};
pub use torque::{PackedTorques, PuckTorque, TorqueScale};
