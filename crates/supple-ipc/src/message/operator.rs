//! What an operator asks of the controller, and what it answers.

use super::{MessageError, Text, expect_dof};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::codes::{self, RequestCode, VALUES};
use supple_core::controller::{Mode, Request};

/// Kind of a request for idle, see [`RequestCode`].
const IDLE: u8 = 1;

/// A request, checked in the controller and never trusted.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.OperatorRequest.v1")]
pub struct OperatorRequest {
    /// Who asks: a number of its own for each operator.
    pub operator: u64,
    /// Which of its requests, from 1.
    pub sequence: u64,
    /// The first cycle in which it may be heard, where `has_at_cycle`.
    pub at_cycle: u64,
    /// What the request carries, see [`RequestCode`].
    pub values: [f64; VALUES],
    /// Joints of the arm that the operator has in mind.
    pub dof: u8,
    /// Kind of request.
    pub kind: u8,
    /// Kind of trajectory, of a track request.
    pub trajectory: u8,
    /// How many of `values` count.
    pub count: u8,
    /// 1 where the request waits for `at_cycle`, 0 where it is heard in the next cycle.
    pub has_at_cycle: u8,
    /// Zero.
    pub reserved: [u8; 3],
}

impl OperatorRequest {
    /// A request to an arm with `N` joints.
    pub fn new<const N: usize>(
        operator: u64,
        sequence: u64,
        at_cycle: Option<u64>,
        request: &Request<N>,
    ) -> OperatorRequest {
        let code = RequestCode::new(Some(request));
        OperatorRequest {
            operator,
            sequence,
            at_cycle: at_cycle.unwrap_or_default(),
            values: code.values,
            dof: N as u8,
            kind: code.kind,
            trajectory: code.trajectory,
            count: code.count,
            has_at_cycle: u8::from(at_cycle.is_some()),
            reserved: [0; 3],
        }
    }

    /// What is asked; `None` where nothing is.
    ///
    /// # Errors
    /// [`MessageError`] where it is meant for another arm or is no request at all.
    pub fn request<const N: usize>(&self) -> Result<Option<Request<N>>, MessageError> {
        expect_dof("the request", self.dof, N)?;
        let code = RequestCode {
            kind: self.kind,
            trajectory: self.trajectory,
            count: self.count,
            values: self.values,
        };
        code.request().map_err(MessageError::Request)
    }

    /// It asks for idle in the next cycle, and goes before all that does not.
    pub fn is_for_idle_now(&self) -> bool {
        self.has_at_cycle == 0 && self.asks_for_idle()
    }

    /// It asks for idle, now or in its cycle.
    pub fn asks_for_idle(&self) -> bool {
        self.kind == IDLE
    }

    /// It may be heard in this cycle.
    pub fn is_due(&self, cycle: u64) -> bool {
        self.has_at_cycle == 0 || cycle >= self.at_cycle
    }
}

/// What became of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// The controller has it and it waits for its cycle; another reply will follow.
    Queued = 1,
    /// The controller does it.
    Accepted = 2,
    /// The controller does not, and says why.
    Refused = 3,
}

impl Outcome {
    /// By its number; what is not known counts as refused.
    pub fn from_code(code: u8) -> Outcome {
        [Outcome::Queued, Outcome::Accepted]
            .into_iter()
            .find(|outcome| *outcome as u8 == code)
            .unwrap_or(Outcome::Refused)
    }
}

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.OperatorReply.v1")]
pub struct OperatorReply {
    /// Whose request it was.
    pub operator: u64,
    /// Which of them.
    pub sequence: u64,
    /// Cycle in which it was heard.
    pub cycle: u64,
    /// Why not, where refused.
    pub text: Text,
    /// A number of [`Outcome`].
    pub outcome: u8,
    /// Mode after it, a number of [`codes::MODES`].
    pub mode: u8,
    /// Zero.
    pub reserved: [u8; 6],
}

impl OperatorReply {
    /// To a request.
    pub fn new(
        request: &OperatorRequest,
        cycle: u64,
        mode: Mode,
        outcome: Outcome,
        text: Text,
    ) -> OperatorReply {
        OperatorReply {
            operator: request.operator,
            sequence: request.sequence,
            cycle,
            text,
            outcome: outcome as u8,
            mode: mode as u8,
            reserved: [0; 6],
        }
    }

    /// What became of it; what is not known counts as refused.
    pub fn outcome(&self) -> Outcome {
        Outcome::from_code(self.outcome)
    }

    /// Mode after it, if this version knows it.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idle_is_known_by_its_number() {
        let asks = |request: Request<4>| OperatorRequest::new(1, 1, None, &request).asks_for_idle();
        assert!(asks(Request::Idle));
        assert!(!asks(Request::GravityHold) && !asks(Request::Reset));
        let later = OperatorRequest::new(1, 1, Some(5), &Request::<4>::Idle);
        assert!(later.asks_for_idle() && !later.is_for_idle_now());
    }
}
