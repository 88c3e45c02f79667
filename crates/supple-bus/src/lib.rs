//! The arm's CAN bus, seen from one node of it.
//!
//! A [`Bus`] sends frames and gives back [`Event`]s: frames of other nodes, confirmations that own
//! frames have left, and faults of the bus. It also owns the time: [`Bus::receive_until`] is the only
//! way to wait. On a real bus that is the machine's monotonic clock; in [`virtual_time`] it is the time
//! of whoever plays the arm, which advances exactly as far as the host waits. The same host code runs
//! on either, and in virtual time it runs as fast as it can and gives the same bits every time.
//!
//! | backend | is |
//! |---|---|
//! | [`SocketCan`] | a CAN interface of the kernel, real or `vcan` |
//! | [`DatagramBus`] | Unix datagrams in an owner-only folder, each one a raw `struct can_frame` |
//! | [`virtual_time::Direct`] | the other side in the same process |
//! | [`virtual_time::Lockstep`] | the other side in another process |
//! | [`Paced`] | the same by the wall clock, for an emulated arm |
//! | [`FaultInjector`] | any of these, with faults |
//!
//! It knows frames, not what they mean: that is `supple-puck`. Sending and receiving allocate nothing.

#![forbid(unsafe_code)]

mod address;
mod asked;
mod asking;
mod bus;
mod can_frame;
mod clock;
mod datagram;
mod endpoint;
mod error;
mod fault;
mod folder;
mod message;
mod paced;
mod socket_can;
pub mod virtual_time;

pub use address::{Address, AddressError};
pub use bus::{Bus, BusFault, Event};
pub use can_frame::{CAN_FRAME_BYTES, WireFrame};
pub use clock::{monotonic_ns, wait_readable_until};
pub use datagram::{DatagramBus, Side};
pub use error::BusError;
pub use fault::{FaultInjector, FaultKind, FaultRule, Traffic};
pub use folder::OwnerFolder;
pub use paced::{Paced, Pacer};
pub use socket_can::SocketCan;
