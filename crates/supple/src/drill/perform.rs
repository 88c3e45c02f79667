//! One loss, from a system that tracks to one that tracks again.

use super::case::{Case, Loss, UP};
use super::row::{Row, Seen};
use super::trace::After;
use crate::cli::{Course, DrillArgs, PlantKind, UpArgs};
use crate::console::remark;
use crate::exit::Failure;
use crate::up::System;
use core::time::Duration;
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::monotonic_ns;

/// Height of the block's face beneath the trajectory, whose height is 0, less the cap \[m\].
const BENEATH_M: f64 = 0.05;
/// Tracking before the loss \[s\].
const TRACKED_S: f64 = 1.0;
/// What is watched after it.
const WATCHED: Duration = Duration::from_secs(2);
/// Longest way to tracking.
const WITHIN: Duration = Duration::from_secs(20);
/// How often a system that does not come to track is started before there is nothing to lose.
const ATTEMPTS: u32 = 3;
/// How long the controller and the drives may take to come to idle: a braked arm sinks.
const RESTED_WITHIN: Duration = Duration::from_millis(200);
/// Cap of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;

/// Performs a case.
///
/// # Errors
/// A system that cannot be started, or that does not come to track in the first place.
pub fn perform<const N: usize>(
    case: &Case,
    args: &DrillArgs,
    description: &Description,
) -> Result<Row, Failure> {
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix))?;
    let trace = domain.folder().join(format!("{prefix}.csv"));
    let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
    let up = UpArgs {
        plant: case.plant,
        arm: args.arm.clone(),
        strict: args.strict,
        track: Course::Sinusoid,
        bus: None,
        zero_at_home: false,
        tare: false,
        block_m: Some(-(BENEATH_M + cap_m)),
        trace: Some(trace.clone()),
        rate_hz: None,
        for_s: None,
        virtual_time: false,
        log: PathBuf::new(),
        no_log: true,
        prefix: Some(prefix),
        no_realtime: args.no_realtime,
        json: true,
    };
    let lose = || match case.process {
        UP => of_up(case, &up, &domain),
        _ => of_a_process::<N>(case, &up, description, &domain),
    };
    let mut lost = lose();
    for _ in 1..ATTEMPTS {
        if !matches!(lost, Err(Failure::NotTracking)) {
            break;
        }
        remark("the system did not come to track: once more");
        lost = lose();
    }
    let row = lost.and_then(|(begin_ns, seen)| {
        let after = After::read(&trace, begin_ns, WATCHED.as_nanos() as u64)?;
        Ok(Row::new(case, &after, &seen))
    });
    // It was this drill's alone; a next one writes its own.
    let _ = std::fs::remove_file(&trace);
    row
}

fn tracks(telemetry: &Telemetry, for_s: f64) -> bool {
    telemetry.mode() == Some(Mode::Track)
        && telemetry.state.drives() == Drives::Active
        && telemetry.mode_time_s >= for_s
}

/// A process that this program has started itself.
fn of_a_process<const N: usize>(
    case: &Case,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, Seen), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    system.start(description)?;
    until(|| system.turn(), WITHIN, |t| tracks(t, TRACKED_S))?.ok_or(Failure::NotTracking)?;
    let begin_ns = monotonic_ns();
    match case.loss {
        Loss::Nothing => {}
        Loss::Kill => system.signal(case.process, Signal::KILL)?,
        Loss::Stop => system.signal(case.process, Signal::STOP)?,
    }
    let mut last = None;
    let start = Instant::now();
    while start.elapsed() < WATCHED {
        last = system.turn()?.or(last);
    }
    let fault = |t: &Telemetry| (t.fault != 0).then(|| t.fault_text.to_string());
    let mut seen = Seen {
        fault: last.as_ref().and_then(fault),
        tracked_on: last.as_ref().is_some_and(|t| tracks(t, TRACKED_S)),
        rejoined_after_s: None,
    };
    let back = Instant::now();
    match case.loss {
        Loss::Nothing => {}
        Loss::Kill => system.restart(case.process)?,
        Loss::Stop => system.signal(case.process, Signal::CONT)?,
    }
    let again = case.loss == Loss::Nothing || rejoins(&mut system, case.plant)?;
    seen.rejoined_after_s = again.then(|| back.elapsed().as_secs_f64());
    system.end()?;
    Ok((begin_ns, seen))
}

/// Takes in what `next` gives until it is as it should be; the telemetry that was so.
fn until(
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
    within: Duration,
    is_so: impl Fn(&Telemetry) -> bool,
) -> Result<Option<Telemetry>, Failure> {
    let start = Instant::now();
    while start.elapsed() < within {
        if let Some(telemetry) = next()?
            && is_so(&telemetry)
        {
            return Ok(Some(telemetry));
        }
    }
    Ok(None)
}

/// What an operator does when a process is back: clears the pendant's faults, resets the controller, lets the
/// arm rest in idle, and goes to work again.
fn rejoins<const N: usize>(system: &mut System<'_, N>, plant: PlantKind) -> Result<bool, Failure> {
    // States that were queued before it came back say nothing of now.
    system.begin_again();
    let start = Instant::now();
    while start.elapsed() < WITHIN {
        if let Some(pendant) = system.pendant()
            && pendant.press("idle").is_err()
        {
            continue;
        }
        if rests(system)? {
            break;
        }
    }
    if plant == PlantKind::Emu {
        // The arm may have had to be woken: its bus is looked after by its own process.
        let alive = |t: &Telemetry| t.state.position_present.count_ones() as usize == N;
        if until(|| system.hear(), WITHIN, alive)?.is_none() {
            return Ok(false);
        }
    }
    system.begin_again();
    Ok(until(|| system.turn(), WITHIN, |t| tracks(t, 0.2))?.is_some())
}

/// The controller is idle and without a fault, and so are the drives.
fn rests<const N: usize>(system: &mut System<'_, N>) -> Result<bool, Failure> {
    for request in [Request::Reset, Request::Idle] {
        match system.ask(&request) {
            // Nothing to reset, or nobody there yet.
            Ok(()) | Err(Failure::Refused { .. }) => {}
            Err(Failure::NotRunning { .. }) => return Ok(false),
            Err(failure) => return Err(failure),
        }
    }
    let rests = |t: &Telemetry| {
        t.mode() == Some(Mode::Idle) && t.fault == 0 && t.state.drives() == Drives::Idle
    };
    Ok(until(|| system.hear(), RESTED_WITHIN, rests)?.is_some())
}

/// `supple up` itself, as a process of its own.
struct Up(Child);

impl Up {
    fn start(up: &UpArgs) -> Result<Up, Failure> {
        let this = std::env::current_exe()
            .map_err(|error| Failure::file("find", Path::new("this program"), error))?;
        let child = Command::new(&this)
            .args(up.words())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn();
        child
            .map(Up)
            .map_err(|error| Failure::file("start", &this, error))
    }

    fn signal(&self, signal: Signal) {
        if let Some(pid) = i32::try_from(self.0.id()).ok().and_then(Pid::from_raw) {
            // A process that has just ended needs no signal.
            let _ = kill_process(pid, signal);
        }
    }

    /// Ends it in order.
    fn end(mut self) {
        self.signal(Signal::CONT);
        self.signal(Signal::TERM);
        let _ = self.0.wait();
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        // The processes that it started end with it.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn of_up(case: &Case, up: &UpArgs, domain: &Domain) -> Result<(u64, Seen), Failure> {
    let mut reader = TelemetryReader::new(domain)?;
    let mut running = Up::start(up)?;
    until(|| hear(&mut reader), WITHIN, |t| tracks(t, TRACKED_S))?.ok_or(Failure::NotTracking)?;
    let begin_ns = monotonic_ns();
    running.signal(match case.loss {
        Loss::Stop => Signal::STOP,
        Loss::Kill | Loss::Nothing => Signal::KILL,
    });
    let (mut last, start) = (None, Instant::now());
    while start.elapsed() < WATCHED {
        last = hear(&mut reader)?.or(last);
    }
    let mut seen = Seen {
        fault: None,
        tracked_on: last.as_ref().is_some_and(|t| tracks(t, TRACKED_S)),
        rejoined_after_s: None,
    };
    let back = Instant::now();
    match case.loss {
        Loss::Stop => running.signal(Signal::CONT),
        Loss::Kill | Loss::Nothing => {
            // The trace of the next system is not that of this one.
            let again = UpArgs {
                trace: None,
                ..up.clone()
            };
            drop(running);
            running = Up::start(&again)?;
        }
    }
    let again = until(|| hear(&mut reader), WITHIN, |t| tracks(t, 0.2))?;
    seen.rejoined_after_s = again.map(|_| back.elapsed().as_secs_f64());
    running.end();
    Ok((begin_ns, seen))
}

/// The next telemetry, waited for a little.
fn hear(reader: &mut TelemetryReader) -> Result<Option<Telemetry>, Failure> {
    Ok(reader.wait(Duration::from_millis(20))?)
}
