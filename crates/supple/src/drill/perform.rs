//! A row by the wall clock, from a system at work to one that works again.

use super::row::{Row, Seen};
use super::spec::{Event, Loss, Spec, UP, Work};
use super::trace::After;
use super::work;
use crate::cli::{Course, DrillArgs, PlantKind, UpArgs};
use crate::console::remark;
use crate::exit::Failure;
use crate::operate::Session;
use crate::up::System;
use core::time::Duration;
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;
use supple_core::config::Gains;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::monotonic_ns;

/// Height of the block's face beneath the trajectory, whose height is 0, less the cap \[m\].
const BENEATH_M: f64 = 0.05;
/// Work before the loss \[s\].
const WORKED_S: f64 = 0.5;
/// What is watched after it, where the process comes back, and where it does not.
const WATCHED: [Duration; 2] = [Duration::from_secs(2), Duration::from_millis(1200)];
/// Longest way to tracking.
const WITHIN: Duration = Duration::from_secs(20);
/// How often a system that does not come to work is started before there is nothing to lose.
const ATTEMPTS: u32 = 3;
/// How long the controller and the drives may take to come to idle: a braked arm sinks.
const RESTED_WITHIN: Duration = Duration::from_millis(200);
/// Cap of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Requests that wait for their cycle: as many as there is room for.
const WAITING: u64 = 16;
/// How far ahead those cycles are.
const FAR: u64 = 1_000_000_000;
/// Time of the move to the start of an excitation \[s\].
const BACK_S: f64 = 1.0;

/// Performs a row.
///
/// # Errors
/// A system that cannot be started, or that does not come to work in the first place.
pub fn perform<const N: usize>(
    spec: &Spec,
    args: &DrillArgs,
    description: &Description,
) -> Result<Row, Failure> {
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix))?;
    let trace = domain.folder().join(format!("{prefix}.csv"));
    let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
    let up = UpArgs {
        plant: spec.plant,
        arm: args.arm.clone(),
        strict: args.strict,
        track: match spec.work {
            Work::Probe => Course::Probe,
            _ => Course::Sinusoid,
        },
        bus: None,
        zero_at_home: false,
        tare: false,
        // What moves the arm downwards would meet it.
        block_m: match spec.work {
            Work::Move | Work::Excite => None,
            _ => Some(-(BENEATH_M + cap_m)),
        },
        inject: Vec::new(),
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
    let lose = || match spec.event {
        Event::Process { name: UP, .. } => of_up::<N>(spec, &up, description, &domain),
        _ => of_a_process::<N>(spec, &up, description, &domain),
    };
    let mut lost = lose();
    for _ in 1..ATTEMPTS {
        if !matches!(lost, Err(Failure::NotTracking)) {
            break;
        }
        remark("the system did not come to work: once more");
        lost = lose();
    }
    let row = lost.and_then(|(begin_ns, seen)| {
        let after = After::read(&trace, begin_ns, watched(spec).as_nanos() as u64)?;
        Ok(Row::wall(spec, &after, &seen))
    });
    // It was this drill's alone; a next one writes its own.
    let _ = std::fs::remove_file(&trace);
    row
}

/// A process that was lost while the arm tracked comes back.
fn rejoins_after(spec: &Spec) -> bool {
    spec.work == Work::Track && !matches!(spec.event, Event::Flood)
}

fn watched(spec: &Spec) -> Duration {
    WATCHED[usize::from(!rejoins_after(spec))]
}

fn mode_of(work: Work) -> Mode {
    match work {
        Work::GravityHold => Mode::GravityHold,
        Work::Move => Mode::Move,
        Work::Track => Mode::Track,
        Work::Probe => Mode::Probe,
        Work::Excite => Mode::Excite,
    }
}

fn is_in(mode: Mode, telemetry: &Telemetry, for_s: f64) -> bool {
    telemetry.mode() == Some(mode)
        && telemetry.state.drives() == Drives::Active
        && telemetry.mode_time_s >= for_s
}

/// From a system that comes to track by itself to one at the row's work.
fn go_to_work<const N: usize>(
    spec: &Spec,
    description: &Description,
    domain: &Domain,
    mut next: impl FnMut() -> Result<Option<Telemetry>, Failure>,
) -> Result<(), Failure> {
    let first = match spec.work {
        Work::Probe => Mode::Probe,
        _ => Mode::Track,
    };
    let mode = mode_of(spec.work);
    let worked_s = if first == mode { WORKED_S } else { 0.0 };
    let there = until(&mut next, WITHIN, |t| is_in(first, t, worked_s))?;
    there.ok_or(Failure::NotTracking)?;
    if first == mode {
        return Ok(());
    }
    let config = description.config::<N>()?;
    let mut session = Session::<N>::new(domain)?;
    let request = work::request(spec, &config, description)?;
    if let Request::Excite(series) = &request {
        let back = Request::Move {
            target_rad: series.at(0.0).position_rad,
            duration_s: BACK_S,
        };
        session.ask(&back, None)?;
        until(&mut next, WITHIN, |t| is_in(Mode::Move, t, BACK_S + 0.2))?
            .ok_or(Failure::NotTracking)?;
    }
    session.ask(&request, None)?;
    until(&mut next, WITHIN, |t| is_in(mode, t, WORKED_S))?.ok_or(Failure::NotTracking)?;
    Ok(())
}

/// A process that this program has started itself.
fn of_a_process<const N: usize>(
    spec: &Spec,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, Seen), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    system.start(description)?;
    go_to_work::<N>(spec, description, domain, || system.turn())?;
    let begin_ns = monotonic_ns();
    let mut idle_after_ms = None;
    match spec.event {
        Event::Process { name, loss } => system.signal(name, signal(loss))?,
        Event::Flood => idle_after_ms = Some(idle_past_a_full_queue::<N>(&mut system, domain)?),
        _ => {}
    }
    let mut last = None;
    let start = Instant::now();
    while start.elapsed() < watched(spec) {
        last = system.hear()?.or(last);
    }
    let mode = mode_of(spec.work);
    let fault = |t: &Telemetry| (t.fault != 0).then(|| t.fault_text.to_string());
    let mut seen = Seen {
        fault: last.as_ref().and_then(fault),
        worked_on: last.as_ref().is_some_and(|t| is_in(mode, t, WORKED_S)),
        to_rejoin: rejoins_after(spec),
        rejoined_after_s: None,
        idle_after_ms,
    };
    let back = Instant::now();
    if let Event::Process { name, loss } = spec.event {
        match loss {
            Loss::Kill => system.restart(name)?,
            Loss::Stop => system.signal(name, Signal::CONT)?,
        }
    }
    if seen.to_rejoin {
        let lost = matches!(spec.event, Event::Process { .. });
        let again = !lost || rejoins(&mut system, spec.plant)?;
        seen.rejoined_after_s = again.then(|| back.elapsed().as_secs_f64());
    }
    system.end()?;
    Ok((begin_ns, seen))
}

fn signal(loss: Loss) -> Signal {
    match loss {
        Loss::Kill => Signal::KILL,
        Loss::Stop => Signal::STOP,
    }
}

/// From the request to idle to its answer \[ms\], where all places of the queue are taken; or why it was refused.
fn idle_past_a_full_queue<const N: usize>(
    system: &mut System<'_, N>,
    domain: &Domain,
) -> Result<Result<f64, String>, Failure> {
    let cycle = until(|| system.hear(), WITHIN, |_| true)?.ok_or(Failure::NotTracking)?;
    let far = cycle.state.cycle + FAR;
    let mut others = Session::<N>::new(domain)?;
    let gains = Request::Gains {
        gains: Gains::isotropic(5.0, 1.5),
        ramp_s: 1.0,
    };
    for request in 0..WAITING {
        others.queue(&gains, far + request)?;
    }
    let begin = Instant::now();
    match Session::<N>::new(domain)?.ask(&Request::Idle, None) {
        Ok(_) => Ok(Ok(begin.elapsed().as_secs_f64() * 1e3)),
        Err(Failure::Refused { words }) => Ok(Err(words)),
        Err(failure) => Err(failure),
    }
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
    Ok(until(|| system.turn(), WITHIN, |t| is_in(Mode::Track, t, 0.2))?.is_some())
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

fn of_up<const N: usize>(
    spec: &Spec,
    up: &UpArgs,
    description: &Description,
    domain: &Domain,
) -> Result<(u64, Seen), Failure> {
    let mut reader = TelemetryReader::new(domain)?;
    let mut running = Up::start(up)?;
    go_to_work::<N>(spec, description, domain, || hear(&mut reader))?;
    let begin_ns = monotonic_ns();
    let stopped = matches!(
        spec.event,
        Event::Process {
            loss: Loss::Stop,
            ..
        }
    );
    running.signal(if stopped { Signal::STOP } else { Signal::KILL });
    let (mut last, start) = (None, Instant::now());
    while start.elapsed() < watched(spec) {
        last = hear(&mut reader)?.or(last);
    }
    let mode = mode_of(spec.work);
    let mut seen = Seen {
        worked_on: last.as_ref().is_some_and(|t| is_in(mode, t, WORKED_S)),
        to_rejoin: rejoins_after(spec),
        ..Seen::default()
    };
    let back = Instant::now();
    match stopped {
        true => running.signal(Signal::CONT),
        false if seen.to_rejoin => {
            // The trace of the next system is not that of this one.
            let again = UpArgs {
                trace: None,
                ..up.clone()
            };
            drop(running);
            running = Up::start(&again)?;
        }
        false => {}
    }
    if seen.to_rejoin {
        let again = until(|| hear(&mut reader), WITHIN, |t| is_in(Mode::Track, t, 0.2))?;
        seen.rejoined_after_s = again.map(|_| back.elapsed().as_secs_f64());
    }
    running.end();
    Ok((begin_ns, seen))
}

/// The next telemetry, waited for a little.
fn hear(reader: &mut TelemetryReader) -> Result<Option<Telemetry>, Failure> {
    Ok(reader.wait(Duration::from_millis(20))?)
}
