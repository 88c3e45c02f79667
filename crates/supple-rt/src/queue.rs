//! Requests that wait for their cycle.
//!
//! Those that are due are heard in the order in which they came, one a cycle. When the arm is let go of, or a
//! fault stops it, what still waits was asked of another situation and is dropped.

use supple_ipc::message::OperatorRequest;

/// Most requests that wait.
pub const ROOM: usize = 16;

/// Requests in the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Queue {
    places: [Option<OperatorRequest>; ROOM],
    waiting: usize,
}

impl Queue {
    /// Puts a request last; false where there is no room.
    pub fn push(&mut self, request: OperatorRequest) -> bool {
        let Some(place) = self.places.get_mut(self.waiting) else {
            return false;
        };
        *place = Some(request);
        self.waiting += 1;
        true
    }

    /// Takes the first that may be heard in this cycle.
    pub fn due(&mut self, cycle: u64) -> Option<OperatorRequest> {
        let is_due = |place: &Option<OperatorRequest>| place.is_some_and(|r| r.is_due(cycle));
        let first = self.places[..self.waiting].iter().position(is_due)?;
        self.take(first)
    }

    /// Takes the first, due or not.
    pub fn pop(&mut self) -> Option<OperatorRequest> {
        self.take(0)
    }

    fn take(&mut self, place: usize) -> Option<OperatorRequest> {
        let taken = self.places[place].take()?;
        self.places[place..self.waiting].rotate_left(1);
        self.waiting -= 1;
        Some(taken)
    }
}
