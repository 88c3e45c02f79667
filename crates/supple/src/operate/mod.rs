//! Operator commands: shows the state of a running system and sends requests to it.
//!
//! The controller checks every request; the command prints its reply.

mod approach;
mod learning;
pub mod pendant;
mod session;
mod status;
mod teaching;

pub use approach::Approach;
pub use learning::learning;
pub use pendant::{Pendant, pendant};
pub use session::OperatorSession;
pub use status::status;
pub use teaching::{play, teach};

use crate::cli::{
    GainsArgs, ModeArgs, ModeName, SystemArgs, TrackArgs, TrackTarget, TrackTrajectory,
    UpTrajectory,
};
use crate::up::stop_running;
use core::time::Duration;
use serde::Serialize;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_core::config::{Gains, JointGains, RotationalGains};
use supple_core::controller::{LearningSwitch, Mode, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::Rotation;
use supple_core::{Trajectory, Vector};
use supple_experiment::scenario;
use supple_ipc::message::{OperatorReply, Outcome, Telemetry};
use supple_ipc::{Domain, TelemetryReader, request_idle};
use supple_model::{Description, with_dof};

/// Cap radius of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Timeout for the first telemetry.
const TELEMETRY_TIMEOUT: Duration = Duration::from_secs(2);

/// Reply to a request, as `--json` prints it.
#[derive(Serialize)]
struct Answer {
    accepted: bool,
    mode: &'static str,
    cycle: u64,
}

/// Result of `supple stop`, as `--json` prints it: the prefix of the system whose shutdown was requested.
#[derive(Serialize)]
struct Stopping<'a> {
    stopping: &'a str,
}

/// Connects to the system and waits for its telemetry.
///
/// # Errors
/// [`Failure::NotRunning`] if no telemetry arrives.
fn running(system: &SystemArgs) -> Result<(Domain, TelemetryReader, Telemetry), Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    let mut reader = TelemetryReader::new(&domain).map_err(Failure::system)?;
    match reader.wait(TELEMETRY_TIMEOUT).map_err(Failure::system)? {
        Some(telemetry) => Ok((domain, reader, telemetry)),
        None => Err(Failure::NotRunning {
            prefix: domain.prefix().to_owned(),
        }),
    }
}

/// Time for which the compliant joints come to rest where they are \[s\].
const COMPLY_S: f64 = 0.5;

/// Runs `supple mode`.
///
/// # Errors
/// [`Failure`].
pub fn mode(args: &ModeArgs) -> Result<(), Failure> {
    let system = &args.system;
    match args.mode {
        ModeName::Idle => idle(system),
        ModeName::GravityHold => ask(system, &SystemRequest::GravityHold),
        ModeName::Float => ask(system, &SystemRequest::Float),
        ModeName::JointImpedance => ask(system, &SystemRequest::JointImpedance(args)),
    }
}

/// Requests idle over a separate socket that needs no reader or operator slot, no shared memory and no lock.
fn idle(system: &SystemArgs) -> Result<(), Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    match request_idle(&domain, TELEMETRY_TIMEOUT).map_err(Failure::system)? {
        Some(answer) if answer.outcome == Outcome::Refused => Err(Failure::Refused {
            reason: answer.text,
        }),
        Some(answer) => print_mode(system, answer.mode, answer.cycle),
        None => Err(Failure::NotRunning {
            prefix: domain.prefix().to_owned(),
        }),
    }
}

/// Runs `supple reset`: clears the latched fault.
///
/// # Errors
/// [`Failure`].
pub fn reset(system: &SystemArgs) -> Result<(), Failure> {
    ask(system, &SystemRequest::Reset)
}

/// What a command requests of a running system, for an arm of any number of joints.
enum SystemRequest<'a> {
    GravityHold,
    Float,
    JointImpedance(&'a ModeArgs),
    Reset,
    Learning(LearningSwitch),
    Gains(&'a GainsArgs),
    JointGains(&'a GainsArgs),
    RotationalGains(&'a GainsArgs),
    Pose(&'a TrackArgs),
}

impl SystemRequest<'_> {
    fn request<const N: usize>(&self, telemetry: &Telemetry) -> Result<Request<N>, Failure> {
        let now = telemetry.record();
        Ok(match self {
            SystemRequest::GravityHold => Request::GravityHold,
            SystemRequest::Float => Request::Float,
            SystemRequest::Reset => Request::Reset,
            SystemRequest::Learning(switch) => Request::Learning(*switch),
            SystemRequest::JointImpedance(args) => match args.target.len() {
                0 => Request::JointImpedance {
                    target_rad: first(&now.position_rad),
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
                let stiffness = first(&now.joint_stiffness_nm_per_rad);
                let damping = first(&now.joint_damping_nm_s_per_rad);
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

/// The first `N` joints of a record.
fn first<const N: usize, const M: usize>(joints: &Vector<M>) -> Vector<N> {
    Vector::from_fn(|i, _| joints[i])
}

fn value_count(option: &'static str, found: usize, expected: String) -> Failure {
    Failure::ValueCount {
        option,
        found,
        expected,
    }
}

/// One value for all axes, or X,Y,Z; without any what is in force.
fn axes(option: &'static str, given: &[f64], now: [f64; 3]) -> Result<Vector3<f64>, Failure> {
    match *given {
        [] => Ok(Vector3::from(now)),
        [all] => Ok(Vector3::repeat(all)),
        [x, y, z] => Ok(Vector3::new(x, y, z)),
        _ => Err(value_count(option, given.len(), "1 or 3, X,Y,Z".to_owned())),
    }
}

/// One value for all joints, or one per joint; without any what is in force.
fn joints<const N: usize>(
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

fn ask(system: &SystemArgs, request: &SystemRequest<'_>) -> Result<(), Failure> {
    fn send<const N: usize>(
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
    print_reply(system, &reply)
}

/// Runs `supple gains`: changes stiffness and damping along a ramp, of the tip, or of the joints or the tip's orientation
/// where their gains are given. Gains that are not given are unchanged.
///
/// # Errors
/// [`Failure`].
pub fn gains(args: &GainsArgs) -> Result<(), Failure> {
    let of_joints = !(args.joint_stiffness.is_empty() && args.joint_damping.is_empty());
    let of_orientation = !(args.rotational.is_empty() && args.rotational_damping.is_empty());
    let request = match (of_joints, of_orientation) {
        (true, _) => SystemRequest::JointGains(args),
        (false, true) => SystemRequest::RotationalGains(args),
        (false, false) => SystemRequest::Gains(args),
    };
    ask(&args.system, &request)
}

/// Returns the trajectory and its duration \[s\].
pub fn trajectory_for(trajectory: UpTrajectory, description: &Description) -> (Trajectory, f64) {
    let paths = description.paths();
    match trajectory {
        UpTrajectory::Sinusoid => paths.sinusoid(1.0),
        UpTrajectory::Arc => paths.arc(1.0),
        UpTrajectory::Quadrant => {
            let (quadrant, duration_s) = paths.quadrant(scenario::QUADRANT_SPEED_M_PER_S);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
        UpTrajectory::Probe => {
            let radius_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
            let (probe, duration_s) = paths.probe(radius_m);
            (Trajectory::Probe(probe), duration_s)
        }
    }
}

/// Runs `supple track`: moves the arm to the start of a trajectory or of a file's motion and tracks it; a pose starts where
/// the tip is.
///
/// # Errors
/// [`Failure`].
pub fn track(args: &TrackArgs) -> Result<(), Failure> {
    let trajectory = match &args.trajectory {
        TrackTarget::Named(trajectory) => *trajectory,
        TrackTarget::File(file) => {
            return teaching::perform(&teaching::Performance {
                file,
                speed: args.speed,
                arm: &args.urdf.name(&args.arm),
                strict: args.strict,
                stiffness: &[],
                damping: &[],
                system: &args.system,
            });
        }
    };
    if trajectory != TrackTrajectory::Pose && !args.rotate.is_empty() {
        let none = "0: only a pose turns".to_owned();
        return Err(value_count("--rotate", args.rotate.len(), none));
    }
    if trajectory == TrackTrajectory::Pose {
        return ask(&args.system, &SystemRequest::Pose(args));
    }
    let description = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let paths = description.paths();
    let (trajectory, duration_s) = match trajectory {
        TrackTrajectory::Pose => return ask(&args.system, &SystemRequest::Pose(args)),
        TrackTrajectory::Sinusoid => paths.sinusoid(args.speed),
        TrackTrajectory::Arc => paths.arc(args.speed),
        TrackTrajectory::Quadrant => {
            let speed_m_per_s = args.speed * scenario::QUADRANT_SPEED_M_PER_S;
            let (quadrant, duration_s) = paths.quadrant(speed_m_per_s);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
    };
    follow(&args.system, &description, trajectory, duration_s)
}

/// Runs `supple probe`: moves the arm to the start of the probing cycle and runs it.
///
/// # Errors
/// [`Failure`].
pub fn probe(arm: &str, strict: bool, system: &SystemArgs) -> Result<(), Failure> {
    let description = arms::find(arm, strict)?;
    let (trajectory, duration_s) = trajectory_for(UpTrajectory::Probe, &description);
    follow(system, &description, trajectory, duration_s)
}

fn follow(
    system: &SystemArgs,
    description: &Description,
    trajectory: Trajectory,
    duration_s: f64,
) -> Result<(), Failure> {
    fn sized<const N: usize>(
        domain: &Domain,
        telemetry: &Telemetry,
        description: &Description,
        trajectory: Trajectory,
        duration_s: f64,
    ) -> Result<OperatorReply, Failure> {
        let approach = Approach::<N>::new(&description.config()?, trajectory, duration_s)?;
        let position = core::array::from_fn(|i| telemetry.record().position_rad[i]);
        let mut session = OperatorSession::<N>::new(domain)?;
        session.follow(&approach, &position.into(), None)?;
        session.wait_for_all(approach.longest_wait(&position.into()))
    }
    let (domain, _reader, telemetry) = running(system)?;
    let reply = with_dof!(description.dof(), N => sized::<N>(
        &domain, &telemetry, description, trajectory, duration_s
    ))??;
    print_reply(system, &reply)
}

/// Runs `supple stop`: terminates the `supple up` of a system.
///
/// # Errors
/// [`Failure::NotRunning`].
pub fn stop(system: &SystemArgs) -> Result<(), Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    if stop_running(&domain)? {
        return match system.json {
            true => print_json(&Stopping {
                stopping: domain.prefix(),
            }),
            false => Ok(()),
        };
    }
    Err(Failure::NotRunning {
        prefix: domain.prefix().to_owned(),
    })
}

fn print_reply(system: &SystemArgs, reply: &OperatorReply) -> Result<(), Failure> {
    print_mode(system, reply.mode(), reply.cycle)
}

/// Prints the mode after an accepted request; returns an error if the system is in a fault.
fn print_mode(system: &SystemArgs, mode: Option<Mode>, cycle: u64) -> Result<(), Failure> {
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

#[cfg(test)]
mod tests {
    use super::axes;
    use supple_cli::exit::Failure;

    const NOW: [f64; 3] = [1.0, 2.0, 3.0];

    #[test]
    fn gains_are_one_value_or_one_per_axis() {
        let read = |given: &[f64]| axes("--stiffness", given, NOW).map(<[f64; 3]>::from);
        assert_eq!(read(&[]).expect("what is in force"), NOW);
        assert_eq!(read(&[7.0]).expect("all axes"), [7.0; 3]);
        assert_eq!(read(&[7.0, 8.0, 9.0]).expect("by axis"), [7.0, 8.0, 9.0]);
        for given in [&[7.0, 8.0][..], &[7.0, 8.0, 9.0, 10.0]] {
            let refused = read(given).expect_err("neither one nor three");
            assert!(
                matches!(refused, Failure::ValueCount { option: "--stiffness", found, .. } if found == given.len()),
                "{refused}"
            );
        }
    }
}
