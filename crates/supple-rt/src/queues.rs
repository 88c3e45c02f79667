//! Queues between the control loop and the non-realtime threads: ring buffers of fixed size with one producer and one
//! consumer each.
//!
//! Idle requests have reserved entries in the request queue, and a separate channel: an atomic number that the loop
//! reads first in each cycle ([`idle_channel`]).

use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use supple_ipc::message::{OperatorReply, OperatorRequest, Telemetry};
use supple_realtime::LivenessCounter;

/// Telemetry queue length, in cycles.
const TELEMETRY: usize = 1024;
/// Capacity for all requests between two cycles.
const REQUESTS: usize = 16;
/// Additional capacity that only idle requests may use.
const IDLE_REQUESTS: usize = 8;
const REPLIES: usize = 64;
/// Capacity for the learner's requests, which wait for their cycles: enough for seven joints at 250 Hz, see
/// [`supple_learning::requests_in_flight`].
const LEARNED: usize = 128;
/// Capacity for replies to idle requests; the loop sends at most one per cycle.
const IDLE_REPLIES: usize = 64;

/// The loop's side of the queues.
#[derive(Debug)]
pub struct LoopQueues {
    pub(crate) telemetry: Producer<Telemetry>,
    pub(crate) requests: Consumer<OperatorRequest>,
    pub(crate) replies: Producer<OperatorReply>,
    pub(crate) learned: Consumer<OperatorRequest>,
    pub(crate) liveness: LivenessCounter,
    pub(crate) states_dropped: Arc<AtomicU64>,
}

/// The helper's side of the queues.
#[derive(Debug)]
pub struct HelperQueues {
    pub(crate) telemetry: Consumer<Telemetry>,
    pub(crate) requests: Producer<OperatorRequest>,
    pub(crate) replies: Consumer<OperatorReply>,
    pub(crate) learned: Producer<OperatorRequest>,
    pub(crate) liveness: LivenessCounter,
    pub(crate) states_dropped: Arc<AtomicU64>,
}

/// Creates all queues.
pub fn loop_queues() -> (LoopQueues, HelperQueues) {
    let (telemetry_in, telemetry_out) = RingBuffer::new(TELEMETRY);
    let (requests_in, requests_out) = RingBuffer::new(REQUESTS + IDLE_REQUESTS);
    let (replies_in, replies_out) = RingBuffer::new(REPLIES);
    let (learned_in, learned_out) = RingBuffer::new(LEARNED);
    let states_dropped = Arc::new(AtomicU64::new(0));
    let loop_end = LoopQueues {
        telemetry: telemetry_in,
        requests: requests_out,
        replies: replies_in,
        learned: learned_out,
        liveness: LivenessCounter::default(),
        states_dropped: states_dropped.clone(),
    };
    let helper_end = HelperQueues {
        telemetry: telemetry_out,
        requests: requests_in,
        replies: replies_out,
        learned: learned_in,
        liveness: LivenessCounter::default(),
        states_dropped,
    };
    (loop_end, helper_end)
}

impl LoopQueues {
    /// Liveness counter of the loop.
    pub fn liveness(&self) -> LivenessCounter {
        self.liveness.clone()
    }

    /// Whether the helper thread has ended, so that no request can arrive any more.
    pub(crate) fn peer_dropped(&self) -> bool {
        self.telemetry.is_abandoned()
    }
}

impl HelperQueues {
    /// Liveness counter of the helper.
    pub fn liveness(&self) -> LivenessCounter {
        self.liveness.clone()
    }

    /// Removes and returns the oldest telemetry in the queue.
    pub fn telemetry(&mut self) -> Option<Telemetry> {
        self.telemetry.pop().ok()
    }

    /// Removes and returns the oldest reply in the queue.
    pub fn reply(&mut self) -> Option<OperatorReply> {
        self.replies.pop().ok()
    }

    /// Queues a request; returns false if the queue is full.
    pub fn request(&mut self, request: OperatorRequest) -> bool {
        let reserved = match request.requests_idle_now() {
            true => 0,
            false => IDLE_REQUESTS,
        };
        self.requests.slots() > reserved && self.requests.push(request).is_ok()
    }

    /// Queues a request of the learner; returns false if the queue is full and the request is lost.
    pub fn learned(&mut self, request: OperatorRequest) -> bool {
        self.learned.push(request).is_ok()
    }

    /// Number of arm states that the loop has discarded because they are not from this system's plant or not of this arm.
    pub fn states_dropped(&self) -> u64 {
        self.states_dropped.load(Ordering::Relaxed)
    }

    /// Whether the loop has ended and its queues are empty.
    pub fn ended(&self) -> bool {
        self.telemetry.is_abandoned() && self.telemetry.is_empty() && self.replies.is_empty()
    }
}

/// The loop's side of the channel for idle requests.
#[derive(Debug)]
pub struct LoopIdleChannel {
    last_batch: Arc<AtomicU64>,
    answered: u64,
    replies: Producer<OperatorReply>,
}

/// The side of the channel in the thread for idle requests.
#[derive(Debug)]
pub struct IdleThreadChannel {
    last_batch: Arc<AtomicU64>,
    replies: Consumer<OperatorReply>,
}

/// Creates the channel for idle requests: the number of the last batch of requests, so it can never be full.
pub fn idle_channel() -> (LoopIdleChannel, IdleThreadChannel) {
    let last_batch = Arc::new(AtomicU64::new(0));
    let (replies_in, replies_out) = RingBuffer::new(IDLE_REPLIES);
    let loop_end = LoopIdleChannel {
        last_batch: last_batch.clone(),
        answered: 0,
        replies: replies_in,
    };
    let thread_end = IdleThreadChannel {
        last_batch,
        replies: replies_out,
    };
    (loop_end, thread_end)
}

impl LoopIdleChannel {
    /// Returns the number of the last batch of requests, if it has not been answered.
    pub(crate) fn pending_request(&self) -> Option<u64> {
        let last_batch = self.last_batch.load(Ordering::Acquire);
        (last_batch != self.answered).then_some(last_batch)
    }

    /// Replies to all batches up to the reply's number. If the reply queue is full, the requests stay pending until
    /// the next cycle.
    pub(crate) fn answer(&mut self, reply: OperatorReply) {
        if self.replies.push(reply).is_ok() {
            self.answered = reply.sequence;
        }
    }

    /// Whether the thread for idle requests has ended.
    pub(crate) fn peer_dropped(&self) -> bool {
        self.replies.is_abandoned()
    }
}

impl IdleThreadChannel {
    /// Requests idle for the batch of this number, which must be above that of the last batch.
    pub fn set_requested(&self, batch: u64) {
        self.last_batch.store(batch, Ordering::Release);
    }

    /// Removes and returns the oldest reply in the queue.
    pub fn reply(&mut self) -> Option<OperatorReply> {
        self.replies.pop().ok()
    }

    /// Whether the loop has ended.
    pub fn ended(&self) -> bool {
        self.replies.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use super::LEARNED;
    use supple_learning::requests_in_flight;

    /// At low rates more of the learner's estimates wait for their cycle.
    #[test]
    fn the_learners_requests_fit_at_every_rate() {
        for rate_hz in [250.0, 400.0, 500.0, 1000.0] {
            assert!(
                requests_in_flight(7, 1.0 / rate_hz) <= LEARNED,
                "{rate_hz} Hz"
            );
        }
    }
}
