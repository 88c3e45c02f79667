//! Requests of commands to a running system, and their replies.

use super::session::OperatorSession;
use crate::cli::{GainAxesName, GainsArgs, ModeArgs, SystemArgs, TrackArgs};
use core::time::Duration;
use serde::Serialize;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_core::config::{Gains, JointGains, RotationalGains};
use supple_core::controller::{GainAxes, GainMatrices, GainPart, LearningSwitch, Mode, Request};
use supple_core::math::{Matrix3, Vector3};
use supple_core::trajectory::Rotation;
use supple_core::{Trajectory, Vector};
use supple_ipc::message::{OperatorReply, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::with_dof;

/// Timeout for the first telemetry.
pub(super) const TELEMETRY_TIMEOUT: Duration = Duration::from_secs(2);

/// Reply to a request, in the form that `--json` prints.
#[derive(Serialize)]
pub(super) struct Answer {
    pub(super) accepted: bool,
    pub(super) mode: &'static str,
    pub(super) cycle: u64,
}

/// Connects to the system and waits for its telemetry.
///
/// # Errors
/// [`Failure::NotRunning`] if no telemetry arrives.
pub(super) fn running(
    system: &SystemArgs,
) -> Result<(Domain, TelemetryReader, Telemetry), Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    let mut reader = TelemetryReader::new(&domain).map_err(Failure::system)?;
    match reader.wait(TELEMETRY_TIMEOUT).map_err(Failure::system)? {
        Some(telemetry) => Ok((domain, reader, telemetry)),
        None => Err(Failure::NotRunning {
            prefix: domain.prefix().to_owned(),
        }),
    }
}

/// Duration of the move with which compliant joints stop at the present pose \[s\].
pub(super) const COMPLY_S: f64 = 0.5;

/// Request of a command to a running system, for an arm with any number of joints.
pub(super) enum SystemRequest<'a> {
    Idle,
    GravityHold,
    Float,
    JointImpedance(&'a ModeArgs),
    Reset,
    Learning(LearningSwitch),
    Gains(&'a GainsArgs),
    JointGains(&'a GainsArgs),
    RotationalGains(&'a GainsArgs),
    GainMatrices(&'a GainsArgs),
    Pose(&'a TrackArgs),
}

impl SystemRequest<'_> {
    /// Returns what the request changes, unless that is the mode.
    fn change(&self) -> Option<&'static str> {
        match self {
            SystemRequest::Gains(_)
            | SystemRequest::JointGains(_)
            | SystemRequest::RotationalGains(_)
            | SystemRequest::GainMatrices(_) => Some("the gains change"),
            SystemRequest::Learning(LearningSwitch::On) => Some("learning is on"),
            SystemRequest::Learning(LearningSwitch::Off) => Some("learning is off"),
            SystemRequest::Learning(LearningSwitch::Reset) => Some("learning begins again"),
            _ => None,
        }
    }

    pub(super) fn request<const N: usize>(
        &self,
        telemetry: &Telemetry,
    ) -> Result<Request<N>, Failure> {
        let now = telemetry.record();
        Ok(match self {
            SystemRequest::Idle => Request::Idle,
            SystemRequest::GravityHold => Request::GravityHold,
            SystemRequest::Float => Request::Float,
            SystemRequest::Reset => Request::Reset,
            SystemRequest::Learning(switch) => Request::Learning(*switch),
            SystemRequest::JointImpedance(args) => match args.target.len() {
                0 => Request::JointImpedance {
                    target_rad: first_joints(&now.position_rad),
                    duration_s: COMPLY_S,
                },
                found if found == N => Request::JointImpedance {
                    target_rad: Vector::from_column_slice(&args.target),
                    duration_s: args.duration_s,
                },
                found => {
                    return Err(value_count(
                        "--target",
                        found,
                        format!("{N}, one per joint"),
                    ));
                }
            },
            SystemRequest::Gains(args) => Request::Gains {
                gains: Gains {
                    stiffness_n_per_m: axes("--stiffness", &args.stiffness, now.stiffness_n_per_m)?,
                    damping_n_s_per_m: axes("--damping", &args.damping, now.damping_n_s_per_m)?,
                },
                ramp_s: args.ramp_s,
            },
            SystemRequest::RotationalGains(args) => Request::RotationalGains {
                gains: RotationalGains {
                    stiffness_nm_per_rad: axes(
                        "--rotational",
                        &args.rotational,
                        now.rotational_stiffness_nm_per_rad,
                    )?,
                    damping_nm_s_per_rad: axes(
                        "--rotational-damping",
                        &args.rotational_damping,
                        now.rotational_damping_nm_s_per_rad,
                    )?,
                },
                ramp_s: args.ramp_s,
            },
            SystemRequest::GainMatrices(args) => {
                let linear = args.rotational.is_empty() && args.rotational_damping.is_empty();
                let (part, stiffness, damping) = match linear {
                    true => (
                        GainPart::Linear,
                        matrix("--stiffness", &args.stiffness)?,
                        matrix("--damping", &args.damping)?,
                    ),
                    false => (
                        GainPart::Rotational,
                        matrix("--rotational", &args.rotational)?,
                        matrix("--rotational-damping", &args.rotational_damping)?,
                    ),
                };
                Request::GainMatrices {
                    part,
                    gains: GainMatrices { stiffness, damping },
                    axes: match args.axes {
                        Some(GainAxesName::Tip) => GainAxes::Tip,
                        Some(GainAxesName::Base) | None => GainAxes::Base,
                    },
                    ramp_s: args.ramp_s,
                }
            }
            SystemRequest::Pose(args) => Request::TrackPose {
                trajectory: Trajectory::Hold(Vector3::from(now.tip_position_m)),
                rotation: Rotation {
                    axis: match *args.rotate {
                        [x, y, z] => Vector3::new(x, y, z).normalize(),
                        _ => {
                            let found = args.rotate.len();
                            return Err(value_count("--rotate", found, "3, X,Y,Z".to_owned()));
                        }
                    },
                    angle_rad: args.angle_rad,
                    duration_s: args.duration_s,
                },
            },
            SystemRequest::JointGains(args) => {
                let stiffness = first_joints(&now.joint_stiffness_nm_per_rad);
                let damping = first_joints(&now.joint_damping_nm_s_per_rad);
                Request::JointGains {
                    gains: JointGains {
                        stiffness_nm_per_rad: joints(
                            "--joint-stiffness",
                            &args.joint_stiffness,
                            stiffness,
                        )?,
                        damping_nm_s_per_rad: joints(
                            "--joint-damping",
                            &args.joint_damping,
                            damping,
                        )?,
                    },
                    ramp_s: args.ramp_s,
                }
            }
        })
    }
}

/// Returns the values of the first `N` joints of a record.
pub(super) fn first_joints<const N: usize, const M: usize>(joints: &Vector<M>) -> Vector<N> {
    Vector::from_fn(|i, _| joints[i])
}

pub(super) fn value_count(option: &'static str, found: usize, expected: String) -> Failure {
    Failure::ValueCount {
        option,
        found,
        expected,
    }
}

/// Converts one value for all axes, or X,Y,Z; without values, returns the present gains.
pub(super) fn axes(
    option: &'static str,
    given: &[f64],
    now: [f64; 3],
) -> Result<Vector3<f64>, Failure> {
    match *given {
        [] => Ok(Vector3::from(now)),
        [all] => Ok(Vector3::repeat(all)),
        [x, y, z] => Ok(Vector3::new(x, y, z)),
        _ => Err(value_count(option, given.len(), "1 or 3, X,Y,Z".to_owned())),
    }
}

/// Converts values to a symmetric matrix of the pose mode: one value for all axes, X,Y,Z, or XX,YY,ZZ,YZ,ZX,XY.
pub(super) fn matrix(option: &'static str, given: &[f64]) -> Result<Matrix3<f64>, Failure> {
    match *given {
        [all] => Ok(Matrix3::from_diagonal_element(all)),
        [x, y, z] => Ok(Matrix3::from_diagonal(&Vector3::new(x, y, z))),
        [xx, yy, zz, yz, zx, xy] => Ok(GainMatrices::symmetric([xx, yy, zz, yz, zx, xy])),
        _ => {
            let expected = "1, 3 or 6, XX,YY,ZZ,YZ,ZX,XY, for stiffness and damping";
            Err(value_count(option, given.len(), expected.to_owned()))
        }
    }
}

/// Converts one value for all joints, or one per joint; without values, returns the present gains.
pub(super) fn joints<const N: usize>(
    option: &'static str,
    given: &[f64],
    now: Vector<N>,
) -> Result<Vector<N>, Failure> {
    match given.len() {
        0 => Ok(now),
        1 => Ok(Vector::repeat(given[0])),
        found if found == N => Ok(Vector::from_column_slice(given)),
        found => Err(value_count(
            option,
            found,
            format!("1, or {N}, one per joint"),
        )),
    }
}

pub(super) fn send_and_print(
    system: &SystemArgs,
    request: &SystemRequest<'_>,
) -> Result<(), Failure> {
    pub(super) fn send<const N: usize>(
        domain: &Domain,
        telemetry: &Telemetry,
        request: &SystemRequest<'_>,
    ) -> Result<OperatorReply, Failure> {
        let request = request.request::<N>(telemetry)?;
        OperatorSession::<N>::new(domain)?.send_request(&request, None)
    }
    let (domain, _reader, telemetry) = running(system)?;
    let dof = usize::from(telemetry.state.dof);
    let reply = with_dof!(dof, N => send::<N>(&domain, &telemetry, request))??;
    if let (Some(change), false) = (request.change(), system.json) {
        let mode = reply.mode().map_or("unknown", |mode| mode.name());
        return print_line(&format!("{change} from cycle {}; mode {mode}", reply.cycle));
    }
    print_reply(system, &reply)
}

pub(super) fn print_reply(system: &SystemArgs, reply: &OperatorReply) -> Result<(), Failure> {
    print_mode(system, reply.mode(), reply.cycle)
}

/// Prints the mode after an accepted request; returns an error if the system is in a fault.
pub(super) fn print_mode(
    system: &SystemArgs,
    mode: Option<Mode>,
    cycle: u64,
) -> Result<(), Failure> {
    let name = mode.map_or("unknown", |mode| mode.name());
    match system.json {
        true => print_json(&Answer {
            accepted: true,
            mode: name,
            cycle,
        })?,
        false => print_line(&format!("mode {name} since cycle {cycle}"))?,
    }
    match mode {
        Some(Mode::Fault) => Err(Failure::SystemInFault),
        _ => Ok(()),
    }
}
