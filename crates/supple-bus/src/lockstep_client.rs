//! Client side of the lockstep protocol: frames not yet sent to the arm's process, and received events not yet
//! returned to the caller.

use crate::bus::Event;
use crate::endpoint::{Delivery, Endpoint};
use crate::error::BusError;
use crate::message::{ENTRIES, Entry, Kind, MAX_BYTES, Message};
use std::collections::VecDeque;
use supple_can_frame::CanFrame;

#[derive(Debug)]
pub(crate) struct LockstepClient {
    request: Message,
    received_events: VecDeque<Entry>,
    /// Time up to which the arm has run without further events \[ns\].
    reached_ns: Option<u64>,
    bytes: [u8; MAX_BYTES],
}

/// Next item of the buffered answer.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NextItem {
    Event(Entry),
    /// The requested time was reached \[ns\].
    Reached(u64),
    /// No event is buffered: a request must be sent.
    NeedRequest,
}

impl LockstepClient {
    pub fn new() -> LockstepClient {
        LockstepClient {
            request: Message::new(Kind::RunUntil, 0, 0),
            received_events: VecDeque::with_capacity(ENTRIES),
            reached_ns: None,
            bytes: [0; MAX_BYTES],
        }
    }

    /// Queues a frame for the next request; the emulator puts it on the bus at `time_ns`.
    pub fn queue_frame(&mut self, frame: &CanFrame, time_ns: u64) -> Result<(), BusError> {
        match self.request.push(time_ns, Event::Sent(*frame)) {
            true => Ok(()),
            false => Err(BusError::Full),
        }
    }

    /// Returns the next buffered item for a host that waits until `until_ns`.
    pub fn next(&mut self, until_ns: u64) -> NextItem {
        if let Some(entry) = self.received_events.pop_front() {
            return NextItem::Event(entry);
        }
        match self.reached_ns.take() {
            Some(reached_ns) if until_ns <= reached_ns && self.request.is_empty() => {
                NextItem::Reached(reached_ns)
            }
            _ => NextItem::NeedRequest,
        }
    }

    /// Prepares the next request, which contains all queued frames: run until `until_ns`, or until `frames` frames of
    /// other nodes have arrived.
    pub fn prepare_request(&mut self, until_ns: u64, frames: u32) -> &mut Message {
        self.request.sequence = self.request.sequence.wrapping_add(1);
        self.request.time_ns = until_ns;
        self.request.frames = frames;
        &mut self.request
    }

    /// Sends the prepared request.
    pub fn send_request(&mut self, endpoint: &Endpoint) -> Result<Delivery, BusError> {
        endpoint.send(self.request.emit(&mut self.bytes))
    }

    /// Removes all frames from the request, so that they are not sent twice.
    pub fn clear_request(&mut self) {
        self.request.clear();
    }

    /// Returns the answer to the last request, if it has arrived. Discards answers to earlier requests that timed out, with
    /// their events.
    pub fn answer(&mut self, endpoint: &Endpoint) -> Result<Option<Message>, BusError> {
        while let Some(bytes) = endpoint.receive_into(&mut self.bytes)? {
            let answer = Message::parse(bytes).filter(|m| m.kind != Kind::RunUntil);
            if let Some(answer) = answer
                && answer.sequence == self.request.sequence
            {
                self.received_events.extend(answer.entries());
                self.reached_ns = (answer.kind == Kind::Reached).then_some(answer.time_ns);
                return Ok(Some(answer));
            }
        }
        Ok(None)
    }
}
