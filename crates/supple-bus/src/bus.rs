//! The trait [`Bus`], and the events of a bus.

use crate::error::BusError;
use core::fmt;
use supple_can_frame::CanFrame;

/// One node's view of a CAN bus.
pub trait Bus {
    /// Time of this bus \[ns\]: monotonic, with an arbitrary origin.
    fn now_ns(&self) -> u64;

    /// Queues a frame for sending and returns at once. [`Event::Sent`] confirms that it was sent.
    ///
    /// # Errors
    /// [`BusError::Full`] if the transmit queue is full, [`BusError::ClassicOnly`] for an FD frame on a bus without CAN
    /// FD; the frame is then not sent.
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError>;

    /// Waits for the next event and returns it, or `None` once [`Bus::now_ns`] has reached `until_ns`. With a time in the
    /// past, returns only an event that has already arrived.
    ///
    /// # Errors
    /// If the interface or socket fails. Faults that the CAN controller reports are [`Event::Fault`].
    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError>;

    /// Receives as [`Bus::receive_until`] does, with lookahead: the caller promises not to send before `frames` more frames of other nodes have
    /// arrived or `until_ns` is reached. An emulated arm in another process can then return all these events in one datagram.
    ///
    /// # Errors
    /// The same as those of [`Bus::receive_until`].
    fn receive_with_lookahead(
        &mut self,
        until_ns: u64,
        frames: u32,
    ) -> Result<Option<Event>, BusError> {
        let _ = frames;
        self.receive_until(until_ns)
    }

    /// Whether this bus carries CAN FD frames; every bus carries classic frames.
    fn carries_fd(&self) -> bool {
        true
    }

    /// Total time for which the clock of this bus has been paused relative to CLOCK_MONOTONIC since the bus was opened, because a
    /// process of an emulated bus stalled \[ns\].
    fn clock_stall_ns(&self) -> u64 {
        0
    }

    /// Converts a time of this bus to CLOCK_MONOTONIC \[ns\]. In virtual time, which is not related to that clock, returns
    /// its argument.
    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        time_ns
    }
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    fn now_ns(&self) -> u64 {
        (**self).now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        (**self).send(frame)
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        (**self).receive_until(until_ns)
    }

    fn receive_with_lookahead(
        &mut self,
        until_ns: u64,
        frames: u32,
    ) -> Result<Option<Event>, BusError> {
        (**self).receive_with_lookahead(until_ns, frames)
    }

    fn carries_fd(&self) -> bool {
        (**self).carries_fd()
    }

    fn clock_stall_ns(&self) -> u64 {
        (**self).clock_stall_ns()
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        (**self).monotonic_ns(time_ns)
    }
}

/// An event on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Another node sent this frame.
    Frame(CanFrame),
    /// A frame of this node was sent.
    Sent(CanFrame),
    /// A fault on the bus.
    Fault(BusFault),
}

/// A condition that a CAN controller reports, in ascending order of severity. Of several conditions in one error frame,
/// the most severe is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusFault {
    /// The controller was restarted after a bus-off.
    Restarted,
    /// Another node won the arbitration.
    ArbitrationLost,
    /// The error counters passed the warning limit.
    Warning,
    /// Protocol violation: bit, stuffing or checksum error.
    Protocol,
    /// The error counters passed the passive limit: the node is error-passive and no longer sends active error flags.
    Passive,
    /// A receive or transmit buffer overflowed, and frames were lost.
    Overrun,
    /// Transceiver fault: a wire is open or shorted.
    Transceiver,
    /// No node acknowledged a frame: no node is powered, connected and set to this bit rate, or no process serves the other
    /// side of an emulated bus.
    NoAcknowledge,
    /// A frame was not sent in time.
    TransmitTimeout,
    /// The controller is bus-off: it neither sends nor receives until it restarts.
    BusOff,
}

impl fmt::Display for BusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            BusFault::Restarted => "the CAN controller was restarted",
            BusFault::ArbitrationLost => "arbitration was lost",
            BusFault::Warning => "the error counters passed the warning limit",
            BusFault::Protocol => "a frame violated the protocol; check bit rate and termination",
            BusFault::Passive => "the error counters passed the passive limit",
            BusFault::Overrun => "a receive or transmit buffer overflowed, and frames were lost",
            BusFault::Transceiver => "the transceiver reports an open or shorted wire",
            BusFault::NoAcknowledge => {
                "no node acknowledged a frame; check that the arm is switched on and connected"
            }
            BusFault::TransmitTimeout => "a frame was not sent in time",
            BusFault::BusOff => {
                "the CAN controller is bus-off; check cable and termination, then restart it"
            }
        })
    }
}
