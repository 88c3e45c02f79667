//! What passes between the loop and its helper: rings of fixed size, one writer and one reader each.

use rtrb::{Consumer, Producer, RingBuffer};
use supple_ipc::message::{OperatorReply, OperatorRequest, Telemetry};
use supple_realtime::Pulse;

/// Cycles that the helper may be behind.
const TELEMETRY: usize = 1024;
const REQUESTS: usize = 16;
const REPLIES: usize = 64;

/// The loop's ends.
#[derive(Debug)]
pub struct Inside {
    pub(crate) telemetry: Producer<Telemetry>,
    pub(crate) requests: Consumer<OperatorRequest>,
    pub(crate) replies: Producer<OperatorReply>,
    pub(crate) pulse: Pulse,
}

/// The helper's ends.
#[derive(Debug)]
pub struct Outside {
    pub(crate) telemetry: Consumer<Telemetry>,
    pub(crate) requests: Producer<OperatorRequest>,
    pub(crate) replies: Consumer<OperatorReply>,
    pub(crate) pulse: Pulse,
}

/// All rings, empty.
pub fn rings() -> (Inside, Outside) {
    let (telemetry_in, telemetry_out) = RingBuffer::new(TELEMETRY);
    let (requests_in, requests_out) = RingBuffer::new(REQUESTS);
    let (replies_in, replies_out) = RingBuffer::new(REPLIES);
    let inside = Inside {
        telemetry: telemetry_in,
        requests: requests_out,
        replies: replies_in,
        pulse: Pulse::default(),
    };
    let outside = Outside {
        telemetry: telemetry_out,
        requests: requests_in,
        replies: replies_out,
        pulse: Pulse::default(),
    };
    (inside, outside)
}

impl Inside {
    /// Counts the loop's turns.
    pub fn pulse(&self) -> Pulse {
        self.pulse.clone()
    }
}

impl Outside {
    /// Counts the helper's turns.
    pub fn pulse(&self) -> Pulse {
        self.pulse.clone()
    }

    /// Telemetry that was not taken yet.
    pub fn telemetry(&mut self) -> Option<Telemetry> {
        self.telemetry.pop().ok()
    }

    /// Replies that were not taken yet.
    pub fn reply(&mut self) -> Option<OperatorReply> {
        self.replies.pop().ok()
    }

    /// Hands a request in; false where too many wait.
    pub fn request(&mut self, request: OperatorRequest) -> bool {
        self.requests.push(request).is_ok()
    }

    /// The loop has ended and everything of it was taken.
    pub fn ended(&self) -> bool {
        self.telemetry.is_abandoned() && self.telemetry.is_empty() && self.replies.is_empty()
    }
}
