//! Modes, faults, refusals and requests as numbers: what shared memory and logs carry.
//!
//! A number once given keeps its meaning. Zero is "none" where there can be none. The bytes of a message or
//! a log are not here.

mod request;

pub use request::{RequestCode, RequestCodeError, VALUES};

use crate::controller::{Fault, Mode, Refusal, SafeAction};

/// Every mode, at the place of its number.
pub const MODES: [Mode; 8] = [
    Mode::Idle,
    Mode::GravityHold,
    Mode::Move,
    Mode::Track,
    Mode::Probe,
    Mode::Fault,
    Mode::Excite,
    Mode::Breakaway,
];

/// A mode by its number.
pub fn mode(code: u8) -> Option<Mode> {
    MODES.get(usize::from(code)).copied()
}

/// A fault as numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultCode {
    /// Kind, from 1; 0 is no fault.
    pub kind: u8,
    /// Joint index, or -1.
    pub joint: i8,
    /// What broke the limit, zero where the fault has none.
    pub value: f64,
    /// The limit, zero where the fault has none.
    pub limit: f64,
}

impl FaultCode {
    /// No fault.
    pub const NONE: FaultCode = FaultCode {
        kind: 0,
        joint: -1,
        value: 0.0,
        limit: 0.0,
    };

    /// Of a latched fault.
    pub fn new(fault: Option<&Fault>) -> FaultCode {
        let index = |joint: usize| i8::try_from(joint).unwrap_or(i8::MAX);
        let Some(fault) = fault else {
            return FaultCode::NONE;
        };
        let (kind, joint, value, limit) = match *fault {
            Fault::MeasurementNotFinite { joint } => (1, joint.map_or(-1, index), 0.0, 0.0),
            Fault::EncoderLost { joint } => (2, index(joint), 0.0, 0.0),
            Fault::StateStale { cycles, limit } => (3, -1, cycles as f64, f64::from(limit)),
            Fault::StateOutOfOrder { last, received } => (4, -1, received as f64, last as f64),
            Fault::JointPosition {
                joint,
                value_rad,
                limit_rad,
            } => (5, index(joint), value_rad, limit_rad),
            Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => (6, index(joint), value_rad_per_s, limit_rad_per_s),
            Fault::TipSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => (7, -1, value_m_per_s, limit_m_per_s),
            Fault::TrackingError { value_m, limit_m } => (8, -1, value_m, limit_m),
            Fault::MassMatrix => (9, -1, 0.0, 0.0),
            Fault::TorqueNotFinite { .. } => (10, -1, 0.0, 0.0),
            Fault::EncoderJump {
                joint,
                value_rad,
                limit_rad,
            } => (11, index(joint), value_rad, limit_rad),
            Fault::JointTrackingError {
                joint,
                value_rad,
                limit_rad,
            } => (12, index(joint), value_rad, limit_rad),
            Fault::JointCollision {
                joint,
                value_nm,
                limit_nm,
            } => (13, index(joint), value_nm, limit_nm),
            Fault::TipCollision { value_n, limit_n } => (14, -1, value_n, limit_n),
            Fault::EncoderStuck {
                joint,
                value_rad,
                limit_rad,
            } => (15, index(joint), value_rad, limit_rad),
            Fault::EncoderUnreliable { joint } => (16, index(joint), 0.0, 0.0),
            Fault::AgainstTorque {
                joint,
                value_nm,
                limit_nm,
            } => (17, index(joint), value_nm, limit_nm),
            Fault::UnmodelledLoad { value_n, limit_n } => (18, -1, value_n, limit_n),
            Fault::Workspace { value_m, border } => (19, -1, value_m, border as f64),
            Fault::ZoneSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => (20, -1, value_m_per_s, limit_m_per_s),
            Fault::ZoneForce { value_n, limit_n } => (21, -1, value_n, limit_n),
        };
        FaultCode {
            kind,
            joint,
            value,
            limit,
        }
    }
}

/// A safe action as a number; 0 is none.
pub fn safe_action(action: Option<SafeAction>) -> u8 {
    match action {
        None => 0,
        Some(SafeAction::GravityHold) => 1,
        Some(SafeAction::Idle) => 2,
    }
}

/// The kind of a refusal, from 1; 0 is none.
pub fn refusal(refusal: Option<&Refusal>) -> u8 {
    match refusal {
        None => 0,
        Some(Refusal::Mode { .. }) => 1,
        Some(Refusal::Value { .. }) => 2,
        Some(Refusal::Unreachable { .. }) => 3,
        Some(Refusal::TooFast { .. }) => 4,
        Some(Refusal::FarFromStart { .. }) => 5,
        Some(Refusal::Trajectory(_)) => 6,
        Some(Refusal::DrivesIdle) => 7,
        Some(Refusal::OutOfReach { .. }) => 8,
        Some(Refusal::TooMuchTorque { .. }) => 9,
        Some(Refusal::Workspace { .. }) => 10,
    }
}
