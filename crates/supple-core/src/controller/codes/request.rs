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

use super::numbers::{request_kind, trajectory_kind};
use crate::config::{Gains, JointGains, RotationalGains};
use crate::controller::{Breakaway, LearningSwitch, Request, SetPoint};
use crate::math::{Vector, Vector3};
use crate::model::learned::{JointMap, LearnedParameters};
use crate::trajectory::{
    Arc, Fourier, HARMONICS, Line, Probe, Quadrant, Rotation, Sinusoid, Trajectory,
};
use core::fmt;

/// Most values that a request carries: those of an excitation of 7 joints.
pub const VALUES: usize = 80;

/// A request as numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestCode {
    /// One of [`request_kind`].
    pub kind: u8,
    /// Of a track or track-pose request one of [`trajectory_kind`], otherwise none.
    pub trajectory: u8,
    /// How many of `values` count.
    pub count: u8,
    /// What the request carries, see the module; zero beyond `count`.
    pub values: [f64; VALUES],
}

/// Why numbers are no request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RequestCodeError {
    /// No request has this number.
    Kind(u8),
    /// No trajectory has this number.
    Trajectory(u8),
    /// Too few or too many values.
    Count {
        /// Values found.
        found: usize,
        /// Values that the request takes.
        expected: usize,
    },
    /// A number of strokes, of a joint, of a switch or of a cycle that is not whole or too great.
    Whole(f64),
}

impl fmt::Display for RequestCodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RequestCodeError::Kind(kind) => write!(
                f,
                "request is {kind}, known are 0 to {}",
                request_kind::SET_POINT
            ),
            RequestCodeError::Trajectory(kind) => {
                write!(
                    f,
                    "trajectory is {kind}, known are 1 to {}",
                    trajectory_kind::PROBE
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
    /// No request.
    pub const NONE: RequestCode = RequestCode {
        kind: 0,
        trajectory: 0,
        count: 0,
        values: [0.0; VALUES],
    };

    /// Of a request.
    pub fn new<const N: usize>(request: Option<&Request<N>>) -> RequestCode {
        let mut code = RequestCode::NONE;
        match request {
            None => {}
            Some(Request::Idle) => code.kind = request_kind::IDLE,
            Some(Request::GravityHold) => code.kind = request_kind::GRAVITY_HOLD,
            Some(Request::Move {
                target_rad,
                duration_s,
            }) => {
                code.kind = request_kind::MOVE;
                code.numbers(target_rad.as_slice());
                code.numbers(&[*duration_s]);
            }
            Some(Request::Track(trajectory)) => {
                code.kind = request_kind::TRACK;
                code.track(trajectory);
            }
            Some(Request::Gains { gains, ramp_s }) => {
                code.kind = request_kind::GAINS;
                code.vector(&gains.stiffness_n_per_m);
                code.vector(&gains.damping_n_s_per_m);
                code.numbers(&[*ramp_s]);
            }
            Some(Request::Float) => code.kind = request_kind::FLOAT,
            Some(Request::JointImpedance {
                target_rad,
                duration_s,
            }) => {
                code.kind = request_kind::JOINT_IMPEDANCE;
                code.numbers(target_rad.as_slice());
                code.numbers(&[*duration_s]);
            }
            Some(Request::JointGains { gains, ramp_s }) => {
                code.kind = request_kind::JOINT_GAINS;
                code.numbers(gains.stiffness_nm_per_rad.as_slice());
                code.numbers(gains.damping_nm_s_per_rad.as_slice());
                code.numbers(&[*ramp_s]);
            }
            Some(Request::TrackPose {
                trajectory,
                rotation,
            }) => {
                code.kind = request_kind::TRACK_POSE;
                code.vector(&rotation.axis);
                code.numbers(&[rotation.angle_rad, rotation.duration_s]);
                code.track(trajectory);
            }
            Some(Request::RotationalGains { gains, ramp_s }) => {
                code.kind = request_kind::ROTATIONAL_GAINS;
                code.vector(&gains.stiffness_nm_per_rad);
                code.vector(&gains.damping_nm_s_per_rad);
                code.numbers(&[*ramp_s]);
            }
            Some(Request::Learning(switch)) => {
                code.kind = request_kind::LEARNING;
                code.numbers(&[match switch {
                    LearningSwitch::Off => 0.0,
                    LearningSwitch::On => 1.0,
                    LearningSwitch::Reset => 2.0,
                }]);
            }
            Some(Request::LearnedParameters(parameters)) => {
                code.kind = request_kind::LEARNED_PARAMETERS;
                LearnedParameters::zero().each(parameters, |_, _, _, value| code.numbers(&[value]));
            }
            Some(Request::LearnedMap { joint, map }) => {
                code.kind = request_kind::LEARNED_MAP;
                code.numbers(&[*joint as f64]);
                code.numbers(&map.torque_nm);
                code.numbers(&map.dry_nm);
            }
            Some(Request::SetPoint(point)) => {
                code.kind = request_kind::SET_POINT;
                code.vector(&point.position_m);
                code.vector(&point.velocity_m_per_s);
                code.vector(&point.acceleration_m_per_s2);
                code.numbers(&[point.at_cycle as f64]);
            }
            Some(Request::Reset) => code.kind = request_kind::RESET,
            Some(Request::Excite(series)) => {
                code.kind = request_kind::EXCITE;
                let columns = series.sine_rad.iter().chain(&series.cosine_rad);
                for column in [&series.centre_rad].into_iter().chain(columns) {
                    code.numbers(column.as_slice());
                }
                code.numbers(&[
                    series.angular_frequency_rad_per_s,
                    series.duration_s,
                    series.ramp_s,
                ]);
            }
            Some(Request::Breakaway(ramp)) => {
                code.kind = request_kind::BREAKAWAY;
                code.numbers(&[
                    ramp.joint as f64,
                    ramp.rate_nm_per_s,
                    ramp.stop_rad,
                    ramp.limit_nm,
                ]);
            }
        }
        code
    }

    /// From its parts, such as a log holds them.
    ///
    /// # Errors
    /// More than [`VALUES`] values.
    pub fn from_parts(
        kind: u8,
        trajectory: u8,
        values: &[f64],
    ) -> Result<RequestCode, RequestCodeError> {
        let mut code = RequestCode {
            kind,
            trajectory,
            ..RequestCode::NONE
        };
        if values.len() > VALUES {
            return Err(RequestCodeError::Count {
                found: values.len(),
                expected: VALUES,
            });
        }
        code.numbers(values);
        Ok(code)
    }

    /// The values that count.
    pub fn values(&self) -> &[f64] {
        &self.values[..usize::from(self.count).min(VALUES)]
    }

    /// The request of these numbers.
    ///
    /// # Errors
    /// [`RequestCodeError`].
    pub fn request<const N: usize>(&self) -> Result<Option<Request<N>>, RequestCodeError> {
        let mut rest = Rest {
            values: self.values(),
            taken: 0,
        };
        let request = match self.kind {
            request_kind::NONE => None,
            request_kind::IDLE => Some(Request::Idle),
            request_kind::GRAVITY_HOLD => Some(Request::GravityHold),
            request_kind::MOVE => Some(Request::Move {
                target_rad: Vector::from(rest.take::<N>()),
                duration_s: rest.number(),
            }),
            request_kind::TRACK => Some(Request::Track(rest.trajectory(self.trajectory)?)),
            request_kind::GAINS => Some(Request::Gains {
                gains: Gains {
                    stiffness_n_per_m: rest.vector(),
                    damping_n_s_per_m: rest.vector(),
                },
                ramp_s: rest.number(),
            }),
            request_kind::RESET => Some(Request::Reset),
            request_kind::EXCITE => Some(Request::Excite(rest.series())),
            request_kind::BREAKAWAY => Some(Request::Breakaway(Breakaway {
                joint: rest.count()? as usize,
                rate_nm_per_s: rest.number(),
                stop_rad: rest.number(),
                limit_nm: rest.number(),
            })),
            request_kind::FLOAT => Some(Request::Float),
            request_kind::JOINT_IMPEDANCE => Some(Request::JointImpedance {
                target_rad: Vector::from(rest.take::<N>()),
                duration_s: rest.number(),
            }),
            request_kind::JOINT_GAINS => Some(Request::JointGains {
                gains: JointGains {
                    stiffness_nm_per_rad: Vector::from(rest.take::<N>()),
                    damping_nm_s_per_rad: Vector::from(rest.take::<N>()),
                },
                ramp_s: rest.number(),
            }),
            request_kind::TRACK_POSE => Some(Request::TrackPose {
                rotation: Rotation {
                    axis: rest.vector(),
                    angle_rad: rest.number(),
                    duration_s: rest.number(),
                },
                trajectory: rest.trajectory(self.trajectory)?,
            }),
            request_kind::ROTATIONAL_GAINS => Some(Request::RotationalGains {
                gains: RotationalGains {
                    stiffness_nm_per_rad: rest.vector(),
                    damping_nm_s_per_rad: rest.vector(),
                },
                ramp_s: rest.number(),
            }),
            request_kind::LEARNING => Some(Request::Learning(match rest.count()? {
                0 => LearningSwitch::Off,
                1 => LearningSwitch::On,
                2 => LearningSwitch::Reset,
                other => return Err(RequestCodeError::Whole(f64::from(other))),
            })),
            request_kind::LEARNED_PARAMETERS => {
                let mut parameters = LearnedParameters::zero();
                parameters.each(&LearnedParameters::zero(), |_, _, value, _| {
                    *value = rest.number();
                });
                Some(Request::LearnedParameters(parameters))
            }
            request_kind::LEARNED_MAP => Some(Request::LearnedMap {
                joint: rest.count()? as usize,
                map: JointMap {
                    torque_nm: rest.take(),
                    dry_nm: rest.take(),
                },
            }),
            request_kind::SET_POINT => Some(Request::SetPoint(SetPoint {
                position_m: rest.vector(),
                velocity_m_per_s: rest.vector(),
                acceleration_m_per_s2: rest.vector(),
                at_cycle: rest.cycle()?,
            })),
            unknown => return Err(RequestCodeError::Kind(unknown)),
        };
        let (found, expected) = (rest.values.len(), rest.taken);
        if found == expected {
            Ok(request)
        } else {
            Err(RequestCodeError::Count { found, expected })
        }
    }

    fn numbers(&mut self, numbers: &[f64]) {
        let count = usize::from(self.count);
        self.values[count..count + numbers.len()].copy_from_slice(numbers);
        self.count += numbers.len() as u8;
    }

    fn vector(&mut self, vector: &Vector3<f64>) {
        self.numbers(vector.as_slice());
    }

    fn track(&mut self, trajectory: &Trajectory) {
        match trajectory {
            Trajectory::Hold(position) => {
                self.trajectory = trajectory_kind::HOLD;
                self.vector(position);
            }
            Trajectory::Line(t) => {
                self.trajectory = trajectory_kind::LINE;
                self.vector(&t.from_m);
                self.vector(&t.to_m);
                self.numbers(&[t.duration_s]);
            }
            Trajectory::Sinusoid(t) => {
                self.trajectory = trajectory_kind::SINUSOID;
                self.vector(&t.centre_m);
                self.vector(&t.amplitude_m);
                self.numbers(&[t.angular_frequency_rad_per_s, t.ramp_s]);
            }
            Trajectory::Arc(t) => {
                self.trajectory = trajectory_kind::ARC;
                self.numbers(&[
                    t.radius_m,
                    t.height_m,
                    t.centre_rad,
                    t.amplitude_rad,
                    t.angular_frequency_rad_per_s,
                    t.ramp_s,
                ]);
            }
            Trajectory::Quadrant(t) => {
                self.trajectory = trajectory_kind::QUADRANT;
                self.vector(&t.centre_m());
                self.vector(&t.first_m());
                self.vector(&t.second_m());
                self.numbers(&[t.speed_m_per_s(), t.ramp_s(), t.corner_ramp_s()]);
            }
            Trajectory::Probe(t) => {
                self.trajectory = trajectory_kind::PROBE;
                self.numbers(&[
                    t.radius_m,
                    f64::from(t.strokes),
                    t.radial_step_m,
                    t.top_m,
                    t.stroke_m,
                    t.azimuth_rad,
                    t.azimuth_step_rad,
                    t.speed_m_per_s,
                    t.ramp_s,
                    t.dwell_s,
                ]);
            }
        }
    }
}

/// Values taken one after another; zero beyond the last, which the count then tells.
struct Rest<'a> {
    values: &'a [f64],
    taken: usize,
}

impl Rest<'_> {
    fn number(&mut self) -> f64 {
        let number = self.values.get(self.taken).copied().unwrap_or(0.0);
        self.taken += 1;
        number
    }

    /// A value that older logs lack; zero without it.
    fn number_if_present(&mut self) -> f64 {
        match self.taken < self.values.len() {
            true => self.number(),
            false => 0.0,
        }
    }

    fn take<const K: usize>(&mut self) -> [f64; K] {
        core::array::from_fn(|_| self.number())
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from(self.take::<3>())
    }

    fn series<const N: usize>(&mut self) -> Fourier<N> {
        let mut column = || Vector::<N>::from(self.take::<N>());
        let centre_rad = column();
        let sine_rad = [(); HARMONICS].map(|()| column());
        let cosine_rad = [(); HARMONICS].map(|()| column());
        Fourier {
            centre_rad,
            sine_rad,
            cosine_rad,
            angular_frequency_rad_per_s: self.number(),
            duration_s: self.number(),
            ramp_s: self.number(),
        }
    }

    fn count(&mut self) -> Result<u32, RequestCodeError> {
        let number = self.number();
        let count = number as u32;
        if f64::from(count) == number {
            Ok(count)
        } else {
            Err(RequestCodeError::Whole(number))
        }
    }

    /// A cycle number; a whole number below 2^53.
    fn cycle(&mut self) -> Result<u64, RequestCodeError> {
        let number = self.number();
        let cycle = number as u64;
        if cycle < 1 << 53 && cycle as f64 == number {
            Ok(cycle)
        } else {
            Err(RequestCodeError::Whole(number))
        }
    }

    fn trajectory(&mut self, kind: u8) -> Result<Trajectory, RequestCodeError> {
        Ok(match kind {
            trajectory_kind::HOLD => Trajectory::Hold(self.vector()),
            trajectory_kind::LINE => Trajectory::Line(Line {
                from_m: self.vector(),
                to_m: self.vector(),
                duration_s: self.number(),
            }),
            trajectory_kind::SINUSOID => Trajectory::Sinusoid(Sinusoid {
                centre_m: self.vector(),
                amplitude_m: self.vector(),
                angular_frequency_rad_per_s: self.number(),
                ramp_s: self.number(),
            }),
            trajectory_kind::ARC => Trajectory::Arc(Arc {
                radius_m: self.number(),
                height_m: self.number(),
                centre_rad: self.number(),
                amplitude_rad: self.number(),
                angular_frequency_rad_per_s: self.number(),
                ramp_s: self.number(),
            }),
            trajectory_kind::QUADRANT => {
                let (centre_m, first_m, second_m) = (self.vector(), self.vector(), self.vector());
                let (speed_m_per_s, ramp_s) = (self.number(), self.number());
                let quadrant = Quadrant::new(centre_m, first_m, second_m, speed_m_per_s, ramp_s);
                Trajectory::Quadrant(quadrant.with_corner_ramp(self.number_if_present()))
            }
            trajectory_kind::PROBE => Trajectory::Probe(Probe {
                radius_m: self.number(),
                strokes: self.count()?,
                radial_step_m: self.number(),
                top_m: self.number(),
                stroke_m: self.number(),
                azimuth_rad: self.number(),
                azimuth_step_rad: self.number(),
                speed_m_per_s: self.number(),
                ramp_s: self.number(),
                dwell_s: self.number_if_present(),
            }),
            unknown => return Err(RequestCodeError::Trajectory(unknown)),
        })
    }
}
