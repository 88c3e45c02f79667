//! Runs a test case in wall-clock time, from normal operation through the failure to recovery.

use super::request_obstruction::{FullOutput, idle_after, idle_past_a_full_queue};
use super::row::{ProcessTestResult, Row};
use super::spec::{Event, ProcessFailure, RequestObstruction, Spec, TestTask, UP};
use super::task;
use super::test_arms::TestArm;
use super::trace::TraceAfterLoss;
use super::up_process::Up;
use crate::cli::{DrillArgs, PlantKind, UpArgs, UpTrajectory};
use crate::operate::OperatorSession;
use crate::up::System;
use core::time::Duration;
use rustix::process::Signal;
use std::time::Instant;
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::monotonic_ns;

/// Vertical clearance between the trajectory (height 0) and the top face of the block, without the cap radius \[m\].
const BLOCK_CLEARANCE_M: f64 = 0.05;
/// Duration of the task before the loss \[s\].
const BEFORE_LOSS_S: f64 = 0.5;
/// Observation time after the loss: if the process is restarted, and if it is not.
const OBSERVED: [Duration; 2] = [Duration::from_secs(2), Duration::from_millis(1200)];
/// Timeout for reaching tracking mode.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Number of start attempts before the test case is given up.
const ATTEMPTS: u32 = 3;
/// Timeout for controller and drives to reach idle; a braked arm descends during this time.
const REST_TIMEOUT: Duration = Duration::from_millis(200);
/// Cap radius of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Time of the move to the start of an excitation \[s\].
const MOVE_TO_START_S: f64 = 1.0;
/// Time of the move to the start of the pose task, which is farther away \[s\].
const MOVE_TO_POSE_S: f64 = 4.0;

/// Runs a test case in wall-clock time.
///
/// # Errors
/// If the system cannot be started or does not reach its task.
pub fn perform<const N: usize>(
    spec: &Spec,
    args: &DrillArgs,
    arm: &TestArm,
) -> Result<Row, Failure> {
    let description = &match arm.rate_hz {
        Some(rate_hz) => arm.description.clone().at_rate(f64::from(rate_hz))?,
        None => arm.description.clone(),
    };
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix)).map_err(Failure::system)?;
    let trace = domain.folder().join(format!("{prefix}.csv"));
    let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
    let up = UpArgs {
        strict: arm.strict,
        track: match spec.task {
            TestTask::Probe => UpTrajectory::Probe,
            _ => UpTrajectory::Sinusoid,
        },
        // Tasks that move the arm down would hit the block.
        block_m: match spec.task {
            TestTask::Move | TestTask::Excite | TestTask::TrackPose => None,
            _ => Some(-(BLOCK_CLEARANCE_M + cap_m)),
        },
        trace: Some(trace.clone()),
        rate_hz: arm.rate_hz,
        prefix: Some(prefix),
        no_realtime: args.no_realtime,
        ..UpArgs::with_defaults(spec.plant, arm.name.clone())
    };
    let lose = || match spec.event {
        Event::Process { name: UP, .. } => lose_up_process::<N>(spec, &up, description, &domain),
        Event::Hindered(
            full @ (RequestObstruction::LogDiskFull | RequestObstruction::StandardErrorFull),
        ) => obstruct_up::<N>(spec, full, &up, description, &domain),
        _ => lose_process::<N>(spec, &up, description, &domain),
    };
    let mut lost = lose();
    for _ in 1..ATTEMPTS {
        if !matches!(lost, Err(Failure::DidNotReachTracking)) {
            break;
        }
        print_status("the system did not reach its task; retrying");
        lost = lose();
    }
    let row = lost.and_then(|(begin_ns, result)| {
        let after =
            TraceAfterLoss::read(&trace, begin_ns, observation_time(spec).as_nanos() as u64)?;
        Ok(Row::wall_clock(spec, &after, &result))
    });
    // The trace file belongs to this test case only.
    let _ = std::fs::remove_file(&trace);
    row
}

/// Whether the lost process is restarted: only if the arm was tracking.
fn should_recover(spec: &Spec) -> bool {
    spec.task == TestTask::Track && !matches!(spec.event, Event::Hindered(_))
}

fn observation_time(spec: &Spec) -> Duration {
    OBSERVED[usize::from(!should_recover(spec))]
}

fn mode_of(task: TestTask) -> Mode {
    match task {
        TestTask::GravityHold => Mode::GravityHold,
        TestTask::Move => Mode::Move,
        TestTask::Track | TestTask::TrackStiff => Mode::Track,
        TestTask::Probe => Mode::Probe,
        TestTask::Excite => Mode::Excite,
        TestTask::Float => Mode::Float,
        TestTask::JointImpedance => Mode::JointImpedance,
        TestTask::TrackPose => Mode::TrackPose,
        TestTask::Breakaway => Mode::Breakaway,
    }
}

fn has_been_in_mode(mode: Mode, telemetry: &Telemetry, for_s: f64) -> bool {
    telemetry.record().mode() == Some(mode)
        && telemetry.state.drives() == Drives::Active
        && telemetry.record().mode_time_s >= for_s
}

/// Brings the system from automatic tracking to the task of the test case.
fn start_task<const N: usize>(
    spec: &Spec,
    description: &Description,
    domain: &Domain,
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
) -> Result<(), Failure> {
    let first = match spec.task {
        TestTask::Probe => Mode::Probe,
        _ => Mode::Track,
    };
    let mode = mode_of(spec.task);
    let held_s = if first == mode { BEFORE_LOSS_S } else { 0.0 };
    let there = poll_until(&mut next, TIMEOUT, |t| has_been_in_mode(first, t, held_s))?;
    there.ok_or(Failure::DidNotReachTracking)?;
    if first == mode {
        return Ok(());
    }
    let config = description.config::<N>()?;
    let mut session = OperatorSession::<N>::new(domain)?;
    let request = task::request(spec, &config, description)?;
    let from = match &request {
        Request::Excite(series) => Some((series.at(0.0).position_rad, MOVE_TO_START_S)),
        Request::TrackPose { .. } => Some((task::pose_start_rad(&config)?, MOVE_TO_POSE_S)),
        _ => None,
    };
    if let Some((target_rad, duration_s)) = from {
        let back = Request::Move {
            target_rad,
            duration_s,
        };
        session.send_request(&back, None)?;
        poll_until(&mut next, TIMEOUT, |t| {
            has_been_in_mode(Mode::Move, t, duration_s + 0.2)
        })?
        .ok_or(Failure::DidNotReachTracking)?;
    }
    session.send_request(&request, None)?;
    poll_until(&mut next, TIMEOUT, |t| {
        has_been_in_mode(mode, t, BEFORE_LOSS_S)
    })?
    .ok_or(Failure::DidNotReachTracking)?;
    Ok(())
}

/// Causes the failure of a process that this program has started itself.
fn lose_process<const N: usize>(
    spec: &Spec,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, ProcessTestResult), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    system.start(description)?;
    start_task::<N>(spec, description, domain, || system.poll_and_advance())?;
    let begin_ns = monotonic_ns();
    let mut idle_after_ms = None;
    match spec.event {
        Event::Process { name, loss } => system.signal(name, signal(loss))?,
        Event::Hindered(RequestObstruction::RequestsWait) => {
            idle_after_ms = Some(idle_past_a_full_queue::<N>(domain, || {
                system.poll_telemetry()
            })?);
        }
        _ => {}
    }
    let mut last = None;
    let start = Instant::now();
    while start.elapsed() < observation_time(spec) {
        last = system.poll_telemetry()?.or(last);
    }
    let mode = mode_of(spec.task);
    let fault = |t: &Telemetry| {
        let record = t.record();
        (record.fault != 0).then(|| record.fault_text.to_string())
    };
    let mut result = ProcessTestResult {
        fault: last.as_ref().and_then(fault),
        kept_running: last
            .as_ref()
            .is_some_and(|t| has_been_in_mode(mode, t, BEFORE_LOSS_S)),
        recovery_expected: should_recover(spec),
        rejoined_after_s: None,
        idle_after_ms,
    };
    let back = Instant::now();
    if let Event::Process { name, loss } = spec.event {
        match loss {
            ProcessFailure::Stop => system.signal(name, Signal::CONT)?,
            _ => system.restart(name)?,
        }
    }
    if result.recovery_expected {
        let lost = matches!(spec.event, Event::Process { .. });
        let again = !lost || recover_after_restart(&mut system, spec.plant)?;
        result.rejoined_after_s = again.then(|| back.elapsed().as_secs_f64());
    }
    system.end()?;
    Ok((begin_ns, result))
}

fn signal(loss: ProcessFailure) -> Signal {
    match loss {
        ProcessFailure::Kill => Signal::KILL,
        ProcessFailure::Stop => Signal::STOP,
        ProcessFailure::Terminate => Signal::TERM,
        ProcessFailure::Interrupt => Signal::INT,
    }
}

/// Reads telemetry with `next` until `condition` holds; returns that telemetry, or `None` after a timeout.
fn poll_until(
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
    within: Duration,
    condition: impl Fn(&Telemetry) -> bool,
) -> Result<Option<Telemetry>, Failure> {
    let start = Instant::now();
    while start.elapsed() < within {
        if let Some(telemetry) = next()?
            && condition(&telemetry)
        {
            return Ok(Some(telemetry));
        }
    }
    Ok(None)
}

/// Performs the actions of an operator after a process restart: clears the pendant's faults, resets the controller, waits
/// in idle and restarts the task.
fn recover_after_restart<const N: usize>(
    system: &mut System<'_, N>,
    plant: PlantKind,
) -> Result<bool, Failure> {
    // Discard states that were queued before the restart.
    system.restart_start_up();
    let start = Instant::now();
    while start.elapsed() < TIMEOUT {
        if let Some(pendant) = system.pendant()
            && pendant.press("idle").is_err()
        {
            continue;
        }
        if comes_to_rest(system)? {
            break;
        }
    }
    if plant == PlantKind::Emu {
        // The arm may need a wake-up, which supple-can performs.
        let alive = |t: &Telemetry| t.state.position_present.count_ones() as usize == N;
        if poll_until(|| system.poll_telemetry(), TIMEOUT, alive)?.is_none() {
            return Ok(false);
        }
    }
    system.restart_start_up();
    Ok(poll_until(
        || system.poll_and_advance(),
        TIMEOUT,
        |t| has_been_in_mode(Mode::Track, t, 0.2),
    )?
    .is_some())
}

/// Resets the controller, requests idle and waits until controller and drives are idle without a fault.
fn comes_to_rest<const N: usize>(system: &mut System<'_, N>) -> Result<bool, Failure> {
    for request in [Request::Reset, Request::Idle] {
        match system.send_request(&request) {
            // There is no fault to reset, or the controller is not running yet.
            Ok(()) | Err(Failure::Refused { .. }) => {}
            Err(Failure::NotRunning { .. }) => return Ok(false),
            Err(failure) => return Err(failure),
        }
    }
    let comes_to_rest = |t: &Telemetry| {
        let record = t.record();
        record.mode() == Some(Mode::Idle) && record.fault == 0 && t.state.drives() == Drives::Idle
    };
    Ok(poll_until(|| system.poll_telemetry(), REST_TIMEOUT, comes_to_rest)?.is_some())
}

fn lose_up_process<const N: usize>(
    spec: &Spec,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, ProcessTestResult), Failure> {
    let mut reader = TelemetryReader::new(domain).map_err(Failure::system)?;
    let mut running = Up::start(up, None)?;
    start_task::<N>(spec, description, domain, || next_telemetry(&mut reader))?;
    let begin_ns = monotonic_ns();
    let stopped = matches!(
        spec.event,
        Event::Process {
            loss: ProcessFailure::Stop,
            ..
        }
    );
    if let Event::Process { loss, .. } = spec.event {
        running.signal(signal(loss));
    }
    let (mut last, start) = (None, Instant::now());
    while start.elapsed() < observation_time(spec) {
        last = next_telemetry(&mut reader)?.or(last);
    }
    let mode = mode_of(spec.task);
    let mut result = ProcessTestResult {
        kept_running: last
            .as_ref()
            .is_some_and(|t| has_been_in_mode(mode, t, BEFORE_LOSS_S)),
        recovery_expected: should_recover(spec),
        ..ProcessTestResult::default()
    };
    let back = Instant::now();
    match stopped {
        true => running.signal(Signal::CONT),
        false if result.recovery_expected => {
            // The restarted system must not overwrite the trace.
            let again = UpArgs {
                trace: None,
                ..up.clone()
            };
            drop(running);
            running = Up::start(&again, None)?;
        }
        false => {}
    }
    if result.recovery_expected {
        let again = poll_until(
            || next_telemetry(&mut reader),
            TIMEOUT,
            |t| has_been_in_mode(Mode::Track, t, 0.2),
        )?;
        result.rejoined_after_s = again.map(|_| back.elapsed().as_secs_f64());
    }
    running.end();
    Ok((begin_ns, result))
}

/// Waits briefly for the next telemetry.
fn next_telemetry(reader: &mut TelemetryReader) -> Result<Option<Telemetry>, Failure> {
    reader
        .wait(Duration::from_millis(20))
        .map_err(Failure::system)
}

/// Starts `supple up`, makes its output of this kind full, and requests idle.
fn obstruct_up<const N: usize>(
    spec: &Spec,
    full: RequestObstruction,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, ProcessTestResult), Failure> {
    let mut reader = TelemetryReader::new(domain).map_err(Failure::system)?;
    let output = FullOutput::new(full, domain)?;
    let running = output.start(up)?;
    start_task::<N>(spec, description, domain, || next_telemetry(&mut reader))?;
    output.fill(&running)?;
    let begin_ns = monotonic_ns();
    let mut idle_after_ms = idle_after::<N>(domain)?;
    // The system keeps running: its telemetry shows the idle mode.
    let idle = poll_until(
        || next_telemetry(&mut reader),
        OBSERVED[1],
        |t| t.record().mode() == Some(Mode::Idle),
    )?;
    if idle.is_none() {
        idle_after_ms = Err("no telemetry in idle mode".to_owned());
    }
    running.end();
    if !output.was_full() {
        idle_after_ms = Err("the output was not full".to_owned());
    }
    output.remove();
    let result = ProcessTestResult {
        idle_after_ms: Some(idle_after_ms),
        ..ProcessTestResult::default()
    };
    Ok((begin_ns, result))
}
