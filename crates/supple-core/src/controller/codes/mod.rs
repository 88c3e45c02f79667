//! Modes, faults, refusals and requests as the numbers that shared memory and logs contain.
//!
//! A number keeps its meaning in all versions. Zero means "none" if there can be none. Other modules define the bytes of
//! messages and logs.

mod coded;
mod numbers;
mod request;
mod values;

pub use crate::controller::mode::MODES;
pub use numbers::Code;
pub use request::{request_kind, trajectory_kind};
pub use values::{RequestCode, RequestCodeError, VALUES};

use crate::controller::{Fault, Mode, Refusal, SafeAction};
use numbers::{number_table, numbered_variants};

/// Returns a mode by its number.
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

    /// Returns the numbers of a latched fault.
    pub fn new(fault: Option<&Fault>) -> FaultCode {
        fault.map_or(FaultCode::NONE, |fault| {
            let (kind, joint, value, limit) = fault_parts(fault);
            FaultCode {
                kind,
                joint,
                value,
                limit,
            }
        })
    }
}

/// No joint.
const NO_JOINT: i8 = -1;

fn index(joint: usize) -> i8 {
    i8::try_from(joint).unwrap_or(i8::MAX)
}

numbered_variants! {
    /// Numbers of [`crate::controller::Fault`].
    fault_kind;
    /// Returns the number, joint, value and limit of a fault.
    fn fault_parts(&Fault) -> (u8, i8, f64, f64);
    /// A measurement is not finite.
    MEASUREMENT_NOT_FINITE = 1 "measurement_not_finite": Fault::MeasurementNotFinite { joint } => [joint.map_or(NO_JOINT, index), 0.0, 0.0],
    /// Encoder replies of a joint are missing.
    ENCODER_LOST = 2 "encoder_lost": Fault::EncoderLost { joint } => [index(joint), 0.0, 0.0],
    /// No new arm state; value and limit are cycles.
    STATE_STALE = 3 "state_stale": Fault::StateStale { cycles, limit } => [NO_JOINT, cycles as f64, f64::from(limit)],
    /// The state's cycle number went backwards; the value is the one received, the limit the last one.
    STATE_OUT_OF_ORDER = 4 "state_out_of_order": Fault::StateOutOfOrder { last, received } => [NO_JOINT, received as f64, last as f64],
    /// A joint is beyond its hard stop.
    JOINT_POSITION = 5 "joint_position": Fault::JointPosition { joint, value_rad, limit_rad } => [index(joint), value_rad, limit_rad],
    /// A joint exceeds its speed limit.
    JOINT_SPEED = 6 "joint_speed": Fault::JointSpeed { joint, value_rad_per_s, limit_rad_per_s } => [index(joint), value_rad_per_s, limit_rad_per_s],
    /// The tip exceeds its speed limit.
    TIP_SPEED = 7 "tip_speed": Fault::TipSpeed { value_m_per_s, limit_m_per_s } => [NO_JOINT, value_m_per_s, limit_m_per_s],
    /// The tracking error of the tip exceeds its limit.
    TRACKING_ERROR = 8 "tracking_error": Fault::TrackingError { value_m, limit_m } => [NO_JOINT, value_m, limit_m],
    /// The mass matrix of the active joints is not positive definite.
    MASS_MATRIX = 9 "mass_matrix": Fault::MassMatrix => [NO_JOINT, 0.0, 0.0],
    /// A term of the law, or the torque itself, is not finite.
    TORQUE_NOT_FINITE = 10 "torque_not_finite": Fault::TorqueNotFinite { .. } => [NO_JOINT, 0.0, 0.0],
    /// An encoder angle jumped further than the joint can have moved.
    ENCODER_JUMP = 11 "encoder_jump": Fault::EncoderJump { joint, value_rad, limit_rad } => [index(joint), value_rad, limit_rad],
    /// A joint's tracking error exceeds its limit.
    JOINT_TRACKING_ERROR = 12 "joint_tracking_error": Fault::JointTrackingError { joint, value_rad, limit_rad } => [index(joint), value_rad, limit_rad],
    /// The external torque on a joint exceeds the limit of the mode.
    JOINT_COLLISION = 13 "joint_collision": Fault::JointCollision { joint, value_nm, limit_nm } => [index(joint), value_nm, limit_nm],
    /// The external force on the tip exceeds the limit of the mode.
    TIP_COLLISION = 14 "tip_collision": Fault::TipCollision { value_n, limit_n } => [NO_JOINT, value_n, limit_n],
    /// The encoder of a joint's motor stays unchanged while the joint should move.
    ENCODER_STUCK = 15 "encoder_stuck": Fault::EncoderStuck { joint, value_rad, limit_rad } => [index(joint), value_rad, limit_rad],
    /// Encoder replies of a joint are lost too often.
    ENCODER_UNRELIABLE = 16 "encoder_unreliable": Fault::EncoderUnreliable { joint } => [index(joint), 0.0, 0.0],
    /// A joint accelerates against its net torque.
    MOVES_AGAINST_TORQUE = 17 "moves_against_torque": Fault::MotionAgainstTorque { joint, value_nm, limit_nm } => [index(joint), value_nm, limit_nm],
    /// A force along gravity acts on the tip that the model lacks.
    UNMODELLED_LOAD = 18 "unmodelled_load": Fault::UnmodelledLoad { value_n, limit_n } => [NO_JOINT, value_n, limit_n],
    /// The tip is beyond a border of its workspace; the limit is the border's index.
    WORKSPACE = 19 "workspace": Fault::Workspace { value_m, border } => [NO_JOINT, value_m, border as f64],
    /// The tip exceeds the speed limit of a workspace zone.
    ZONE_SPEED = 20 "zone_speed": Fault::ZoneSpeed { value_m_per_s, limit_m_per_s } => [NO_JOINT, value_m_per_s, limit_m_per_s],
    /// The external force on the tip exceeds the limit of a workspace zone.
    ZONE_FORCE = 21 "zone_force": Fault::ZoneForce { value_n, limit_n } => [NO_JOINT, value_n, limit_n],
    /// The angle between the tip and its reference exceeds its limit.
    ROTATION_ERROR = 22 "rotation_error": Fault::RotationError { value_rad, limit_rad } => [NO_JOINT, value_rad, limit_rad],
    /// The pose mode came near a singular pose.
    SINGULAR = 23 "singular": Fault::Singular => [NO_JOINT, 0.0, 0.0],
    /// The encoder of a joint's motor stays unchanged under a torque that should move it.
    ENCODER_UNMOVED = 24 "encoder_unmoved": Fault::EncoderUnmoved { joint, value_nm, limit_nm } => [index(joint), value_nm, limit_nm],
    /// A joint oscillates with growing speed.
    OSCILLATION = 25 "oscillation": Fault::Oscillation { joint, value_rad_per_s, limit_rad_per_s } => [index(joint), value_rad_per_s, limit_rad_per_s],
}

numbered_variants! {
    /// Numbers of [`crate::controller::Refusal`].
    refusal_kind;
    /// Returns the number of a refusal.
    fn refusal_number(&Refusal) -> u8;
    /// Not possible in this mode.
    MODE = 1 "mode": Refusal::Mode { .. } => [],
    /// An entry is out of its range.
    VALUE = 2 "value": Refusal::Value { .. } => [],
    /// The move would take a joint beyond its stops.
    UNREACHABLE = 3 "unreachable": Refusal::BeyondJointStop { .. } => [],
    /// The move would exceed the speed limit of a joint.
    TOO_FAST = 4 "too_fast": Refusal::TooFast { .. } => [],
    /// The trajectory starts too far from the tip.
    FAR_FROM_START = 5 "far_from_start": Refusal::FarFromStart { .. } => [],
    /// The trajectory itself is invalid.
    TRAJECTORY = 6 "trajectory": Refusal::Trajectory(_) => [],
    /// Motion was requested while the drives are idle.
    DRIVES_IDLE = 7 "drives_idle": Refusal::DrivesIdle => [],
    /// The tip cannot reach a point of the trajectory.
    OUT_OF_REACH = 8 "out_of_reach": Refusal::OutOfReach { .. } => [],
    /// The motion would need more torque than a joint has.
    TOO_MUCH_TORQUE = 9 "too_much_torque": Refusal::TooMuchTorque { .. } => [],
    /// The trajectory leaves the workspace.
    WORKSPACE = 10 "workspace": Refusal::Workspace { .. } => [],
    /// The pose mode was requested near a singular pose, or its motion leads to one.
    SINGULAR = 11 "singular": Refusal::Singular => [],
    /// Learned terms were sent while learning is off.
    LEARNING_OFF = 12 "learning_off": Refusal::LearningOff => [],
}

/// Returns the name of a kind of fault; `None` for no fault.
pub fn fault_name(kind: u8) -> Option<&'static str> {
    let known = fault_kind::ALL.get(usize::from(kind));
    let name = known.map_or("unknown", |code| code.name);
    (kind != fault_kind::NONE).then_some(name)
}

impl Fault {
    /// Returns the short name for logs and status lines.
    pub fn name(&self) -> &'static str {
        fault_name(FaultCode::new(Some(self)).kind).unwrap_or("unknown")
    }
}

/// Returns the number of a safe action; 0 is none.
pub fn safe_action(action: Option<SafeAction>) -> u8 {
    action.map_or(0, |action| action as u8)
}

/// Returns the kind of a refusal, from 1; 0 is none.
pub fn refusal(refusal: Option<&Refusal>) -> u8 {
    refusal.map_or(refusal_kind::NONE, refusal_number)
}
