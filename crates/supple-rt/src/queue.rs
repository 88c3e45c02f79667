//! Requests that wait for their cycle.
//!
//! Those that are due are heard in the order in which they came, one a cycle; one for idle goes before all others. When
//! the arm is let go of, or a fault stops it, what still waits was asked of another situation and is dropped. No operator
//! has more than half of the places, so that one who floods them leaves room for the others.

use core::fmt;
use supple_ipc::message::OperatorRequest;

/// Most requests that wait.
pub const ROOM: usize = 16;
/// Most of one operator.
pub const ROOM_OF_ONE: usize = 8;

/// Why a request finds no place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlace {
    /// All places are taken.
    Full,
    /// Its operator has taken his share.
    Share,
}

impl fmt::Display for NoPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoPlace::Full => f.write_str("too many requests wait for their cycle"),
            NoPlace::Share => write!(
                f,
                "{ROOM_OF_ONE} requests of this operator wait for their cycle, more may not"
            ),
        }
    }
}

/// Requests in the order in which they came.
#[derive(Clone, Debug, Default)]
pub struct Queue {
    places: [Option<OperatorRequest>; ROOM],
    waiting: usize,
}

impl Queue {
    /// Puts a request last.
    ///
    /// # Errors
    /// [`NoPlace`].
    pub fn push(&mut self, request: OperatorRequest) -> Result<(), NoPlace> {
        let waiting = self.places.iter().flatten();
        let of_one = waiting.filter(|waits| waits.operator == request.operator);
        if of_one.count() >= ROOM_OF_ONE {
            return Err(NoPlace::Share);
        }
        let place = self.places.get_mut(self.waiting).ok_or(NoPlace::Full)?;
        *place = Some(request);
        self.waiting += 1;
        Ok(())
    }

    /// Takes the first that may be heard in this cycle, one for idle before others.
    pub fn due(&mut self, cycle: u64) -> Option<OperatorRequest> {
        let waiting = self.places[..self.waiting].iter().flatten();
        let mut due = waiting.enumerate().filter(|(_, r)| r.is_due(cycle));
        let idle = due.clone().find(|(_, r)| r.asks_for_idle());
        let (place, _) = idle.or_else(|| due.next())?;
        self.take(place)
    }

    /// Nothing waits.
    pub fn is_empty(&self) -> bool {
        self.waiting == 0
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
