//! Why the controller stopped: every fault named, with the value and the limit it broke.

use core::fmt;

/// A latched fault. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A measurement that is not a finite number; `joint` is `None` for the tip force.
    MeasurementNotFinite {
        /// Joint index.
        joint: Option<usize>,
    },
    /// Encoder replies of a joint missing for more than the one cycle that is tolerated.
    EncoderLost {
        /// Joint index.
        joint: usize,
    },
    /// An angle that the joint cannot have reached since the last one.
    EncoderJump {
        /// Joint index.
        joint: usize,
        /// Distance from the angle expected \[rad\].
        value_rad: f64,
        /// Greatest distance that is believed \[rad\].
        limit_rad: f64,
    },
    /// No new state for too long.
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
    /// A joint beyond its hard stop.
    JointPosition {
        /// Joint index.
        joint: usize,
        /// Angle \[rad\].
        value_rad: f64,
        /// Stop \[rad\].
        limit_rad: f64,
    },
    /// A joint too fast.
    JointSpeed {
        /// Joint index.
        joint: usize,
        /// Speed \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// The tip too fast.
    TipSpeed {
        /// Speed \[m/s\].
        value_m_per_s: f64,
        /// Limit \[m/s\].
        limit_m_per_s: f64,
    },
    /// The tip too far from its reference.
    TrackingError {
        /// Distance \[m\].
        value_m: f64,
        /// Limit \[m\].
        limit_m: f64,
    },
    /// A joint too far from where its own stiff loop wants it: blocked on a move, or pushed away.
    JointTrackingError {
        /// Joint index.
        joint: usize,
        /// Distance \[rad\].
        value_rad: f64,
        /// Limit \[rad\].
        limit_rad: f64,
    },
    /// Something outside turns a joint harder than is allowed in this mode.
    JointCollision {
        /// Joint index.
        joint: usize,
        /// Observed external torque \[N m\].
        value_nm: f64,
        /// Limit \[N m\].
        limit_nm: f64,
    },
    /// Something outside pushes the tip harder than is allowed in this mode.
    TipCollision {
        /// Observed force \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// An encoder says the same angle again and again while the joint's reference has moved on.
    EncoderStuck {
        /// Joint index.
        joint: usize,
        /// How far the reference has moved meanwhile \[rad\].
        value_rad: f64,
        /// Limit \[rad\].
        limit_rad: f64,
    },
    /// Encoder replies of a joint that are lost too often, if never twice in a row.
    EncoderUnreliable {
        /// Joint index.
        joint: usize,
    },
    /// A joint gathers speed against the torque that drives it: the sign of its encoder or motor is wrong, or
    /// something outside is stronger.
    AgainstTorque {
        /// Joint index.
        joint: usize,
        /// Torque that drives it, gravity and friction taken off \[N m\].
        value_nm: f64,
        /// Torque above which this is a fault \[N m\].
        limit_nm: f64,
    },
    /// The tip is pulled along gravity by a load that the model does not have, or the model's gravity is wrong.
    UnmodelledLoad {
        /// Observed force along gravity \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// The tip is beyond a border of its workspace and moves on.
    Workspace {
        /// Distance beyond it \[m\].
        value_m: f64,
        /// Border, counted from 0.
        border: usize,
    },
    /// The tip is too fast for a zone of its workspace.
    ZoneSpeed {
        /// Speed \[m/s\].
        value_m_per_s: f64,
        /// Limit \[m/s\].
        limit_m_per_s: f64,
    },
    /// The tip is pushed harder than a zone of its workspace allows.
    ZoneForce {
        /// Observed force \[N\].
        value_n: f64,
        /// Limit \[N\].
        limit_n: f64,
    },
    /// The mass matrix of the active joints is not positive definite.
    MassMatrix,
    /// A term of the law, or the torque itself, is not finite.
    TorqueNotFinite {
        /// Name of the term, as in [`Torques`](crate::impedance::Torques); `"total"` for the sum.
        term: &'static str,
    },
}

/// What the controller does in a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafeAction {
    /// The model holds the arm's weight and takes its momentum away, without any stiff loop
    /// (see `stop.rs`). It gives way to [`SafeAction::Idle`] where the arm does not come to rest.
    GravityHold,
    /// No torque, and drives that brake: the angles or the model cannot be trusted, so neither can gravity
    /// computed from them.
    Idle,
}

impl Fault {
    /// What to do about it; in idle, nothing: no fault energises an arm.
    pub fn safe_action(&self) -> SafeAction {
        match self {
            Fault::EncoderLost { .. }
            | Fault::EncoderJump { .. }
            | Fault::EncoderStuck { .. }
            | Fault::EncoderUnreliable { .. }
            | Fault::AgainstTorque { .. }
            | Fault::UnmodelledLoad { .. }
            | Fault::MeasurementNotFinite { joint: Some(_) } => SafeAction::Idle,
            _ => SafeAction::GravityHold,
        }
    }

    /// Short name for logs and status lines.
    pub fn name(&self) -> &'static str {
        match self {
            Fault::MeasurementNotFinite { .. } => "measurement_not_finite",
            Fault::EncoderLost { .. } => "encoder_lost",
            Fault::EncoderJump { .. } => "encoder_jump",
            Fault::StateStale { .. } => "state_stale",
            Fault::StateOutOfOrder { .. } => "state_out_of_order",
            Fault::JointPosition { .. } => "joint_position",
            Fault::JointSpeed { .. } => "joint_speed",
            Fault::TipSpeed { .. } => "tip_speed",
            Fault::TrackingError { .. } => "tracking_error",
            Fault::JointTrackingError { .. } => "joint_tracking_error",
            Fault::JointCollision { .. } => "joint_collision",
            Fault::TipCollision { .. } => "tip_collision",
            Fault::EncoderStuck { .. } => "encoder_stuck",
            Fault::EncoderUnreliable { .. } => "encoder_unreliable",
            Fault::AgainstTorque { .. } => "moves_against_torque",
            Fault::UnmodelledLoad { .. } => "unmodelled_load",
            Fault::Workspace { .. } => "workspace",
            Fault::ZoneSpeed { .. } => "zone_speed",
            Fault::ZoneForce { .. } => "zone_force",
            Fault::MassMatrix => "mass_matrix",
            Fault::TorqueNotFinite { .. } => "torque_not_finite",
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Fault::MeasurementNotFinite { joint: Some(joint) } => {
                write!(f, "position of joint {joint} is not a finite number")
            }
            Fault::MeasurementNotFinite { joint: None } => {
                write!(f, "tip force is not a finite number")
            }
            Fault::EncoderLost { joint } => {
                write!(f, "no encoder reply from joint {joint} for two cycles")
            }
            Fault::EncoderJump {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "encoder of joint {joint} is {value_rad:.4} rad from where the joint can be, \
                 {limit_rad:.4} rad are believed"
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
                "joint {joint} at {value_rad:.4} rad is beyond its stop at {limit_rad:.4} rad"
            ),
            Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "joint {joint} turns at {value_rad_per_s:.3} rad/s, limit {limit_rad_per_s:.3} rad/s"
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
                "joint {joint} is {value_rad:.4} rad from where its loop wants it, limit \
                 {limit_rad:.4} rad"
            ),
            Fault::JointCollision {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "joint {joint} is turned from outside with {value_nm:.2} N m, limit {limit_nm:.2} N m"
            ),
            Fault::TipCollision { value_n, limit_n } => write!(
                f,
                "tip is pushed from outside with {value_n:.1} N, limit {limit_n:.1} N"
            ),
            Fault::EncoderStuck {
                joint,
                value_rad,
                limit_rad,
            } => write!(
                f,
                "encoder of joint {joint} stands still while its reference has moved {value_rad:.4} rad, \
                 limit {limit_rad:.4} rad"
            ),
            Fault::EncoderUnreliable { joint } => write!(
                f,
                "encoder replies of joint {joint} are lost too often, more than one in nine"
            ),
            Fault::AgainstTorque {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "joint {joint} gathers speed against {value_nm:.2} N m that drive it, {limit_nm:.2} N m are \
                 tolerated: check the signs of encoder and motor"
            ),
            Fault::UnmodelledLoad { value_n, limit_n } => write!(
                f,
                "tip is pulled along gravity with {value_n:.1} N that the model does not have, limit \
                 {limit_n:.1} N: add the load to the model, or calibrate"
            ),
            Fault::Workspace { value_m, border } => write!(
                f,
                "tip is {value_m:.4} m beyond border {border} of its workspace and moves on"
            ),
            Fault::ZoneSpeed {
                value_m_per_s,
                limit_m_per_s,
            } => write!(
                f,
                "tip moves at {value_m_per_s:.3} m/s in a zone for {limit_m_per_s:.3} m/s"
            ),
            Fault::ZoneForce { value_n, limit_n } => write!(
                f,
                "tip is pushed with {value_n:.1} N in a zone for {limit_n:.1} N"
            ),
            Fault::MassMatrix => write!(f, "mass matrix is not positive definite"),
            Fault::TorqueNotFinite { term } => {
                write!(f, "torque term {term} is not a finite number")
            }
        }
    }
}

impl core::error::Error for Fault {}
