//! Modes, the requests that change them, and why a request is refused.

use super::pose_gains::{GainAxes, GainMatrices, GainPart};
use super::words::{JointLabel, NamesJoints};
use crate::config::{Gains, JointGains, RotationalGains};
use crate::math::{Vector, Vector3};
use crate::model::learned::{JointMap, LearnedParameters};
use crate::record::Text;
use crate::trajectory::{Fourier, Rotation, Trajectory, TrajectoryError};
use core::fmt;

/// Declares each mode once, with its name and its number. A number keeps its meaning for ever.
macro_rules! modes {
    (
        $(#[$enum:meta])+
        pub enum Mode {
            $($(#[doc = $meaning:literal])+ $mode:ident = $number:literal $name:literal,)+
        }
    ) => {
        $(#[$enum])+
        pub enum Mode {
            $($(#[doc = $meaning])+ $mode = $number,)+
        }

        /// Every mode, at the index of its number.
        pub const MODES: [Mode; [$($number),+].len()] = [$(Mode::$mode),+];

        const _: () = {
            let mut place = 0;
            while place < MODES.len() {
                assert!(MODES[place] as usize == place, "a number is missing or out of order");
                place += 1;
            }
        };

        impl Mode {
            /// Returns the short name for logs and status lines.
            pub fn name(self) -> &'static str {
                match self {
                    $(Mode::$mode => $name,)+
                }
            }

            /// What the mode does.
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Mode::$mode => concat!($($meaning),+).trim_ascii_start(),)+
                }
            }
        }
    };
}

modes! {
    /// Mode of the controller.
    ///
    /// ```text
    /// idle <-> gravity hold <-> work (move, track, probe, excite, breakaway,      any -> fault
    ///                                 float, joint impedance, track pose)
    ///          work -> work      breakaway -> gravity hold (done)
    ///          fault -> gravity hold | idle  (reset)
    /// ```
    ///
    /// Idle can be entered from every mode; in a fault it removes the torque and keeps the fault
    /// latched. From idle only gravity hold can be entered. While the drives are idle, every mode with
    /// torque changes to gravity hold at the current pose, and requests for motion are refused: drives
    /// become active only in gravity hold. A reset leaves the fault for the mode of its safe action:
    /// gravity hold, or idle if the angles could not be trusted or the fault occurred in idle. A reset
    /// is refused in a cycle that would raise a fault again, and until the safe action has stopped the arm.
    /// Every transition except to idle and fault is bumpless: it starts from the previous torque and
    /// blends it out; after a reset the soft stops come back gradually.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Mode {
        /// No torque.
        Idle = 0 "idle",
        /// Gravity compensation with joint damping; held joints keep their position loop.
        GravityHold = 1 "gravity_hold",
        /// Stiff joint-space motion to a pose, with model feed-forward; holds the pose at the end.
        Move = 2 "move",
        /// The impedance law follows a trajectory.
        Track = 3 "track",
        /// The impedance law follows the probing cycle.
        Probe = 4 "probe",
        /// A fault is latched; the safe action runs until a reset.
        Fault = 5 "fault",
        /// Stiff joint-space motion along a Fourier series, with model feed-forward, for
        /// identification; held joints move too. Holds the end pose.
        Excite = 6 "excite",
        /// The torque of one joint is ramped until it moves, the others are held; then gravity hold.
        Breakaway = 7 "breakaway",
        /// The model alone, without stiffness and without damping beyond the arm's own friction, part of which is
        /// compensated: for guiding by hand, at up to half of the speed limits. Held joints keep their position
        /// loop.
        Float = 8 "float",
        /// Compliant joint-space motion to a pose, with the feed-forward of the move mode; holds the pose at the end
        /// with the same gains. Contact is allowed. Held joints keep their own stiff loop.
        JointImpedance = 9 "joint_impedance",
        /// The impedance law follows a trajectory and a rotation of the tip: six directions, so that at least six joints
        /// must be active. Its inertia is always the arm's own. A pose near a singular one, where the task would be damped
        /// (see [`crate::task`]), is a fault.
        TrackPose = 10 "track_pose",
    }
}

/// A request of an operator or a program. The controller validates every request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<const N: usize> {
    /// Enters idle.
    Idle,
    /// Enters gravity hold.
    GravityHold,
    /// Moves to a pose along a minimum-jerk line in joint space. The target of a held joint must be
    /// its own angle.
    Move {
        /// Pose \[rad\].
        target_rad: Vector<N>,
        /// Duration \[s\].
        duration_s: f64,
    },
    /// Follows a trajectory that starts near the tip; the mode is [`Mode::Probe`] for the probing
    /// cycle and [`Mode::Track`] otherwise.
    Track(Trajectory),
    /// Moves the reference of the tip from its present state to a point at a given cycle, and brings it to rest after the point.
    /// Successive set-points make a continuous motion; without a further set-point the reference rests. Accepted only while a
    /// [`Trajectory::Hold`] or earlier set-points are tracked; the mode stays [`Mode::Track`].
    SetPoint(SetPoint),
    /// Follows a Fourier series of all joints, from near its start.
    Excite(Fourier<N>),
    /// Measures the breakaway torque of a joint.
    Breakaway(Breakaway),
    /// Changes the gains linearly over `ramp_s`, those of the pose mode to the same diagonal matrices about the base axes.
    Gains {
        /// Final gains.
        gains: Gains,
        /// Ramp time \[s\], zero or more.
        ramp_s: f64,
    },
    /// Leaves the fault.
    Reset,
    /// Enters float.
    Float,
    /// Moves to a pose along a minimum-jerk line in joint space with the gains of the joint impedance mode, and
    /// stays there. Held joints stay where they are.
    JointImpedance {
        /// Pose \[rad\]; the angles of held joints are not used.
        target_rad: Vector<N>,
        /// Duration \[s\].
        duration_s: f64,
    },
    /// Changes the gains of the joint impedance mode linearly over `ramp_s`.
    JointGains {
        /// Final gains; the stiffness is at most that of the move mode.
        gains: JointGains<N>,
        /// Ramp time \[s\], zero or more.
        ramp_s: f64,
    },
    /// Follows a trajectory that starts near the tip, while the tip turns from its present orientation.
    TrackPose {
        /// Trajectory of the tip's position.
        trajectory: Trajectory,
        /// Rotation of the tip's orientation.
        rotation: Rotation,
    },
    /// Changes the gains of the tip's orientation linearly over `ramp_s` to diagonal matrices about the base axes.
    RotationalGains {
        /// Final gains.
        gains: RotationalGains,
        /// Ramp time \[s\], zero or more.
        ramp_s: f64,
    },
    /// Changes the gains of the track pose mode linearly over `ramp_s`, to matrices about the axes of the base or of the tip.
    /// Linear gains of the other modes are not changed. Only for arms with six or more active joints.
    GainMatrices {
        /// Directions that change.
        part: GainPart,
        /// Final gains: symmetric, positive semi-definite, the eigenvalues within the limits of stiffness and damping.
        gains: GainMatrices,
        /// Axes of the matrices.
        axes: GainAxes,
        /// Ramp time \[s\], zero or more.
        ramp_s: f64,
    },
    /// Switches the refinement of the model while the arm moves.
    Learning(LearningSwitch),
    /// Applies learned parameters along a ramp of [`LEARNED_RAMP_S`](super::LEARNED_RAMP_S). Accepted only while
    /// learning is on and the mode allows it ([`Mode::allows_learning`]).
    LearnedParameters(LearnedParameters<N>),
    /// Applies the learned map of a joint, along the same ramp and under the same conditions.
    LearnedMap {
        /// Joint index.
        joint: usize,
        /// Its map.
        map: JointMap,
    },
}

/// A point through which the reference of the tip is to pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoint {
    /// Position \[m\], base axes.
    pub position_m: Vector3<f64>,
    /// Velocity there \[m/s\], base axes.
    pub velocity_m_per_s: Vector3<f64>,
    /// Acceleration there \[m/s^2\], base axes.
    pub acceleration_m_per_s2: Vector3<f64>,
    /// Cycle at which the reference is there: after the cycle that receives it, by at most
    /// [`MAX_SET_POINT_AHEAD_S`](super::MAX_SET_POINT_AHEAD_S).
    pub at_cycle: u64,
}

/// Change of learning that a request asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LearningSwitch {
    /// Learning ends; the learned terms keep their values.
    Off,
    /// Learning starts: the controller accepts new terms.
    On,
    /// The learned terms return to those of the configuration along the ramp. Learning stays on or off.
    Reset,
}

/// A torque ramp on one joint, added to gravity compensation and to the torque with which a position loop held the joint, until
/// the joint has moved. The controller refuses it while the joints' set-points move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// Joint index.
    pub joint: usize,
    /// Slope of the ramp \[N m/s\], not zero; its sign is the direction.
    pub rate_nm_per_s: f64,
    /// Angle from the start at which the ramp ends \[rad\], positive.
    pub stop_rad: f64,
    /// Torque of the ramp alone at which the ramp ends without motion \[N m\], positive, within the joint's limit.
    pub limit_nm: f64,
}

/// Reason for the refusal of a request. A refused request changes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The request is not possible in the present mode.
    Mode {
        /// Current mode.
        mode: Mode,
    },
    /// An entry is out of its range.
    Value {
        /// Name of the entry.
        entry: &'static str,
        /// Requested value.
        value: f64,
        /// Maximum value; for a held joint the required value.
        limit: f64,
    },
    /// The move would take a joint beyond its stops.
    BeyondJointStop {
        /// Joint index.
        joint: usize,
        /// Requested angle \[rad\].
        value_rad: f64,
    },
    /// The move would exceed the speed limit of a joint.
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
    /// The trajectory itself is invalid.
    Trajectory(TrajectoryError),
    /// Motion was requested while the drives are idle.
    DrivesIdle,
    /// The tip cannot reach a point of the trajectory.
    OutOfReach {
        /// Time of the point since the start \[s\].
        time_s: f64,
        /// Remaining distance \[m\].
        distance_m: f64,
    },
    /// The motion would need more torque than a joint has.
    TooMuchTorque {
        /// Joint index.
        joint: usize,
        /// Torque that the model needs \[N m\].
        value_nm: f64,
        /// Limit \[N m\].
        limit_nm: f64,
    },
    /// The pose mode was requested near a singular pose, where its task is damped, or its motion leads to one.
    Singular,
    /// Learned terms were sent while learning is off.
    LearningOff,
    /// The trajectory leaves the workspace.
    Workspace {
        /// Border, counted from 0.
        border: usize,
        /// Maximum distance beyond it \[m\].
        value_m: f64,
    },
}

impl NamesJoints for Refusal {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        match *self {
            Refusal::Mode { mode } => write!(f, "refused: not possible in mode {}", mode.name()),
            Refusal::Value {
                entry,
                value,
                limit,
            } => write!(f, "refused: {entry} is {value}, the limit is {limit}"),
            Refusal::BeyondJointStop { joint, value_rad } => write!(
                f,
                "refused: {} would go to {value_rad:.4} rad, beyond its stop", label(joint)),
            Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "refused: {} would turn at {value_rad_per_s:.3} rad/s, limit \
                 {limit_rad_per_s:.3} rad/s; give the move more time", label(joint)),
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
                "refused: {time_s:.2} s after its start the trajectory is {distance_m:.3} m beyond the arm's \
                 reach; move it closer to the arm or make it smaller"
            ),
            Refusal::TooMuchTorque {
                joint,
                value_nm,
                limit_nm,
            } => write!(
                f,
                "refused: {} would need {value_nm:.2} N m, limit {limit_nm:.2} N m; request a \
                 slower motion", label(joint)),
            Refusal::Singular => f.write_str(
                "refused: near a singular pose the tip cannot move and turn in every direction; move the arm \
                 away from it first",
            ),
            Refusal::LearningOff => f.write_str("refused: learning is off"),
            Refusal::Workspace { border, value_m } => write!(
                f,
                "refused: the motion would go {value_m:.3} m beyond border {border} of the workspace"
            ),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

impl core::error::Error for Refusal {}
