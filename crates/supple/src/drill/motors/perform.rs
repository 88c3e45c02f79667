//! Runs a test case.

use super::case::{Case, Event, Expected, Task};
use super::course::{ReportedCourse, Stage};
use super::evaluation::evaluate;
use super::metrics::Metrics;
use super::page::Row;
use crate::cli::{DrillArgs, PlantKind, UpArgs, UpTrajectory};
use crate::drill::metrics::ControllerSample;
use crate::drill::trace::{self, TraceRow};
use crate::drill::up_process::Up;
use crate::operate::{Approach, OperatorSession, trajectory_for};
use crate::up::{CONTROLLER, START_S, System};
use core::time::Duration;
use rustix::process::Signal;
use std::path::Path;
use std::time::Instant;
use supple_cli::exit::Failure;
use supple_core::codes::fault_name;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::{monotonic_ns, pause};

/// Time from the beginning of the task to the event \[s\], for each task.
const HELD_S: f64 = 0.5;
const MOVED_S: f64 = 1.0;
/// Time to the event in the sinusoid, which begins slowly \[s\].
const TRACKED_S: f64 = 1.5;
/// Move of the elbow \[rad\] and its duration \[s\].
const MOVE_RAD: f64 = -0.3;
const MOVE_S: f64 = 3.0;
/// Time from the event to the end of the run, if the system keeps running and if the arm is laid down \[s\].
const GOES_ON_S: f64 = 3.0;
const LAID_DOWN_S: f64 = 14.0;
/// Time without telemetry after which the run ends if the watchdogs of all motors have ended their torque; otherwise the run
/// ends after the longer time.
const SILENCE: Duration = Duration::from_secs(2);
const LONG_SILENCE: Duration = Duration::from_secs(30);
/// Timeout of a run in wall-clock time; the longest run takes a minute in an unoptimised build.
const TIMEOUT: Duration = Duration::from_secs(400);
/// Observation by the wall clock after the host is lost, and timeout for an arm that is laid down.
const OBSERVED: Duration = Duration::from_millis(400);
const LAY_DOWN_TIMEOUT: Duration = Duration::from_secs(40);
/// Process of the bus.
const HOST: &str = "supple-can";

/// Output of a run.
struct RunOutput {
    samples: Vec<ControllerSample>,
    /// Time of the event, unless the emulated arm reports it \[s\].
    event_s: Option<f64>,
}

/// Runs a test case.
///
/// # Errors
/// If the system cannot be started, or one of its processes fails.
pub fn perform<const N: usize>(
    case: &Case,
    args: &DrillArgs,
    description: &Description,
) -> Result<Row, Failure> {
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix)).map_err(Failure::system)?;
    let file = |kind: &str| domain.folder().join(format!("{prefix}.{kind}"));
    let (trace, reports) = (file("csv"), file("log"));
    let up = up_args(args, &prefix, &trace);
    let left = match case.runs_in_wall_clock_time() {
        true => run_in_wall_clock_time::<N>(case, &up, description, &domain, &reports),
        false => run_in_virtual_time::<N>(case, up, description, &domain, &reports),
    };
    let row = left.and_then(|left| {
        let course = ReportedCourse::read(&reports)?;
        let rows = trace::read(&trace)?;
        Ok(row::<N>(case, &left, &course, &rows))
    });
    // The files are removed, except the reports of a case that could not be run, which contain the reason.
    if let Err(failure) = &row {
        let reports = std::fs::read_to_string(&reports).unwrap_or_default();
        supple_cli::console::print_status(&format!("{case}: {failure}\n{}", reports.trim_end()));
    }
    for file in [&trace, &reports] {
        let _ = std::fs::remove_file(file);
    }
    row
}

fn row<const N: usize>(
    case: &Case,
    left: &RunOutput,
    course: &ReportedCourse,
    rows: &[TraceRow],
) -> Row {
    let begun = match case.event {
        // The loss of the host counts from its last command.
        Event::KillHost | Event::StopHost => {
            let mut commanded = course.watchdogs.iter();
            commanded
                .next()
                .map(|(time_s, _, since_ms)| time_s - 1e-3 * since_ms)
        }
        _ => course.misbehaves_s.first().copied(),
    };
    let event_s = begun.or(left.event_s).unwrap_or(f64::INFINITY);
    let loss = course.loss(event_s);
    let mut faults = left.samples.iter().filter(|sample| sample.fault != 0);
    let fault = faults.find(|sample| sample.time_ns as f64 * 1e-9 >= event_s);
    let disabled_s = course.stage_s(Stage::Disabled, event_s);
    let mut metrics = Metrics {
        named_after_ms: loss.map(|(time_s, _)| 1e3 * (time_s - event_s)),
        reason: loss.map(|(_, reason)| reason.to_owned()),
        fault: fault.and_then(|sample| fault_name(sample.fault)),
        fault_after_ms: fault.map(|sample| 1e3 * (sample.time_ns as f64 * 1e-9 - event_s)),
        disabled_after_s: disabled_s.map(|time_s| time_s - event_s),
        ..Metrics::default()
    };
    let ended = course
        .watchdogs
        .iter()
        .filter(|(time_s, ..)| *time_s >= event_s);
    for (_, _, since_ms) in ended {
        metrics.watchdogs += 1;
        let longest = metrics.torque_gone_ms.unwrap_or(0.0).max(*since_ms);
        metrics.torque_gone_ms = Some(longest);
    }
    let laid_s = course.stage_s(Stage::LayingDown, event_s);
    let until_s = disabled_s.unwrap_or(f64::INFINITY);
    let times_s = [event_s, laid_s.unwrap_or(until_s), until_s];
    metrics.motion(rows, case.without(), times_s);
    let (outcome, deviations) = evaluate(case, N, course, &metrics, event_s);
    Row::new(case, metrics, outcome, deviations)
}

fn up_args(args: &DrillArgs, prefix: &str, trace: &Path) -> UpArgs {
    UpArgs {
        strict: args.strict,
        trace: Some(trace.to_owned()),
        prefix: Some(prefix.to_owned()),
        no_realtime: args.no_realtime,
        ..UpArgs::with_defaults(PlantKind::Emu, args.urdf.name(&args.arm))
    }
}

/// Returns the move of the elbow.
fn moving<const N: usize>(description: &Description) -> Result<Request<N>, Failure> {
    let mut target_rad = description.home::<N>()?;
    target_rad[if N > 6 { 3 } else { 2.min(N - 1) }] += MOVE_RAD;
    Ok(Request::Move {
        target_rad,
        duration_s: MOVE_S,
    })
}

/// Returns the requests of a task with their times from the start, and the time of the event \[s\].
fn script<const N: usize>(
    task: Task,
    description: &Description,
) -> Result<(Vec<(f64, Request<N>)>, f64), Failure> {
    Ok(match task {
        Task::GravityHold => (Vec::new(), HELD_S),
        Task::Move => (vec![(0.0, moving(description)?)], MOVED_S),
        Task::Track => {
            let config = description.config::<N>()?;
            let (trajectory, duration_s) = trajectory_for(UpTrajectory::Sinusoid, description);
            let approach = Approach::new(&config, trajectory, duration_s)?;
            let (to_start, cycles, track) = approach.requests(&description.home::<N>()?);
            let begins_s = cycles as f64 * config.period_s;
            let requests = vec![(0.0, to_start), (begins_s, track)];
            (requests, begins_s + TRACKED_S)
        }
    })
}

fn run_in_virtual_time<const N: usize>(
    case: &Case,
    mut up: UpArgs,
    description: &Description,
    domain: &Domain,
    reports: &Path,
) -> Result<RunOutput, Failure> {
    let (mut requests, event_s) = script::<N>(case.task, description)?;
    if case.event == Event::Idle {
        requests.push((event_s, Request::Idle));
    }
    if let Event::Misbehaves { spec, .. } = &case.event {
        // The arm counts time from the enabling of its motors, a few cycles after the start.
        let at_s = START_S[0] + event_s;
        let with = if spec.contains(':') { ',' } else { ':' };
        up.misbehave.push(format!("{spec}{with}at-s={at_s:.4}"));
    }
    up.virtual_time = true;
    up.no_realtime = true;
    let after_s = match case.expected {
        Expected::KeepsRunning => GOES_ON_S,
        _ => LAID_DOWN_S,
    };
    up.for_s = Some(START_S[0] + event_s + after_s);
    let period_s = description.settings().period_s;
    let cycles = |time_s: f64| (time_s / period_s).round() as u64;
    let requests: Vec<(u64, Request<N>)> = requests
        .into_iter()
        .map(|(time_s, request)| (cycles(time_s), request))
        .collect();
    let event_cycle = cycles(START_S[0] + event_s);
    let mut system = System::<N>::new(&up, description, domain)?;
    system.report_to(reports)?;
    let refusals = system.start_scripted(&requests, false, &[])?;
    if let Some(reason) = refusals.into_iter().next() {
        return Err(Failure::Refused { reason });
    }
    let mut left = RunOutput {
        samples: Vec::new(),
        event_s: None,
    };
    let loses_arm = matches!(case.expected, Expected::TorqueEnds { .. });
    let (begin, mut last_telemetry, mut killed) = (Instant::now(), Instant::now(), false);
    loop {
        let telemetry = system.poll_telemetry()?;
        if let Some(telemetry) = &telemetry {
            last_telemetry = Instant::now();
            left.samples.push(ControllerSample::of(telemetry));
            let cycle = telemetry.state.cycle;
            if case.event == Event::KillController {
                // The last cycle of the controller whose telemetry arrived.
                left.event_s = Some(telemetry.state.stamp_ns as f64 * 1e-9);
                if cycle >= event_cycle && !killed {
                    killed = true;
                    system.signal(CONTROLLER, Signal::KILL)?;
                }
            } else if cycle >= event_cycle && left.event_s.is_none() {
                left.event_s = Some(telemetry.state.stamp_ns as f64 * 1e-9);
            }
        }
        let silence = last_telemetry.elapsed();
        if telemetry.is_none() && loses_arm && left.event_s.is_some() && silence > SILENCE {
            let without_torque = ReportedCourse::read(reports)?.watchdogs.len();
            if without_torque == N || silence > LONG_SILENCE {
                break;
            }
        }
        if telemetry.is_none() && system.clock_has_ended()? {
            break;
        }
        if begin.elapsed() > TIMEOUT {
            return Err(Failure::DidNotReachTracking);
        }
    }
    system.end()?;
    Ok(left)
}

fn run_in_wall_clock_time<const N: usize>(
    case: &Case,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
    reports: &Path,
) -> Result<RunOutput, Failure> {
    let mut left = RunOutput {
        samples: Vec::new(),
        event_s: None,
    };
    if case.event == Event::KillUp {
        let mut reader = TelemetryReader::new(domain).map_err(Failure::system)?;
        let file = std::fs::File::create(reports)
            .map_err(|error| Failure::file("create", reports, error))?;
        let running = Up::start(up, Some(file))?;
        start_task::<N>(case.task, description, domain, || {
            let telemetry = reader.wait(Duration::from_millis(20));
            telemetry.map_err(Failure::system)
        })?;
        left.event_s = Some(monotonic_ns() as f64 * 1e-9);
        // The process is killed and waited for.
        drop(running);
        let begin = Instant::now();
        while begin.elapsed() < LAY_DOWN_TIMEOUT
            && ReportedCourse::read(reports)?.disabled_s.is_empty()
        {
            pause(Duration::from_millis(50));
        }
        // The processes end without a signal of this program.
        pause(Duration::from_millis(500));
        return Ok(left);
    }
    let mut system = System::<N>::new(up, description, domain)?;
    system.report_to(reports)?;
    system.start(description)?;
    start_task::<N>(case.task, description, domain, || system.poll_and_advance())?;
    let signal = match case.event {
        Event::StopHost => Signal::STOP,
        _ => Signal::KILL,
    };
    system.signal(HOST, signal)?;
    let begin = Instant::now();
    while begin.elapsed() < OBSERVED {
        let telemetry = system.poll_telemetry()?;
        left.samples
            .extend(telemetry.as_ref().map(ControllerSample::of));
    }
    if signal == Signal::STOP {
        system.signal(HOST, Signal::CONT)?;
    }
    system.end()?;
    Ok(left)
}

/// Brings a system that begins with tracking to the task of the test case.
fn start_task<const N: usize>(
    task: Task,
    description: &Description,
    domain: &Domain,
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
) -> Result<(), Failure> {
    let mut until = |mode: Mode, held_s: f64| -> Result<(), Failure> {
        let begin = Instant::now();
        while begin.elapsed() < LAY_DOWN_TIMEOUT {
            if let Some(telemetry) = next()?
                && telemetry.record().mode() == Some(mode)
                && telemetry.state.drives() == Drives::Active
                && telemetry.record().mode_time_s >= held_s
            {
                return Ok(());
            }
        }
        Err(Failure::DidNotReachTracking)
    };
    let (request, mode, held_s) = match task {
        Task::Track => return until(Mode::Track, TRACKED_S),
        Task::GravityHold => (Request::GravityHold, Mode::GravityHold, HELD_S),
        Task::Move => (moving(description)?, Mode::Move, MOVED_S),
    };
    until(Mode::Track, 0.0)?;
    OperatorSession::<N>::new(domain)?.send_request(&request, None)?;
    until(mode, held_s)
}
