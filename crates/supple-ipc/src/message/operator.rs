//! Operator requests and the controller's replies.

use super::Text;
use super::common::{MessageError, expect_dof};
use iceoryx2::prelude::ZeroCopySend;
use supple_core::codes::{self, RequestCode, VALUES, request_kind};
use supple_core::controller::{Mode, Request};

/// A request of an operator. The controller checks every field before it uses the request.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.OperatorRequest.v1")]
pub struct OperatorRequest {
    /// Unique id of the operator.
    pub operator: u64,
    /// Sequence number of the operator's request, from 1.
    pub sequence: u64,
    /// Earliest cycle in which the request takes effect, if `has_at_cycle` is 1.
    pub at_cycle: u64,
    /// Values of the request, see [`RequestCode`].
    pub values: [f64; VALUES],
    /// Number of joints of the arm that the request is for.
    pub dof: u8,
    /// Kind of request.
    pub kind: u8,
    /// Kind of trajectory of a track request.
    pub trajectory: u8,
    /// Number of valid entries in `values`.
    pub count: u8,
    /// 1 if the request waits for `at_cycle`, 0 if it takes effect in the next cycle.
    pub has_at_cycle: u8,
    /// Zero.
    pub reserved: [u8; 3],
}

impl OperatorRequest {
    /// Encodes a request to an arm with `N` joints.
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

    /// Decodes the request; `None` if the kind is "none".
    ///
    /// # Errors
    /// [`MessageError`] if the request is for another arm or invalid.
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

    /// Requests idle in the next cycle; such requests take priority over all others.
    pub fn requests_idle_now(&self) -> bool {
        !self.is_scheduled() && self.requests_idle()
    }

    /// Whether the request is a set-point; a newer set-point replaces an older one that waits.
    pub fn is_set_point(&self) -> bool {
        self.kind == request_kind::SET_POINT
    }

    /// Whether the request waits for a given cycle.
    pub fn is_scheduled(&self) -> bool {
        self.has_at_cycle != 0
    }

    /// Whether the request is for idle, now or in a given cycle.
    pub fn requests_idle(&self) -> bool {
        self.kind == request_kind::IDLE
    }

    /// Whether the request is for the cycle `idle` or an earlier one. The idle request that was accepted in that cycle then
    /// overrides it.
    pub fn is_before(&self, idle: u64) -> bool {
        self.is_scheduled() && !self.requests_idle() && self.at_cycle <= idle
    }

    /// Whether the request may take effect in this cycle.
    pub fn is_due(&self, cycle: u64) -> bool {
        !self.is_scheduled() || cycle >= self.at_cycle
    }
}

/// Result of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// The request is queued until its cycle; a second reply will follow.
    Queued = 1,
    /// The controller executes the request.
    Accepted = 2,
    /// The controller refuses the request; the text gives the reason.
    Refused = 3,
}

impl Outcome {
    /// Converts a code; an unknown code becomes [`Outcome::Refused`].
    pub fn from_code(code: u8) -> Outcome {
        [Outcome::Queued, Outcome::Accepted]
            .into_iter()
            .find(|outcome| *outcome as u8 == code)
            .unwrap_or(Outcome::Refused)
    }
}

/// The reply of the controller to a request.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.OperatorReply.v1")]
pub struct OperatorReply {
    /// Id of the operator.
    pub operator: u64,
    /// Sequence number of the request.
    pub sequence: u64,
    /// Cycle in which the controller received the request.
    pub cycle: u64,
    /// Reason for a refusal; empty otherwise.
    pub text: Text,
    /// A code of [`Outcome`].
    pub outcome: u8,
    /// Mode after the request, a code of [`codes::MODES`].
    pub mode: u8,
    /// Zero.
    pub reserved: [u8; 6],
}

impl OperatorReply {
    /// Creates the reply to a request.
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

    /// Returns the result; an unknown code becomes [`Outcome::Refused`].
    pub fn outcome(&self) -> Outcome {
        Outcome::from_code(self.outcome)
    }

    /// Returns the mode after the request; `None` if this version does not know its code.
    pub fn mode(&self) -> Option<Mode> {
        codes::mode(self.mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idle_is_recognised_by_its_code() {
        let requests =
            |request: Request<4>| OperatorRequest::new(1, 1, None, &request).requests_idle();
        assert!(requests(Request::Idle));
        assert!(!requests(Request::GravityHold) && !requests(Request::Reset));
        let later = OperatorRequest::new(1, 1, Some(5), &Request::<4>::Idle);
        assert!(later.requests_idle() && !later.requests_idle_now());
    }
}
