//! A bus that also tracks unconfirmed frames, the time for which the bus was busy, and bus faults.

use crate::drive::DriveCounters;
use crate::error::LoopError;
use crate::unconfirmed::UnconfirmedFrames;
use supple_bus::{Bus, BusError, BusFault, Event};
use supple_can_frame::{BitRates, CanFrame};

/// Access of a drive to its bus in the cycle.
#[derive(Debug)]
pub struct BusPort<B> {
    bus: B,
    rates: BitRates,
    unconfirmed: UnconfirmedFrames,
    frames_lost: bool,
    bus_off: bool,
    counters: DriveCounters,
}

impl<B: Bus> BusPort<B> {
    /// Creates the port of a bus with these bit rates.
    pub fn new(bus: B, rates: BitRates) -> BusPort<B> {
        BusPort {
            bus,
            rates,
            unconfirmed: UnconfirmedFrames::default(),
            frames_lost: false,
            bus_off: false,
            counters: DriveCounters::default(),
        }
    }

    /// The bus.
    pub fn bus(&self) -> &B {
        &self.bus
    }

    /// The bus.
    pub fn bus_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    /// Returns the bus.
    pub fn into_bus(self) -> B {
        self.bus
    }

    /// Bit rates.
    pub fn rates(&self) -> BitRates {
        self.rates
    }

    /// Queues a frame for sending. If the transmit queue is full, the frame counts as lost.
    ///
    /// # Errors
    /// If the bus itself fails.
    pub fn send(&mut self, frame: &CanFrame) -> Result<(), LoopError> {
        self.unconfirmed.add(frame);
        match self.bus.send(frame) {
            Ok(()) | Err(BusError::Full) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Whether a sent frame has not been confirmed.
    pub fn is_unconfirmed(&self, frame: &CanFrame) -> bool {
        self.unconfirmed.contains(frame)
    }

    /// Waits for the next event until `until_ns`; the caller promises to send nothing until `frames` more frames of other
    /// nodes have arrived. Handles all events except frames of other nodes.
    ///
    /// # Errors
    /// If the bus itself fails.
    pub fn receive(&mut self, until_ns: u64, frames: u32) -> Result<Received, LoopError> {
        let Some(event) = self.bus.receive_with_lookahead(until_ns, frames)? else {
            return Ok(Received::Nothing);
        };
        match event {
            Event::Sent(frame) => {
                self.unconfirmed.confirm(&frame);
                self.counters.busy_ns += self.rates.duration_ns(&frame);
            }
            Event::Frame(frame) => {
                self.counters.busy_ns += self.rates.duration_ns(&frame);
                return Ok(Received::Frame(frame));
            }
            Event::Fault(BusFault::BusOff) => self.bus_off = true,
            Event::Fault(BusFault::Restarted) => self.bus_off = false,
            Event::Fault(BusFault::Overrun) => self.counters.overruns += 1,
            Event::Fault(_) => {}
        }
        Ok(Received::Other)
    }

    /// Ends a cycle: frames that are not confirmed by now count as lost.
    pub fn end_cycle(&mut self) {
        let lost = self.unconfirmed.take_count();
        self.counters.tx_lost += lost;
        self.frames_lost = lost > 0;
    }

    /// Counts missing replies.
    pub fn count_lost_replies(&mut self, replies: u64) {
        self.counters.replies_lost += replies;
    }

    /// Whether frames of the previous cycle were not sent.
    pub fn frames_lost(&self) -> bool {
        self.frames_lost
    }

    /// Whether the CAN interface is bus-off.
    pub fn bus_off(&self) -> bool {
        self.bus_off
    }

    /// Returns the counters since the start.
    pub fn counters(&self) -> DriveCounters {
        self.counters
    }
}

/// Result of [`BusPort::receive`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A frame of another node.
    Frame(CanFrame),
    /// An event that the port has handled.
    Other,
    /// No event arrived until the time.
    Nothing,
}
