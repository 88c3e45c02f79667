//! Modes, the requests that change them, and why a request is refused.

use crate::config::Gains;
use crate::math::Vector;
use crate::trajectory::{Fourier, Trajectory, TrajectoryError};
use core::fmt;

/// What the controller is doing.
///
/// ```text
/// idle <-> gravity hold <-> work (move, track, probe, excite, breakaway)      any -> fault
///          work -> work      breakaway -> gravity hold (done)
///          fault -> gravity hold | idle  (reset)
/// ```
///
/// Idle is reached from anywhere; asked for in a fault it takes the torque away and leaves the fault
/// latched. From idle only gravity hold is reached. While the drives are idle, every mode with torque gives way
/// to gravity hold at the pose that the arm is in, and work is refused: drives come to life in gravity hold
/// alone. A reset leaves the fault for
/// the mode that its safe action was: gravity hold, or idle where the angles could not be trusted or the
/// fault came in idle. It is refused in a cycle that would raise a fault again. Every entry but those to
/// idle and fault starts from the torque that was there and blends it out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// No torque.
    Idle,
    /// The model holds the arm's weight, joints are damped, held joints keep their loop.
    GravityHold,
    /// Stiff joint-space motion to a pose, with model feed-forward; holds it at the end.
    Move,
    /// The impedance law follows a trajectory.
    Track,
    /// The impedance law follows the probing cycle.
    Probe,
    /// A fault is latched; the safe action runs until a reset.
    Fault,
    /// Stiff joint-space motion along a Fourier series, with model feed-forward, for identification;
    /// joints that the law holds move too. Holds its end.
    Excite,
    /// The torque of one joint is ramped until it moves, the others are held; then gravity hold.
    Breakaway,
}

impl Mode {
    /// Short name for logs and status lines.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Idle => "idle",
            Mode::GravityHold => "gravity_hold",
            Mode::Move => "move",
            Mode::Track => "track",
            Mode::Probe => "probe",
            Mode::Fault => "fault",
            Mode::Excite => "excite",
            Mode::Breakaway => "breakaway",
        }
    }
}

/// What an operator or a programme asks for. Checked in the controller, never trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<const N: usize> {
    /// To idle.
    Idle,
    /// To gravity hold.
    GravityHold,
    /// To a pose, along the minimum-jerk line in joint space. Held joints must be asked to go to their
    /// own angle.
    Move {
        /// Pose \[rad\].
        target_rad: Vector<N>,
        /// Duration \[s\].
        duration_s: f64,
    },
    /// Along a trajectory that starts near the tip; the mode is [`Mode::Probe`] for the probing cycle
    /// and [`Mode::Track`] otherwise.
    Track(Trajectory),
    /// Along a Fourier series of all joints, from near its start.
    Excite(Fourier<N>),
    /// Finds where dry friction gives way.
    Breakaway(Breakaway),
    /// Other gains, reached along a straight line in `ramp_s`.
    Gains {
        /// Gains to reach.
        gains: Gains,
        /// Time to reach them \[s\], zero or more.
        ramp_s: f64,
    },
    /// Out of the fault.
    Reset,
}

/// A ramp of torque on one joint, beside gravity, until the joint has moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// Joint index.
    pub joint: usize,
    /// Slope of the ramp \[N m/s\], not zero; its sign is the direction.
    pub rate_nm_per_s: f64,
    /// Angle from the start at which it ends \[rad\], positive.
    pub stop_rad: f64,
    /// Torque at which it ends without motion \[N m\], positive, within the joint's limit.
    pub limit_nm: f64,
}

/// Why a request changed nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// Not from this mode.
    Mode {
        /// Mode in force.
        mode: Mode,
    },
    /// An entry out of its range.
    Value {
        /// Name of the entry.
        entry: &'static str,
        /// Value asked for.
        value: f64,
        /// What it must be at most, or equal for a held joint.
        limit: f64,
    },
    /// The move would take a joint beyond its stops.
    Unreachable {
        /// Joint index.
        joint: usize,
        /// Angle asked for \[rad\].
        value_rad: f64,
    },
    /// The move would turn a joint faster than its limit.
    TooFast {
        /// Joint index.
        joint: usize,
        /// Peak speed of the move \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// The trajectory starts too far from the tip.
    FarFromStart {
        /// Distance \[m\].
        distance_m: f64,
        /// Limit \[m\].
        limit_m: f64,
    },
    /// The trajectory itself is wrong.
    Trajectory(TrajectoryError),
    /// Motion was asked for while the drives are idle.
    DrivesIdle,
    /// The tip cannot come to a point of the trajectory.
    OutOfReach {
        /// Time of the point since the start \[s\].
        time_s: f64,
        /// Distance that remains \[m\].
        distance_m: f64,
    },
    /// The motion would take more torque than a joint has.
    TooMuchTorque {
        /// Joint index.
        joint: usize,
        /// Torque that the model asks for \[N m\].
        value_nm: f64,
        /// Limit \[N m\].
        limit_nm: f64,
    },
    /// The trajectory leaves the workspace.
    Workspace {
        /// Border, counted from 0.
        border: usize,
        /// Greatest distance beyond it \[m\].
        value_m: f64,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Refusal::Mode { mode } => write!(f, "refused: not from mode {}", mode.name()),
            Refusal::Value {
                entry,
                value,
                limit,
            } => write!(f, "refused: {entry} is {value}, the limit is {limit}"),
            Refusal::Unreachable { joint, value_rad } => write!(
                f,
                "refused: joint {joint} would go to {value_rad:.4} rad, beyond its stop"
            ),
            Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "refused: joint {joint} would turn at {value_rad_per_s:.3} rad/s, limit \
                 {limit_rad_per_s:.3} rad/s; give the move more time"
            ),
            Refusal::FarFromStart {
                distance_m,
                limit_m,
            } => write!(
                f,
                "refused: the tip is {distance_m:.3} m from the start, limit {limit_m:.3} m; move \
                 there first"
            ),
            Refusal::Trajectory(error) => write!(f, "refused: {error}"),
            Refusal::DrivesIdle => {
                f.write_str("refused: the drives are idle; activate them in gravity hold first")
            }
            Refusal::OutOfReach { time_s, distance_m } => write!(
                f,
                "refused: {time_s:.2} s after its start the trajectory is {distance_m:.3} m out of reach; \
                 move it nearer to the arm or make it smaller"
            ),
            Refusal::TooMuchTorque {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "refused: joint {joint} would need {value_nm:.2} N m, limit {limit_nm:.2} N m; ask for a \
                 slower motion"
            ),
            Refusal::Workspace { border, value_m } => write!(
                f,
                "refused: the motion would go {value_m:.3} m beyond border {border} of the workspace"
            ),
        }
    }
}

impl core::error::Error for Refusal {}
