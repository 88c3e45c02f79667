//! Modes, faults, refusals and requests as numbers: what shared memory and logs carry.
//!
//! A number once given keeps its meaning. Zero is "none" where there can be none. The bytes of a message or
//! a log are not here.

mod numbers;
mod request;

pub use numbers::{fault_kind, refusal_kind, request_kind, trajectory_kind};

pub use request::{RequestCode, RequestCodeError, VALUES};

use crate::controller::{Fault, Mode, Refusal, SafeAction};

/// Every mode, at the place of its number.
pub const MODES: [Mode; 11] = [
    Mode::Idle,
    Mode::GravityHold,
    Mode::Move,
    Mode::Track,
    Mode::Probe,
    Mode::Fault,
    Mode::Excite,
    Mode::Breakaway,
    Mode::Float,
    Mode::JointImpedance,
    Mode::TrackPose,
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
            Fault::MeasurementNotFinite { joint } => (
                fault_kind::MEASUREMENT_NOT_FINITE,
                joint.map_or(-1, index),
                0.0,
                0.0,
            ),
            Fault::EncoderLost { joint } => (fault_kind::ENCODER_LOST, index(joint), 0.0, 0.0),
            Fault::StateStale { cycles, limit } => {
                (fault_kind::STATE_STALE, -1, cycles as f64, f64::from(limit))
            }
            Fault::StateOutOfOrder { last, received } => (
                fault_kind::STATE_OUT_OF_ORDER,
                -1,
                received as f64,
                last as f64,
            ),
            Fault::JointPosition {
                joint,
                value_rad,
                limit_rad,
            } => (
                fault_kind::JOINT_POSITION,
                index(joint),
                value_rad,
                limit_rad,
            ),
            Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => (
                fault_kind::JOINT_SPEED,
                index(joint),
                value_rad_per_s,
                limit_rad_per_s,
            ),
            Fault::TipSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => (fault_kind::TIP_SPEED, -1, value_m_per_s, limit_m_per_s),
            Fault::TrackingError { value_m, limit_m } => {
                (fault_kind::TRACKING_ERROR, -1, value_m, limit_m)
            }
            Fault::RotationError {
                value_rad,
                limit_rad,
            } => (fault_kind::ROTATION_ERROR, -1, value_rad, limit_rad),
            Fault::Singular => (fault_kind::SINGULAR, -1, 0.0, 0.0),
            Fault::MassMatrix => (fault_kind::MASS_MATRIX, -1, 0.0, 0.0),
            Fault::TorqueNotFinite { .. } => (fault_kind::TORQUE_NOT_FINITE, -1, 0.0, 0.0),
            Fault::EncoderJump {
                joint,
                value_rad,
                limit_rad,
            } => (fault_kind::ENCODER_JUMP, index(joint), value_rad, limit_rad),
            Fault::JointTrackingError {
                joint,
                value_rad,
                limit_rad,
            } => (
                fault_kind::JOINT_TRACKING_ERROR,
                index(joint),
                value_rad,
                limit_rad,
            ),
            Fault::JointCollision {
                joint,
                value_nm,
                limit_nm,
            } => (
                fault_kind::JOINT_COLLISION,
                index(joint),
                value_nm,
                limit_nm,
            ),
            Fault::TipCollision { value_n, limit_n } => {
                (fault_kind::TIP_COLLISION, -1, value_n, limit_n)
            }
            Fault::EncoderStuck {
                joint,
                value_rad,
                limit_rad,
            } => (
                fault_kind::ENCODER_STUCK,
                index(joint),
                value_rad,
                limit_rad,
            ),
            Fault::EncoderUnreliable { joint } => {
                (fault_kind::ENCODER_UNRELIABLE, index(joint), 0.0, 0.0)
            }
            Fault::MotionAgainstTorque {
                joint,
                value_nm,
                limit_nm,
            } => (
                fault_kind::MOVES_AGAINST_TORQUE,
                index(joint),
                value_nm,
                limit_nm,
            ),
            Fault::UnmodelledLoad { value_n, limit_n } => {
                (fault_kind::UNMODELLED_LOAD, -1, value_n, limit_n)
            }
            Fault::Workspace { value_m, border } => {
                (fault_kind::WORKSPACE, -1, value_m, border as f64)
            }
            Fault::ZoneSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => (fault_kind::ZONE_SPEED, -1, value_m_per_s, limit_m_per_s),
            Fault::ZoneForce { value_n, limit_n } => (fault_kind::ZONE_FORCE, -1, value_n, limit_n),
        };
        FaultCode {
            kind,
            joint,
            value,
            limit,
        }
    }
}

/// Name of a kind of fault; `None` for no fault.
pub fn fault_name(kind: u8) -> Option<&'static str> {
    let known = fault_kind::ALL.iter().find(|(_, number)| *number == kind);
    let name = known.map_or("unknown", |(name, _)| name);
    (kind != fault_kind::NONE).then_some(name)
}

impl Fault {
    /// Short name for logs and status lines.
    pub fn name(&self) -> &'static str {
        fault_name(FaultCode::new(Some(self)).kind).unwrap_or("unknown")
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
        None => refusal_kind::NONE,
        Some(Refusal::Mode { .. }) => refusal_kind::MODE,
        Some(Refusal::Value { .. }) => refusal_kind::VALUE,
        Some(Refusal::BeyondJointStop { .. }) => refusal_kind::UNREACHABLE,
        Some(Refusal::TooFast { .. }) => refusal_kind::TOO_FAST,
        Some(Refusal::FarFromStart { .. }) => refusal_kind::FAR_FROM_START,
        Some(Refusal::Trajectory(_)) => refusal_kind::TRAJECTORY,
        Some(Refusal::DrivesIdle) => refusal_kind::DRIVES_IDLE,
        Some(Refusal::OutOfReach { .. }) => refusal_kind::OUT_OF_REACH,
        Some(Refusal::TooMuchTorque { .. }) => refusal_kind::TOO_MUCH_TORQUE,
        Some(Refusal::Workspace { .. }) => refusal_kind::WORKSPACE,
        Some(Refusal::Singular) => refusal_kind::SINGULAR,
        Some(Refusal::LearningOff) => refusal_kind::LEARNING_OFF,
    }
}
