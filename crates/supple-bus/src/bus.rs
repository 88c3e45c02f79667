//! The trait, and what a bus reports.

use crate::error::BusError;
use core::fmt;
use supple_puck::CanFrame;

/// One node's view of a CAN bus.
pub trait Bus {
    /// Time of this bus \[ns\]: never goes back, starts anywhere.
    fn now_ns(&self) -> u64;

    /// Hands a frame over for sending and returns at once. That it left is told by [`Event::Sent`],
    /// not by this returning.
    ///
    /// # Errors
    /// [`BusError::Full`] when there is no room for another frame; the frame is then not sent.
    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError>;

    /// The next event, or `None` once [`Bus::now_ns`] has reached `until_ns`. A time already past asks
    /// for what is there now.
    ///
    /// # Errors
    /// Where the bus itself is gone. Faults on the bus are events.
    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError>;

    /// As [`Bus::receive_until`], where the host promises to send nothing before `frames` more frames of other
    /// nodes have come, or `until_ns` is reached: a bus in another process need then be asked but once.
    ///
    /// # Errors
    /// As [`Bus::receive_until`].
    fn receive_ahead(&mut self, until_ns: u64, frames: u32) -> Result<Option<Event>, BusError> {
        let _ = frames;
        self.receive_until(until_ns)
    }

    /// How long the time of this bus has stood still so far while the machine's went on \[ns\].
    fn stood_still_ns(&self) -> u64 {
        0
    }

    /// What the machine's monotonic clock shows at a time of this bus \[ns\]; the same, but for a bus
    /// that keeps its own time by the wall clock.
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

    fn receive_ahead(&mut self, until_ns: u64, frames: u32) -> Result<Option<Event>, BusError> {
        (**self).receive_ahead(until_ns, frames)
    }

    fn stood_still_ns(&self) -> u64 {
        (**self).stood_still_ns()
    }

    fn monotonic_ns(&self, time_ns: u64) -> u64 {
        (**self).monotonic_ns(time_ns)
    }
}

/// What happens on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Another node sent this.
    Frame(CanFrame),
    /// This frame of one's own has left.
    Sent(CanFrame),
    /// Something is wrong on the bus.
    Fault(BusFault),
}

/// What a controller reports in an error frame, the worst of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusFault {
    /// The controller works again after a bus-off.
    Restarted,
    /// Another node won the bus.
    ArbitrationLost,
    /// The error counters passed the warning limit.
    Warning,
    /// A violation of the protocol: bits, stuffing, check sum.
    Protocol,
    /// The error counters passed the passive limit: this node no longer flags errors.
    Passive,
    /// Frames were lost because they were not read in time.
    Overrun,
    /// The transceiver is at fault: a wire open or shorted.
    Transceiver,
    /// Nobody acknowledged a frame: there is no other node.
    NoAcknowledge,
    /// A frame did not leave in time.
    TransmitTimeout,
    /// The controller took itself off the bus: nothing is sent or received until it restarts.
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
            BusFault::Overrun => "received frames were lost because they were not read in time",
            BusFault::Transceiver => "the transceiver reports an open or shorted wire",
            BusFault::NoAcknowledge => "no node acknowledged a frame; is the arm on and connected?",
            BusFault::TransmitTimeout => "a frame did not leave in time",
            BusFault::BusOff => {
                "the CAN controller is off the bus; check cable and termination, then restart it"
            }
        })
    }
}
