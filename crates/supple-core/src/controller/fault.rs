//! Faults: the reason for which the controller stopped, with the measured value and the violated limit.

use super::words::{JointLabel, NamesJoints};
use crate::record::Text;
use core::fmt;

/// A latched fault. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A measurement is not finite; `joint` is `None` for the tip force.
    MeasurementNotFinite {
        /// Joint index.
        joint: Option<usize>,
    },
    /// Encoder replies of a joint are missing for more than the one tolerated cycle.
    EncoderLost {
        /// Joint index.
        joint: usize,
    },
    /// The encoder angle jumped further than the joint can have moved.
    EncoderJump {
        /// Joint index.
        joint: usize,
        /// Distance from the expected angle \[rad\].
        value_rad: f64,
        /// Maximum plausible distance \[rad\].
        limit_rad: f64,
    },
    /// No new arm state for more cycles than tolerated.
    StateStale {
        /// Cycles without a new state.
        cycles: u64,
        /// Cycles tolerated.
        limit: u32,
    },
    /// The state's cycle number went backwards.
    StateOutOfOrder {
        /// Last cycle number.
        last: u64,
        /// Cycle number received.
        received: u64,
    },
    /// A joint is beyond its hard stop.
    JointPosition {
        /// Joint index.
        joint: usize,
        /// Angle \[rad\].
        value_rad: f64,
        /// Stop \[rad\].
        limit_rad: f64,
    },
    /// A joint exceeds its speed limit.
    JointSpeed {
        /// Joint index.
        joint: usize,
        /// Speed \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// The tip exceeds its speed limit.
    TipSpeed {
        /// Speed \[m/s\].
        value_m_per_s: f64,
        /// Limit \[m/s\].
        limit_m_per_s: f64,
    },
    /// The tracking error of the tip exceeds its limit.
    TrackingError {
        /// Distance \[m\].
        value_m: f64,
        /// Limit \[m\].
        limit_m: f64,
    },
    /// The angle between the tip and the reference of its orientation exceeds its limit.
    RotationError {
        /// Angle \[rad\].
        value_rad: f64,
        /// Limit \[rad\].
        limit_rad: f64,
    },
    /// The pose mode came near a singular pose, where its task is damped and may put energy into the arm.
    Singular,
    /// Joint tracking error beyond its limit: the joint is blocked in a move, or pushed away.
    JointTrackingError {
        /// Joint index.
        joint: usize,
        /// Distance \[rad\].
        value_rad: f64,
        /// Limit \[rad\].
        limit_rad: f64,
    },
    /// The external torque on a joint exceeds the limit of this mode.
    JointCollision {
        /// Joint index.
        joint: usize,
        /// Observed external torque \[N m\].
        value_nm: f64,
        /// Limit \[N m\].
        limit_nm: f64,
    },
    /// The external force on the tip exceeds the limit of this mode.
    TipCollision {
        /// Observed force \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// The encoder of a joint's motor stays unchanged while the joint should move.
    EncoderStuck {
        /// Joint index.
        joint: usize,
        /// Travel of the joint's reference meanwhile, or of the joint at its last speed \[rad\].
        value_rad: f64,
        /// Limit \[rad\].
        limit_rad: f64,
    },
    /// The encoder of a joint's motor does not change although the external torque on the motor, as observed, is more than dry
    /// friction holds, or that of a collision.
    EncoderUnmoved {
        /// Joint index.
        joint: usize,
        /// Magnitude of the torque, at the joint that the motor turns most \[N m\].
        value_nm: f64,
        /// Limit \[N m\].
        limit_nm: f64,
    },
    /// Encoder replies of a joint are lost too often, though never twice in a row.
    EncoderUnreliable {
        /// Joint index.
        joint: usize,
    },
    /// A joint accelerates against its net torque: the sign of its encoder or motor is wrong, or an
    /// external torque is larger. Or it has moved against the torque of a breakaway ramp.
    MotionAgainstTorque {
        /// Joint index.
        joint: usize,
        /// Net torque on the joint, without gravity and friction \[N m\].
        value_nm: f64,
        /// Torque above which this is a fault \[N m\].
        limit_nm: f64,
    },
    /// A force along gravity acts on the tip: the model lacks a load, or its gravity is wrong.
    UnmodelledLoad {
        /// Observed force along gravity \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// The tip is beyond a border of its workspace and still moves outwards.
    Workspace {
        /// Distance beyond it \[m\].
        value_m: f64,
        /// Index of the border, from 0.
        border: usize,
    },
    /// The tip exceeds the speed limit of a workspace zone.
    ZoneSpeed {
        /// Speed \[m/s\].
        value_m_per_s: f64,
        /// Limit \[m/s\].
        limit_m_per_s: f64,
    },
    /// The external force on the tip exceeds the limit of a workspace zone.
    ZoneForce {
        /// Observed force \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// A joint oscillates with growing speed: torques or angles come later than configured, or the model is wrong.
    Oscillation {
        /// Joint index.
        joint: usize,
        /// Speed in the last swing \[rad/s\].
        value_rad_per_s: f64,
        /// Peak from which growing swings are a fault \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// The mass matrix of the active joints is not positive definite.
    MassMatrix,
    /// A term of the law, or the torque itself, is not finite.
    TorqueNotFinite {
        /// Name of the term, as in [`Torques`](crate::law::impedance::Torques); `"total"` for the sum.
        term: &'static str,
    },
}

/// Safe action of the controller in a fault, with its number; 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafeAction {
    /// Gravity compensation and damping of the momentum, without any position loop (see `stop.rs`).
    /// Replaced by [`SafeAction::Brake`] if the arm does not come to rest.
    Stop = 1,
    /// No torque, braking drives: the angles or the model cannot be trusted, so the gravity torque
    /// computed from them cannot be either.
    Brake = 2,
}

impl Fault {
    /// Returns the safe action for the fault. A fault in idle stays in idle: no fault energises an arm.
    pub fn safe_action(&self) -> SafeAction {
        match self {
            Fault::EncoderLost { .. }
            | Fault::EncoderJump { .. }
            | Fault::EncoderStuck { .. }
            | Fault::EncoderUnmoved { .. }
            | Fault::EncoderUnreliable { .. }
            | Fault::MotionAgainstTorque { .. }
            | Fault::UnmodelledLoad { .. }
            | Fault::Oscillation { .. }
            | Fault::MassMatrix
            | Fault::MeasurementNotFinite { joint: Some(_) } => SafeAction::Brake,
            _ => SafeAction::Stop,
        }
    }
}

impl NamesJoints for Fault {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        match *self {
            Fault::MeasurementNotFinite { joint: Some(joint) } => {
                write!(f, "position of {} is not a finite number", label(joint))
            }
            Fault::MeasurementNotFinite { joint: None } => {
                write!(f, "tip force is not a finite number")
            }
            Fault::EncoderLost { joint } => {
                write!(f, "no encoder reply from {} for two cycles", label(joint))
            }
            Fault::EncoderJump {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "encoder of {} jumped by {value_rad:.4} rad from the expected angle, limit \
                 {limit_rad:.4} rad",
                label(joint)
            ),
            Fault::StateStale { cycles, limit } => write!(
                f,
                "no new arm state for {cycles} cycles, {limit} are tolerated"
            ),
            Fault::StateOutOfOrder { last, received } => {
                write!(f, "arm state {received} came after {last}")
            }
            Fault::JointPosition {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "{} at {value_rad:.4} rad is beyond its stop at {limit_rad:.4} rad",
                label(joint)
            ),
            Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "{} turns at {value_rad_per_s:.3} rad/s, limit {limit_rad_per_s:.3} rad/s",
                label(joint)
            ),
            Fault::TipSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => write!(
                f,
                "tip moves at {value_m_per_s:.3} m/s, limit {limit_m_per_s:.3} m/s"
            ),
            Fault::TrackingError { value_m, limit_m } => write!(
                f,
                "tip is {value_m:.3} m from its reference, limit {limit_m:.3} m"
            ),
            Fault::JointTrackingError {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "tracking error of {} is {value_rad:.4} rad, limit {limit_rad:.4} rad",
                label(joint)
            ),
            Fault::JointCollision {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "external torque on {} is {value_nm:.2} N m, limit {limit_nm:.2} N m",
                label(joint)
            ),
            Fault::TipCollision { value_n, limit_n } => write!(
                f,
                "external force on the tip is {value_n:.1} N, limit {limit_n:.1} N"
            ),
            Fault::EncoderStuck {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "encoder of {} is unchanged while the joint should have moved {value_rad:.4} rad, \
                 limit {limit_rad:.4} rad",
                label(joint)
            ),
            Fault::EncoderUnmoved {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "encoder of {} is unchanged under an external torque of {value_nm:.2} N m, limit {limit_nm:.2} N m",
                label(joint)
            ),
            Fault::EncoderUnreliable { joint } => write!(
                f,
                "encoder replies of {} are lost too often, more than one in nine",
                label(joint)
            ),
            Fault::MotionAgainstTorque {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "{} accelerates against a net torque of {value_nm:.2} N m, limit {limit_nm:.2} N m: \
                 check the signs of encoder and motor",
                label(joint)
            ),
            Fault::UnmodelledLoad { value_n, limit_n } => write!(
                f,
                "unmodelled force of {value_n:.1} N on the tip along gravity, limit {limit_n:.1} N: \
                 add the load to the model, or calibrate"
            ),
            Fault::Workspace { value_m, border } => write!(
                f,
                "tip is {value_m:.4} m beyond border {border} of its workspace and still moves outwards"
            ),
            Fault::ZoneSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => write!(
                f,
                "tip moves at {value_m_per_s:.3} m/s, limit of this zone {limit_m_per_s:.3} m/s"
            ),
            Fault::ZoneForce { value_n, limit_n } => write!(
                f,
                "external force on the tip is {value_n:.1} N, limit of this zone {limit_n:.1} N"
            ),
            Fault::RotationError {
                value_rad,
                limit_rad,
            } => write!(
                f,
                "tip is turned {value_rad:.3} rad away from its reference, limit {limit_rad:.3} rad"
            ),
            Fault::Singular => write!(
                f,
                "near a singular pose the tip cannot move and turn in every direction; move the arm away from it"
            ),
            Fault::Oscillation {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "{} oscillates with growing speed, {value_rad_per_s:.3} rad/s, limit {limit_rad_per_s:.3} rad/s: torques or \
                 angles come late, or the gains are too high",
                label(joint)
            ),
            Fault::MassMatrix => write!(f, "mass matrix is not positive definite"),
            Fault::TorqueNotFinite { term } => {
                write!(f, "torque term {term} is not a finite number")
            }
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

impl core::error::Error for Fault {}
