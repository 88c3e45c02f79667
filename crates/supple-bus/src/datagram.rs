//! A bus of two nodes over Unix datagrams: the host and the emulated arm.
//!
//! Each datagram is a raw `struct can_frame` or `struct canfd_frame`: a data frame or an error frame. The
//! sockets have no bit rate: the emulated arm itself delays its frames by the time that their bits take on a bus. A frame counts as sent once the peer's socket has accepted it.
//! Without a peer, frames are not acknowledged, as on a real bus without an arm. No data leave the machine.

use crate::bus::{Bus, BusFault, Event};
use crate::can_frame::{DecodedFrame, EncodedFrame, FD_FRAME_BYTES};
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::folder::OwnerFolder;
use crate::wait::wait_readable_until;
use rustix::fd::{AsFd, BorrowedFd};
use std::collections::VecDeque;
use supple_can_frame::CanFrame;
use supple_realtime::monotonic_ns;

/// Maximum number of unread confirmations. Beyond this number `send` returns `BusError::Full`, as a CAN interface does whose transmit
/// queue is full; that queue has at least ten entries.
const CONFIRMATIONS: usize = 64;

/// A node of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The host computer.
    Host,
    /// All nodes of the arm.
    Arm,
}

impl Side {
    /// Returns the names of this side's socket and of the peer's socket.
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
    confirmations: VecDeque<Event>,
}

impl DatagramBus {
    /// Opens one side of the bus in a folder; the other side may connect later, and may disconnect and connect again.
    ///
    /// # Errors
    /// If the folder is not accessible only to its owner, or another process has opened this side.
    pub fn open(folder: &OwnerFolder, side: Side) -> Result<DatagramBus, BusError> {
        let (own, peer) = side.sockets();
        Ok(DatagramBus {
            endpoint: Endpoint::new(folder, own, peer)?,
            confirmations: VecDeque::with_capacity(CONFIRMATIONS),
        })
    }

    /// Sends an error frame to the other side.
    ///
    /// # Errors
    /// If the socket fails.
    pub fn send_fault(&mut self, fault: BusFault) -> Result<(), BusError> {
        self.endpoint
            .send(&EncodedFrame::of_fault(fault))
            .map(|_| ())
    }

    fn read_event(&mut self) -> Result<Option<Event>, BusError> {
        if let Some(event) = self.confirmations.pop_front() {
            return Ok(Some(event));
        }
        let mut buffer = [0; FD_FRAME_BYTES + 1];
        while let Some(raw) = self.endpoint.receive_into(&mut buffer)? {
            match DecodedFrame::decode(raw) {
                DecodedFrame::Data(frame) => return Ok(Some(Event::Frame(frame))),
                DecodedFrame::Fault(fault) => return Ok(Some(Event::Fault(fault))),
                DecodedFrame::Unsupported => {}
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
        if self.confirmations.len() == CONFIRMATIONS {
            return Err(BusError::Full);
        }
        let event = match self.endpoint.send(&EncodedFrame::of_data(frame))? {
            Delivery::Delivered => Event::Sent(*frame),
            Delivery::NoPeer => Event::Fault(BusFault::NoAcknowledge),
            Delivery::Full => return Err(BusError::Full),
        };
        self.confirmations.push_back(event);
        Ok(())
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        loop {
            if let Some(event) = self.read_event()? {
                return Ok(Some(event));
            }
            wait_readable_until(&self.endpoint, until_ns)?;
            if let Some(event) = self.read_event()? {
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
