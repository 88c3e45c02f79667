//! A bus of two nodes made of Unix datagrams: the host and whoever plays the arm.
//!
//! Each datagram is a raw `struct can_frame`; data frames and error frames both. There is no bit rate:
//! the arm's side delays its frames if it wants to. A frame counts as sent when the peer's socket took
//! it; without a peer nobody acknowledges, as on a cable without an arm. Nothing leaves the machine.

use crate::bus::{Bus, BusFault, Event};
use crate::can_frame::{CAN_FRAME_BYTES, WireFrame};
use crate::clock::{monotonic_ns, wait_readable_until};
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use rustix::fd::{AsFd, BorrowedFd};
use std::collections::VecDeque;
use supple_puck::CanFrame;

/// Confirmations that may wait to be read; the least that a transmit queue of the kernel has is ten.
const QUEUE: usize = 64;

/// Which node of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The computer.
    Host,
    /// Everything else.
    Arm,
}

impl Side {
    /// Names of its socket and of the other's.
    pub(crate) fn sockets(self) -> (&'static str, &'static str) {
        match self {
            Side::Host => ("host.can", "arm.can"),
            Side::Arm => ("arm.can", "host.can"),
        }
    }
}

/// One side of the bus.
#[derive(Debug)]
pub struct DatagramBus {
    endpoint: Endpoint,
    own: VecDeque<Event>,
}

impl DatagramBus {
    /// Opens one side in a folder; the other side may come later, and may come and go.
    ///
    /// # Errors
    /// Where the folder is not the owner's alone, or another process is this side.
    pub fn open(folder: &OwnerFolder, side: Side) -> Result<DatagramBus, BusError> {
        let (own, peer) = side.sockets();
        Ok(DatagramBus {
            endpoint: Endpoint::new(folder, own, peer)?,
            own: VecDeque::with_capacity(QUEUE),
        })
    }

    /// Puts an error frame on the bus for the other side to see.
    ///
    /// # Errors
    /// Where the socket fails.
    pub fn send_fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.endpoint.send(&WireFrame::fault(fault)).map(|_| ())
    }

    fn take(&mut self) -> Result<Option<Event>, BusError> {
        if let Some(event) = self.own.pop_front() {
            return Ok(Some(event));
        }
        while let Some(raw) = self.endpoint.receive::<CAN_FRAME_BYTES>()? {
            match WireFrame::parse(&raw) {
                WireFrame::Data(frame) => return Ok(Some(Event::Frame(frame))),
                WireFrame::Fault(fault) => return Ok(Some(Event::Fault(fault))),
                WireFrame::Foreign => {}
            }
        }
        Ok(None)
    }
}

impl Bus for DatagramBus {
    fn now_ns(&self) -> u64 {
        monotonic_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        if self.own.len() == QUEUE {
            return Err(BusError::Full);
        }
        let event = match self.endpoint.send(&WireFrame::data(frame))? {
            Delivery::Delivered => Event::Sent(*frame),
            Delivery::NoPeer => Event::Fault(BusFault::NoAcknowledge),
            Delivery::Full => return Err(BusError::Full),
        };
        self.own.push_back(event);
        Ok(())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        loop {
            if let Some(event) = self.take()? {
                return Ok(Some(event));
            }
            wait_readable_until(&self.endpoint, until_ns)?;
            if let Some(event) = self.take()? {
                return Ok(Some(event));
            }
            if monotonic_ns() >= until_ns {
                return Ok(None);
            }
        }
    }
}

impl AsFd for DatagramBus {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.endpoint.as_fd()
    }
}
