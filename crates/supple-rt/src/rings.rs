//! What passes between the loop and the threads that may wait: rings of fixed size, one writer and one reader each.
//!
//! Requests for idle have places that others do not get, and a way past all rings: a number that the loop looks at
//! first in each cycle ([`idle_path`]).

use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use supple_ipc::message::{OperatorReply, OperatorRequest, Telemetry};
use supple_realtime::Pulse;

/// Cycles that the helper may be behind.
const TELEMETRY: usize = 1024;
/// Requests that are handed over between two cycles, and places beside for those for idle.
const REQUESTS: usize = 16;
const IDLE_REQUESTS: usize = 8;
const REPLIES: usize = 64;
/// One a cycle.
const IDLE_REPLIES: usize = 64;

/// The loop's ends.
#[derive(Debug)]
pub struct Inside {
    pub(crate) telemetry: Producer<Telemetry>,
    pub(crate) requests: Consumer<OperatorRequest>,
    pub(crate) replies: Producer<OperatorReply>,
    pub(crate) pulse: Pulse,
    pub(crate) states_dropped: Arc<AtomicU64>,
}

/// The helper's ends.
#[derive(Debug)]
pub struct Outside {
    pub(crate) telemetry: Consumer<Telemetry>,
    pub(crate) requests: Producer<OperatorRequest>,
    pub(crate) replies: Consumer<OperatorReply>,
    pub(crate) pulse: Pulse,
    pub(crate) states_dropped: Arc<AtomicU64>,
}

/// All rings, empty.
pub fn rings() -> (Inside, Outside) {
    let (telemetry_in, telemetry_out) = RingBuffer::new(TELEMETRY);
    let (requests_in, requests_out) = RingBuffer::new(REQUESTS + IDLE_REQUESTS);
    let (replies_in, replies_out) = RingBuffer::new(REPLIES);
    let states_dropped = Arc::new(AtomicU64::new(0));
    let inside = Inside {
        telemetry: telemetry_in,
        requests: requests_out,
        replies: replies_in,
        pulse: Pulse::default(),
        states_dropped: states_dropped.clone(),
    };
    let outside = Outside {
        telemetry: telemetry_out,
        requests: requests_in,
        replies: replies_out,
        pulse: Pulse::default(),
        states_dropped,
    };
    (inside, outside)
}

impl Inside {
    /// Counts the loop's turns.
    pub fn pulse(&self) -> Pulse {
        self.pulse.clone()
    }

    /// Whoever hands over requests and takes telemetry is gone: nobody is heard any more.
    pub(crate) fn is_alone(&self) -> bool {
        self.telemetry.is_abandoned()
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
        let kept_free = match request.is_for_idle_now() {
            true => 0,
            false => IDLE_REQUESTS,
        };
        self.requests.slots() > kept_free && self.requests.push(request).is_ok()
    }

    /// Arm states that the loop has dropped.
    pub fn states_dropped(&self) -> u64 {
        self.states_dropped.load(Ordering::Relaxed)
    }

    /// The loop has ended and everything of it was taken.
    pub fn ended(&self) -> bool {
        self.telemetry.is_abandoned() && self.telemetry.is_empty() && self.replies.is_empty()
    }
}

/// The loop's end of the way for idle.
#[derive(Debug)]
pub struct IdleInside {
    asked: Arc<AtomicU64>,
    answered: u64,
    replies: Producer<OperatorReply>,
}

/// The other end of it.
#[derive(Debug)]
pub struct IdleOutside {
    asked: Arc<AtomicU64>,
    replies: Consumer<OperatorReply>,
}

/// The way for requests for idle: a number that goes up with each, so that there is no room to run out of.
pub fn idle_path() -> (IdleInside, IdleOutside) {
    let asked = Arc::new(AtomicU64::new(0));
    let (replies_in, replies_out) = RingBuffer::new(IDLE_REPLIES);
    let inside = IdleInside {
        asked: asked.clone(),
        answered: 0,
        replies: replies_in,
    };
    let outside = IdleOutside {
        asked,
        replies: replies_out,
    };
    (inside, outside)
}

impl IdleInside {
    /// The number of the last request that was not answered yet.
    pub(crate) fn asked(&self) -> Option<u64> {
        let asked = self.asked.load(Ordering::Acquire);
        (asked != self.answered).then_some(asked)
    }

    /// Answers all requests up to that of the reply. Where that finds no room, they are heard again in the next cycle.
    pub(crate) fn answer(&mut self, reply: OperatorReply) {
        if self.replies.push(reply).is_ok() {
            self.answered = reply.sequence;
        }
    }

    /// Nobody can ask any more.
    pub(crate) fn is_alone(&self) -> bool {
        self.replies.is_abandoned()
    }
}

impl IdleOutside {
    /// Asks for idle, as number `asked`: one more than the last.
    pub fn ask(&self, asked: u64) {
        self.asked.store(asked, Ordering::Release);
    }

    /// Replies that were not taken yet.
    pub fn reply(&mut self) -> Option<OperatorReply> {
        self.replies.pop().ok()
    }

    /// The loop has ended.
    pub fn ended(&self) -> bool {
        self.replies.is_abandoned()
    }
}
