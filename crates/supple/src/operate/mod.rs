//! Operator commands: shows the state of a running system and sends requests to it.
//!
//! The controller checks every request; the command prints its reply.

mod approach;
mod arm;
mod at_home;
mod learning;
pub mod pendant;
mod session;
mod status;
mod system_request;
mod teaching;

use arm::{arm_of_system, check_arm};
use system_request::{
    SystemRequest, TELEMETRY_TIMEOUT, axes, print_mode, print_reply, running, send_and_print,
    value_count,
};

pub use approach::Approach;
pub use arm::arm_of;
pub use at_home::at_home;
pub use learning::learning;
pub use pendant::{Pendant, pendant};
pub use session::OperatorSession;
pub use status::status;
pub use teaching::{play, teach};

use crate::cli::{
    GainsArgs, ModeArgs, ModeName, StopArgs, SystemArgs, TrackArgs, TrackTarget, TrackTrajectory,
    UpTrajectory,
};
use crate::up::RunningSystem;
use core::time::Duration;
use serde::Serialize;
use std::time::Instant;
use supple_cli::arguments::UrdfArgs;
use supple_cli::arms;
use supple_cli::console::{print_json, print_status};
use supple_cli::exit::Failure;
use supple_core::Trajectory;
use supple_experiment::scenario;
use supple_ipc::message::{Drives, OperatorReply, Outcome, Telemetry};
use supple_ipc::{
    Domain, IpcError, TelemetryReader, idle_socket, idle_socket_is_open, request_idle,
};
use supple_model::{Description, with_dof};
use supple_realtime::pause;

/// Cap radius of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;

/// Interval at which the command checks for the pidfile of a running system.
const PIDFILE_INTERVAL: Duration = Duration::from_millis(20);

/// Interval at which `supple stop --supported` repeats its declaration.
const DECLARE_INTERVAL: Duration = Duration::from_millis(500);

/// Time after which `supple stop` says for what it waits.
const SILENT_WAIT: Duration = Duration::from_secs(1);

/// Result of `supple stop`, as `--json` prints it: the prefix of the system whose shutdown was requested, and whether it has ended.
#[derive(Serialize)]
struct StopResult<'a> {
    stopping: &'a str,
    ended: bool,
}

/// Runs `supple mode`.
///
/// # Errors
/// [`Failure`].
pub fn mode(args: &ModeArgs) -> Result<(), Failure> {
    let system = &args.system;
    match args.mode {
        ModeName::Idle => idle(system),
        ModeName::GravityHold => gravity_hold(system),
        ModeName::Float => send_and_print(system, &SystemRequest::Float),
        ModeName::JointImpedance => send_and_print(system, &SystemRequest::JointImpedance(args)),
    }
}

/// Requests gravity hold. Fails while the plant holds an arm without brakes and lays it down: the controller would accept the
/// request, but the arm would continue to sink.
fn gravity_hold(system: &SystemArgs) -> Result<(), Failure> {
    let (.., telemetry) = running(system)?;
    match telemetry.state.drives() {
        Drives::Held => Err(Failure::ArmIsLaidDown),
        _ => send_and_print(system, &SystemRequest::GravityHold),
    }
}

/// Requests idle through a separate socket that needs no reader or operator slot, no shared memory and no lock.
fn idle(system: &SystemArgs) -> Result<(), Failure> {
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    match request_idle(&domain, TELEMETRY_TIMEOUT) {
        Ok(Some(answer)) if answer.outcome == Outcome::Refused => Err(Failure::Refused {
            reason: session::reason_of(&answer.text),
        }),
        Ok(Some(answer)) => print_mode(system, answer.mode, answer.cycle),
        Ok(None) => idle_as_any_request(system, &domain, None),
        Err(error) => idle_as_any_request(system, &domain, Some(error)),
    }
}

/// Requests idle in the same way as other modes, if the separate socket does not exist or is not answered.
fn idle_as_any_request(
    system: &SystemArgs,
    domain: &Domain,
    error: Option<IpcError>,
) -> Result<(), Failure> {
    if running(system).is_err() {
        return Err(match error {
            Some(error) => Failure::system(error),
            None if idle_socket_is_open(domain) => Failure::ControllerHangs {
                prefix: domain.prefix().to_owned(),
            },
            None => Failure::NotRunning {
                prefix: domain.prefix().to_owned(),
            },
        });
    }
    let cause = error.map_or("the controller does not answer there".to_owned(), |error| {
        error.to_string()
    });
    print_status(&format!(
        "warning: the socket of idle requests, {}, cannot be used: {cause}; idle is requested as any other mode",
        idle_socket(domain).display()
    ));
    send_and_print(system, &SystemRequest::Idle)
}

/// Runs `supple reset`: clears the latched fault.
///
/// # Errors
/// [`Failure`].
pub fn reset(system: &SystemArgs) -> Result<(), Failure> {
    send_and_print(system, &SystemRequest::Reset)
}

/// Runs `supple gains`: changes stiffness and damping along a ramp: those of the tip, of the joints or of the tip's orientation,
/// depending on the given gains. Gains that are not given are unchanged; matrices are given as pairs of stiffness and damping.
///
/// # Errors
/// [`Failure`].
pub fn gains(args: &GainsArgs) -> Result<(), Failure> {
    let of_joints = !(args.joint_stiffness.is_empty() && args.joint_damping.is_empty());
    let of_orientation = !(args.rotational.is_empty() && args.rotational_damping.is_empty());
    let of_tip = [
        &args.stiffness,
        &args.damping,
        &args.rotational,
        &args.rotational_damping,
    ];
    let as_matrices = args.axes.is_some() || of_tip.iter().any(|values| values.len() == 6);
    let request = match (of_joints, of_orientation) {
        (false, _) if as_matrices => SystemRequest::GainMatrices(args),
        (true, _) => SystemRequest::JointGains(args),
        (false, true) => SystemRequest::RotationalGains(args),
        (false, false) => SystemRequest::Gains(args),
    };
    send_and_print(&args.system, &request)
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

/// Runs `supple track`: moves the arm to the start of a trajectory or of a file's motion and tracks it; `pose` starts at the
/// present position of the tip.
///
/// # Errors
/// [`Failure`].
pub fn track(args: &TrackArgs) -> Result<(), Failure> {
    let arm = || arm_of_system(&args.system, args.arm.as_deref(), &args.urdf);
    let trajectory = match &args.trajectory {
        TrackTarget::Named(trajectory) => *trajectory,
        TrackTarget::File(file) => {
            return teaching::perform(&teaching::Playback {
                file,
                speed: args.speed,
                arm: &arm()?,
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
        return send_and_print(&args.system, &SystemRequest::Pose(args));
    }
    let arm = arm()?;
    let description = arms::find(&arm, args.strict)?;
    let paths = description.paths();
    let (trajectory, duration_s) = match trajectory {
        TrackTrajectory::Pose => return send_and_print(&args.system, &SystemRequest::Pose(args)),
        TrackTrajectory::Sinusoid => paths.sinusoid(args.speed),
        TrackTrajectory::Arc => paths.arc(args.speed),
        TrackTrajectory::Quadrant => {
            let speed_m_per_s = args.speed * scenario::QUADRANT_SPEED_M_PER_S;
            let (quadrant, duration_s) = paths.quadrant(speed_m_per_s);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
    };
    follow(&args.system, &arm, &description, trajectory, duration_s)
}

/// Runs `supple probe`: moves the arm to the start of the probing cycle and runs it.
///
/// # Errors
/// [`Failure`].
pub fn probe(
    arm: Option<&str>,
    urdf: &UrdfArgs,
    strict: bool,
    system: &SystemArgs,
) -> Result<(), Failure> {
    let arm = arm_of_system(system, arm, urdf)?;
    let description = arms::find(&arm, strict)?;
    let (trajectory, duration_s) = trajectory_for(UpTrajectory::Probe, &description);
    follow(system, &arm, &description, trajectory, duration_s)
}

fn follow(
    system: &SystemArgs,
    arm: &str,
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
        let mut reader = TelemetryReader::new(domain).map_err(Failure::system)?;
        session.wait_for_all(&mut reader, approach.longest_wait(&position.into()))
    }
    let (domain, reader, telemetry) = running(system)?;
    // In virtual time the controller waits for every reader.
    drop(reader);
    check_arm(&domain, arm, description, &telemetry)?;
    let reply = with_dof!(description.dof(), N => sized::<N>(
        &domain, &telemetry, description, trajectory, duration_s
    ))??;
    print_reply(system, &reply)
}

/// Runs `supple stop`: terminates the `supple up` of a system.
///
/// # Errors
/// [`Failure::NotRunning`].
pub fn stop(args: &StopArgs) -> Result<(), Failure> {
    let system = &args.system;
    let domain = Domain::new(system.prefix.as_deref()).map_err(Failure::system)?;
    let start = Instant::now();
    let running = loop {
        if let Some(running) = RunningSystem::of(&domain) {
            break running;
        }
        // `supple up` creates its pidfile again if another program has removed it.
        if !idle_socket_is_open(&domain) || start.elapsed() > TELEMETRY_TIMEOUT {
            return Err(Failure::NotRunning {
                prefix: domain.prefix().to_owned(),
            });
        }
        pause(PIDFILE_INTERVAL);
    };
    running.terminate(args.supported)?;
    match (args.no_wait, args.supported) {
        (true, _) => {}
        (false, false) if running.held_until_supported => wait_unless_held(&running),
        (false, supported) => wait_for_end(&running, supported)?,
    }
    match system.json {
        true => print_json(&StopResult {
            stopping: domain.prefix(),
            ended: !running.runs(),
        }),
        false => Ok(()),
    }
}

/// Waits until a system has ended that holds its arm until it is supported, if drives have torque; not longer than one without takes.
fn wait_unless_held(running: &RunningSystem) {
    let start = Instant::now();
    while running.runs() && start.elapsed() < SILENT_WAIT {
        pause(PIDFILE_INTERVAL);
    }
    if running.runs() {
        print_status(
            "the system still runs and holds the arm, if its drives have torque: support the arm, then run `supple stop --supported`, \
             which releases it",
        );
    }
}

/// Waits until a system has ended. That its arm is supported is declared again and again: a system that is only beginning to end forgets
/// what was declared before.
fn wait_for_end(running: &RunningSystem, supported: bool) -> Result<(), Failure> {
    let releases = supported && running.held_until_supported;
    let start = Instant::now();
    let (mut silent, mut declared) = (true, start);
    while running.runs() {
        if releases && declared.elapsed() > DECLARE_INTERVAL {
            declared = Instant::now();
            running.declare_supported()?;
        }
        if silent && start.elapsed() > SILENT_WAIT {
            silent = false;
            print_status(match releases {
                true => {
                    "waiting until the torque of the supported arm has faded (Ctrl-C ends only the waiting)"
                }
                false => {
                    "waiting for the end of the system: an arm without brakes is laid down first, and a procedure may compute or \
                     wait for an answer (Ctrl-C ends only the waiting)"
                }
            });
        }
        pause(PIDFILE_INTERVAL);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::system_request::{axes, matrix};
    use supple_cli::exit::Failure;

    const NOW: [f64; 3] = [1.0, 2.0, 3.0];

    #[test]
    fn matrices_are_symmetric_and_need_both_parts() {
        let of_six = matrix("--stiffness", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).expect("a matrix");
        assert_eq!(of_six, of_six.transpose());
        assert_eq!(
            [of_six[(1, 2)], of_six[(0, 2)], of_six[(0, 1)]],
            [4.0, 5.0, 6.0]
        );
        assert_eq!(
            matrix("--damping", &[2.0])
                .expect("all axes")
                .diagonal()
                .min(),
            2.0
        );
        for given in [&[][..], &[1.0, 2.0], &[1.0; 9]] {
            let refused = matrix("--damping", given).expect_err("no matrix");
            assert!(refused.to_string().contains("--damping"), "{refused}");
        }
    }

    #[test]
    fn gains_are_one_value_or_one_per_axis() {
        let read = |given: &[f64]| axes("--stiffness", given, NOW).map(<[f64; 3]>::from);
        assert_eq!(read(&[]).expect("the present gains"), NOW);
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
