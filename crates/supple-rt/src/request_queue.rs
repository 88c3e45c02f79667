//! Queue of requests that wait for their cycle.
//!
//! The loop executes due requests in order of arrival, one per cycle; idle requests come first. When the arm enters idle, a
//! fault latches, or an operator requests gravity hold or float for the next cycle, the loop refuses all requests that were
//! queued before, because they were sent under other conditions. One operator can use at most half of the queue, so that it
//! cannot block the others. A new set-point of an operator replaces the older one in the queue, which gets no reply.

use core::fmt;
use supple_ipc::message::OperatorRequest;

/// Maximum number of queued requests.
pub const CAPACITY: usize = 16;
/// Maximum number of queued requests of one operator.
pub const CAPACITY_PER_OPERATOR: usize = 8;

/// Reason why a request cannot be queued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueueFull {
    /// The queue is full.
    Full,
    /// This operator has reached its quota.
    OperatorQuota,
}

impl fmt::Display for QueueFull {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            QueueFull::Full => f.write_str("too many requests are queued"),
            QueueFull::OperatorQuota => write!(
                f,
                "this operator has {CAPACITY_PER_OPERATOR} queued requests, which is the maximum"
            ),
        }
    }
}

/// Queue of requests in order of arrival.
#[derive(Clone, Debug, Default)]
pub struct RequestQueue {
    entries: [Option<OperatorRequest>; CAPACITY],
    length: usize,
}

impl RequestQueue {
    /// Appends a request, or replaces an older set-point by a newer one.
    ///
    /// # Errors
    /// [`QueueFull`] with the exhausted limit.
    pub fn push(&mut self, request: OperatorRequest) -> Result<(), QueueFull> {
        if request.is_set_point() && !request.is_scheduled() {
            let entries = self.entries[..self.length].iter_mut().flatten();
            let mut older = entries.filter(|queued| {
                queued.operator == request.operator
                    && queued.is_set_point()
                    && !queued.is_scheduled()
            });
            if let Some(older) = older.next() {
                *older = request;
                return Ok(());
            }
        }
        let queued = self.entries.iter().flatten();
        let same_operator = queued.filter(|queued| queued.operator == request.operator);
        if same_operator.count() >= CAPACITY_PER_OPERATOR {
            return Err(QueueFull::OperatorQuota);
        }
        let entry = self.entries.get_mut(self.length).ok_or(QueueFull::Full)?;
        *entry = Some(request);
        self.length += 1;
        Ok(())
    }

    /// Removes and returns the first due request, with the number of requests that arrived before it and are still queued. Due
    /// idle requests come first.
    pub fn pop_due(&mut self, cycle: u64) -> Option<(usize, OperatorRequest)> {
        let queued = self.entries[..self.length].iter().flatten();
        let mut due = queued.enumerate().filter(|(_, r)| r.is_due(cycle));
        let idle = due.clone().find(|(_, r)| r.requests_idle());
        let (index, _) = idle.or_else(|| due.next())?;
        self.take(index).map(|request| (index, request))
    }

    /// Number of queued requests.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether the queue is empty.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Removes and returns the first request, due or not.
    pub fn pop(&mut self) -> Option<OperatorRequest> {
        self.take(0)
    }

    fn take(&mut self, index: usize) -> Option<OperatorRequest> {
        let taken = self.entries[index].take()?;
        self.entries[index..self.length].rotate_left(1);
        self.length -= 1;
        Some(taken)
    }
}
