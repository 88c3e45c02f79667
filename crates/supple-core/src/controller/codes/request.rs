//! Requests as numbers, and back without the loss of a bit.
//!
//! Vectors as x, y, z:
//!
//! | request | values |
//! |---|---|
//! | move | `target_rad` (N), `duration_s` |
//! | gains | `stiffness_n_per_m`, `damping_n_s_per_m`, `ramp_s` |
//! | excite | `centre_rad` (N), `sine_rad` (5 harmonics of N), `cosine_rad` (5 of N), `angular_frequency_rad_per_s`, `duration_s`, `ramp_s` |
//! | breakaway | `joint`, `rate_nm_per_s`, `stop_rad`, `limit_nm` |
//! | joint_impedance | `target_rad` (N), `duration_s` |
//! | joint_gains | `stiffness_nm_per_rad` (N), `damping_nm_s_per_rad` (N), `ramp_s` |
//! | track_pose | `axis`, `angle_rad`, `duration_s` of the rotation, then those of the trajectory |
//! | rotational_gains | `stiffness_nm_per_rad`, `damping_nm_s_per_rad`, `ramp_s` |
//! | gain_matrices | `part` (0 linear, 1 rotational), `stiffness` and `damping` as xx, yy, zz, yz, zx, xy, `axes` (0 base, 1 tip), `ramp_s` |
//! | learning | 0 off, 1 on, 2 reset |
//! | learned_parameters | `viscous_nm_s_per_rad` (N), `coulomb_nm` (N), `offset_nm` (N), `torque_scale` (N), `payload_kg`, `payload_moment_kg_m`, `tilt_rad` |
//! | learned_map | `joint`, `torque_nm` (16 coefficients), `dry_nm` (16) |
//! | set_point | `position_m`, `velocity_m_per_s`, `acceleration_m_per_s2`, `at_cycle` |
//! | hold | `position_m` |
//! | line | `from_m`, `to_m`, `duration_s` |
//! | sinusoid | `centre_m`, `amplitude_m`, `angular_frequency_rad_per_s`, `ramp_s` |
//! | arc | `radius_m`, `height_m`, `centre_rad`, `amplitude_rad`, `angular_frequency_rad_per_s`, `ramp_s` |
//! | quadrant | `centre_m`, `first_m`, `second_m`, `speed_m_per_s`, `ramp_s`, `corner_ramp_s` |
//! | probe | `radius_m`, `strokes`, `radial_step_m`, `top_m`, `stroke_m`, `azimuth_rad`, `azimuth_step_rad`, `speed_m_per_s`, `ramp_s`, `dwell_s` |
//!
//! A probe of an older log has no `dwell_s`, a quadrant no `corner_ramp_s`: they are zero.
//! Decoding rejects numbers that encode no request; whether a request is valid, the controller checks.

use super::coded::Coded;
use super::numbers::{carried_variants, number_table};
use super::values::{CodeReader, RequestCode, RequestCodeError};
use crate::controller::Request;
use crate::trajectory::Trajectory;
use core::fmt;

carried_variants! {
    /// Numbers of [`Request`](crate::controller::Request).
    request_kind;
    Request<const N>: fn encode_request, fn decode_request, RequestCodeError::Kind;
    /// Enters idle.
    IDLE = 1 "idle": Idle,
    /// Enters gravity hold.
    GRAVITY_HOLD = 2 "gravity_hold": GravityHold,
    /// Moves to a pose along a line in joint space.
    MOVE = 3 "move": Move { target_rad, duration_s },
    /// Follows a trajectory with the tip.
    TRACK = 4 "track": Track(trajectory),
    /// Changes the gains of the tip's position.
    GAINS = 5 "gains": Gains { gains, ramp_s },
    /// Leaves the fault.
    RESET = 6 "reset": Reset,
    /// Follows a Fourier series of all joints.
    EXCITE = 7 "excite": Excite(series),
    /// Measures the breakaway torque of a joint.
    BREAKAWAY = 8 "breakaway": Breakaway(ramp),
    /// Enters float.
    FLOAT = 9 "float": Float,
    /// Moves to a pose with the gains of the joint impedance mode.
    JOINT_IMPEDANCE = 10 "joint_impedance": JointImpedance { target_rad, duration_s },
    /// Changes the gains of the joint impedance mode.
    JOINT_GAINS = 11 "joint_gains": JointGains { gains, ramp_s },
    /// Follows a trajectory while the tip turns.
    TRACK_POSE = 12 "track_pose": TrackPose { rotation, trajectory },
    /// Changes the gains of the tip's orientation.
    ROTATIONAL_GAINS = 13 "rotational_gains": RotationalGains { gains, ramp_s },
    /// Switches learning.
    LEARNING = 14 "learning": Learning(switch),
    /// Brings learned parameters into force.
    LEARNED_PARAMETERS = 15 "learned_parameters": LearnedParameters(parameters),
    /// Brings the learned map of a joint into force.
    LEARNED_MAP = 16 "learned_map": LearnedMap { joint, map },
    /// Brings the reference of the tip to a point at a given cycle.
    SET_POINT = 17 "set_point": SetPoint(point),
    /// Changes the gains of the pose mode to matrices.
    GAIN_MATRICES = 18 "gain_matrices": GainMatrices { part, gains, axes, ramp_s },
}

carried_variants! {
    /// Numbers of [`Trajectory`](crate::Trajectory).
    trajectory_kind;
    Trajectory: fn encode_trajectory, fn decode_trajectory, RequestCodeError::Trajectory;
    /// Stays at a point.
    HOLD = 1 "hold": Hold(position),
    /// A line from point to point.
    LINE = 2 "line": Line(line),
    /// A sinusoid along a line.
    SINUSOID = 3 "sinusoid": Sinusoid(sinusoid),
    /// A sinusoid along an arc about the base.
    ARC = 4 "arc": Arc(arc),
    /// Sides and arc of a quadrant.
    QUADRANT = 5 "quadrant": Quadrant(quadrant),
    /// The probing cycle.
    PROBE = 6 "probe": Probe(probe),
}

impl Coded for Trajectory {
    fn put(&self, to: &mut RequestCode) {
        to.trajectory = encode_trajectory(self, to);
    }

    fn take(from: &mut CodeReader<'_>) -> Result<Self, RequestCodeError> {
        decode_trajectory(from.trajectory, from)
    }
}

impl fmt::Display for RequestCodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RequestCodeError::Kind(kind) => write!(
                f,
                "request is {kind}, known are 0 to {}",
                request_kind::ALL.len() - 1
            ),
            RequestCodeError::Trajectory(kind) => {
                write!(
                    f,
                    "trajectory is {kind}, known are 1 to {}",
                    trajectory_kind::ALL.len() - 1
                )
            }
            RequestCodeError::Count { found, expected } => {
                write!(f, "the request has {found} values, it takes {expected}")
            }
            RequestCodeError::Whole(found) => {
                write!(f, "a count is {found}, expected a whole number")
            }
        }
    }
}

impl core::error::Error for RequestCodeError {}

impl RequestCode {
    /// Returns the code of a request.
    pub fn new<const N: usize>(request: Option<&Request<N>>) -> RequestCode {
        let mut code = RequestCode::NONE;
        if let Some(request) = request {
            code.kind = encode_request(request, &mut code);
        }
        code
    }

    /// Returns the request of these numbers.
    ///
    /// # Errors
    /// [`RequestCodeError`].
    pub fn request<const N: usize>(&self) -> Result<Option<Request<N>>, RequestCodeError> {
        let mut rest = CodeReader {
            values: self.values(),
            taken: 0,
            trajectory: self.trajectory,
        };
        let request = match self.kind {
            request_kind::NONE => None,
            kind => Some(decode_request(kind, &mut rest)?),
        };
        let (found, expected) = (rest.values.len(), rest.taken);
        if found == expected {
            Ok(request)
        } else {
            Err(RequestCodeError::Count { found, expected })
        }
    }
}
