//! Modes, faults, refusals and requests as numbers: what shared memory and logs carry.
//!
//! A number once given keeps its meaning. Zero is "none" where there can be none. The bytes of a message or
//! a log are not here.

mod request;

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

/// Named numbers. A number once given keeps its meaning.
macro_rules! numbered {
    ($(#[doc = $doc:literal])+ $module:ident { $($name:ident = $number:literal $text:literal,)+ }) => {
        $(#[doc = $doc])+
        #[allow(missing_docs, reason = "the names say it")]
        pub mod $module {
            $(pub const $name: u8 = $number;)+

            /// Every name with its number.
            pub const ALL: &[(&str, u8)] = &[$(($text, $name),)+];
        }
    };
}

numbered! {
    /// Numbers of [`Request`](crate::controller::Request).
    request_kind {
        NONE = 0 "none",
        IDLE = 1 "idle",
        GRAVITY_HOLD = 2 "gravity_hold",
        MOVE = 3 "move",
        TRACK = 4 "track",
        GAINS = 5 "gains",
        RESET = 6 "reset",
        EXCITE = 7 "excite",
        BREAKAWAY = 8 "breakaway",
        FLOAT = 9 "float",
        JOINT_IMPEDANCE = 10 "joint_impedance",
        JOINT_GAINS = 11 "joint_gains",
        TRACK_POSE = 12 "track_pose",
        ROTATIONAL_GAINS = 13 "rotational_gains",
        LEARNING = 14 "learning",
        LEARNED_PARAMETERS = 15 "learned_parameters",
        LEARNED_MAP = 16 "learned_map",
        SET_POINT = 17 "set_point",
    }
}

numbered! {
    /// Numbers of [`Trajectory`](crate::Trajectory).
    trajectory_kind {
        NONE = 0 "none",
        HOLD = 1 "hold",
        LINE = 2 "line",
        SINUSOID = 3 "sinusoid",
        ARC = 4 "arc",
        QUADRANT = 5 "quadrant",
        PROBE = 6 "probe",
    }
}

numbered! {
    /// Numbers of [`Fault`].
    fault_kind {
        NONE = 0 "none",
        MEASUREMENT_NOT_FINITE = 1 "measurement_not_finite",
        ENCODER_LOST = 2 "encoder_lost",
        STATE_STALE = 3 "state_stale",
        STATE_OUT_OF_ORDER = 4 "state_out_of_order",
        JOINT_POSITION = 5 "joint_position",
        JOINT_SPEED = 6 "joint_speed",
        TIP_SPEED = 7 "tip_speed",
        TRACKING_ERROR = 8 "tracking_error",
        MASS_MATRIX = 9 "mass_matrix",
        TORQUE_NOT_FINITE = 10 "torque_not_finite",
        ENCODER_JUMP = 11 "encoder_jump",
        JOINT_TRACKING_ERROR = 12 "joint_tracking_error",
        JOINT_COLLISION = 13 "joint_collision",
        TIP_COLLISION = 14 "tip_collision",
        ENCODER_STUCK = 15 "encoder_stuck",
        ENCODER_UNRELIABLE = 16 "encoder_unreliable",
        MOVES_AGAINST_TORQUE = 17 "moves_against_torque",
        UNMODELLED_LOAD = 18 "unmodelled_load",
        WORKSPACE = 19 "workspace",
        ZONE_SPEED = 20 "zone_speed",
        ZONE_FORCE = 21 "zone_force",
        ROTATION_ERROR = 22 "rotation_error",
        SINGULAR = 23 "singular",
    }
}

numbered! {
    /// Numbers of [`Refusal`].
    refusal_kind {
        NONE = 0 "none",
        MODE = 1 "mode",
        VALUE = 2 "value",
        UNREACHABLE = 3 "unreachable",
        TOO_FAST = 4 "too_fast",
        FAR_FROM_START = 5 "far_from_start",
        TRAJECTORY = 6 "trajectory",
        DRIVES_IDLE = 7 "drives_idle",
        OUT_OF_REACH = 8 "out_of_reach",
        TOO_MUCH_TORQUE = 9 "too_much_torque",
        WORKSPACE = 10 "workspace",
        SINGULAR = 11 "singular",
        LEARNING_OFF = 12 "learning_off",
    }
}

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
