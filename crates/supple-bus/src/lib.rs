//! Access of one node to a CAN bus.
//!
//! A [`Bus`] sends frames and returns [`Event`]s: frames of other nodes, confirmations of sent frames, and bus
//! faults. It also owns the time: [`Bus::receive_until`] is the only way to wait. On a real bus the time is the
//! machine's monotonic clock; in [`virtual_time`] it is the time of the emulated arm, which advances exactly as
//! far as the host waits. The same host code runs on both. In virtual time it runs as fast as the machine allows, and
//! its results are bit-identical in every run.
//!
//! | backend | description |
//! |---|---|
//! | [`SocketCan`] | a CAN interface of the kernel, real or `vcan` |
//! | [`DatagramBus`] | Unix datagrams in an owner-only folder, each one a raw SocketCAN frame |
//! | [`virtual_time::DirectBus`] | the emulated arm in the same process |
//! | [`virtual_time::LockstepBus`] | the emulated arm in another process |
//! | [`PacedBus`] | an emulated arm in another process, synchronised to the wall clock |
//! | [`FaultInjector`] | wraps any of these and injects faults |
//!
//! A bus transports classic CAN and CAN FD frames without interpreting their payload; codecs such as `supple-puck` encode
//! and decode it. Sending and receiving allocate no memory.

#![forbid(unsafe_code)]

mod address;
mod bus;
mod can_frame;
mod datagram;
mod emulated_nodes;
mod endpoint;
mod error;
mod fault;
mod folder;
mod lockstep_client;
mod lockstep_server;
mod message;
mod paced;
mod socket_can;
pub mod virtual_time;
mod wait;

pub use address::{Address, AddressError};
pub use bus::{Bus, BusFault, Event};
pub use can_frame::{CAN_FRAME_BYTES, DecodedFrame, EncodedFrame, FD_FRAME_BYTES};
pub use datagram::{DatagramBus, Side};
pub use error::BusError;
pub use fault::{FaultInjector, FaultKind, FaultRule, TrafficDirection};
pub use folder::OwnerFolder;
pub use paced::{PacedBus, PacedResponder};
pub use socket_can::SocketCan;
pub use wait::wait_readable_until;
