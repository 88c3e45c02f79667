//! A running system: its processes, telemetry and log.

use super::children::{ChildProcesses, Pidfile};
use super::outputs;
use super::plan::{Plan, SHUTDOWN_TIMEOUT};
use super::recorder::{Recorder, RunLog};
use super::start_up::{GRAVITY_HOLD_S, START_S, StartUp, cycles_of};
use super::statistics::{RunStatistics, UpSummary};
use super::status_line::StatusLine;
use crate::cli::UpArgs;
use crate::operate::{Approach, OperatorSession, Pendant, trajectory_for};
use core::time::Duration;
use rustix::process::Signal;
use std::path::Path;
use std::time::Instant;
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::Vector;
use supple_core::controller::{LearningSwitch, Request};
use supple_ipc::message::Telemetry;
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::{Stop, forget_support};

/// Timeout for a process to join the system \[s\].
const JOIN_TIMEOUT_S: u64 = 20;
/// Cycle in which learning begins in virtual time: the cycle after the request for gravity hold.
const LEARN_CYCLE: u64 = 1;
/// Interval at which a deleted pidfile is recreated.
const PIDFILE_CHECK_INTERVAL: Duration = Duration::from_millis(500);
/// Number of cycles after a refusal within which the telemetry shows its cause.
const REFUSAL_CYCLES: u32 = 200;
/// Maximum duration of one wait for telemetry.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A running system.
pub struct System<'a, const N: usize> {
    args: &'a UpArgs,
    plan: Plan,
    period_s: f64,
    /// Number of cycles after which the run ends.
    limit: Option<u64>,
    approach: Approach<N>,
    start_up: StartUp,
    run_log: RunLog<N>,
    reader: TelemetryReader,
    session: OperatorSession<N>,
    children: ChildProcesses,
    statistics: RunStatistics,
    line: StatusLine,
    /// Time of the first and of the last received cycle.
    seen: Option<(Instant, Instant)>,
}

impl<'a, const N: usize> System<'a, N> {
    /// Creates a system without starting its processes.
    ///
    /// # Errors
    /// If the arm description is invalid, or the log or shared memory cannot be created.
    pub fn new(
        args: &'a UpArgs,
        description: &Description,
        domain: &Domain,
    ) -> Result<Self, Failure> {
        let config = description.config::<N>()?;
        let period_s = config.period_s;
        let limit = args.for_s.map(|for_s| cycles_of(for_s, period_s));
        let (trajectory, duration_s) = trajectory_for(args.track, description);
        let plan = Plan::new(args, description, domain, limit)?;
        let options = args.plant_options.options(description)?;
        let recorder = args
            .log_file()
            .map(|file| Recorder::create(&file, description, &config, args.virtual_time, &options));
        Ok(System {
            start_up: StartUp::new(&plan, args, period_s),
            approach: Approach::new(&config, trajectory, duration_s)?,
            run_log: RunLog::new(recorder.transpose()?),
            // Create readers before writers, so that no message is missed.
            reader: TelemetryReader::for_log(domain).map_err(Failure::system)?,
            session: OperatorSession::for_system(domain)?,
            children: ChildProcesses::new(domain, args.virtual_time),
            statistics: RunStatistics::default(),
            line: StatusLine::new(args.json, plan.has_pendant(args.plant), period_s),
            seen: None,
            args,
            plan,
            period_s,
            limit,
        })
    }

    /// Redirects the standard error of the processes to a file.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn report_to(&mut self, file: &Path) -> Result<(), Failure> {
        let created = std::fs::File::create(file);
        let created = created.map_err(|error| Failure::file("create", file, error))?;
        self.children.report_to(created);
        Ok(())
    }

    /// Starts the processes. In virtual time all requests are queued before the first cycle, so that runs are
    /// identical.
    ///
    /// # Errors
    /// If a process cannot start or does not join.
    pub fn start(&mut self, description: &Description) -> Result<(), Failure> {
        self.launch()?;
        if self.args.virtual_time {
            let home = description.home::<N>()?;
            self.hold_first()?;
            let start = self.start_up.plan()?;
            if self.args.learn {
                let learn = Request::Learning(LearningSwitch::On);
                self.session.queue(&learn, LEARN_CYCLE)?;
            }
            self.queue_approach(&home, start)?;
        }
        self.children.start(&self.plan.clock_owner)
    }

    /// Queues the approach from this pose \[rad\] and the trajectory, each if the run lasts until its cycle: the controller refuses
    /// what is still queued when a run ends.
    fn queue_approach(&mut self, from_rad: &Vector<N>, start: u64) -> Result<(), Failure> {
        let (move_to_start, between, track) = self.approach.requests(from_rad);
        let requests = [
            (move_to_start, start, "approach"),
            (track, start + between, "trajectory"),
        ];
        for (request, cycle, name) in requests {
            match self.limit.filter(|limit| cycle >= *limit) {
                None => self.session.queue(&request, cycle)?,
                Some(limit) => {
                    let [limit_s, begin_s] = [limit, cycle].map(|n| n as f64 * self.period_s);
                    print_status(&format!(
                        "the run ends after {limit_s:.2} s, before the {name}, which would begin after {begin_s:.2} s: increase --for"
                    ));
                    break;
                }
            }
        }
        Ok(())
    }

    /// Starts the processes in virtual time as [`System::start`] does, with the caller's requests (cycles relative to the first
    /// cycle in which the approach may begin) and presses of the emulated pendant. Returns the reasons of requests that were refused before
    /// their cycle.
    ///
    /// # Errors
    /// The same as those of [`System::start`].
    pub fn start_scripted(
        &mut self,
        requests: &[(u64, Request<N>)],
        activate: bool,
        presses: &[String],
    ) -> Result<Vec<String>, Failure> {
        self.launch()?;
        self.hold_first()?;
        let start_s = START_S[usize::from(self.plan.pendant.is_some())];
        if let Some(pendant) = &self.plan.pendant {
            if activate {
                pendant.press(&format!("activate@held+{GRAVITY_HOLD_S}"))?;
            }
            for press in presses {
                pendant.press(press)?;
            }
        }
        let start = cycles_of(start_s, self.period_s);
        let mut refusals = Vec::new();
        for (cycle, request) in requests {
            match self.session.queue(request, start + cycle) {
                Err(Failure::Refused { reason }) => refusals.push(reason),
                queued => queued?,
            }
        }
        self.children.start(&self.plan.clock_owner)?;
        Ok(refusals)
    }

    /// Starts all processes except the clock owner.
    fn launch(&mut self) -> Result<(), Failure> {
        let children = &mut self.children;
        if let Some(arm) = &self.plan.arm {
            children.start(arm)?;
        }
        if let Some(pendant) = &self.plan.pendant {
            pendant.wait(Duration::from_secs(JOIN_TIMEOUT_S), &mut || {
                children.check()
            })?;
            pendant.press("idle")?;
        }
        children.start(&self.plan.controller)?;
        Ok(())
    }

    /// Requests gravity hold for the first cycle.
    fn hold_first(&mut self) -> Result<(), Failure> {
        let (children, hold) = (&mut self.children, Request::GravityHold);
        let mut check = || children.check();
        self.session
            .send_request_when_ready(&hold, Some(0), JOIN_TIMEOUT_S, &mut check)
    }

    /// Whether the clock owner has run all its cycles, in virtual time.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`] if it exited with an error.
    pub fn clock_has_ended(&mut self) -> Result<bool, Failure> {
        self.children
            .exited_successfully(self.plan.clock_owner.name)
    }

    /// Returns the reasons of the refusals since the last call.
    ///
    /// # Errors
    /// If shared memory cannot be accessed.
    pub fn refusals(&mut self) -> Result<Vec<String>, Failure> {
        let mut refusals = Vec::new();
        loop {
            match self.session.check() {
                Ok(_) => return Ok(refusals),
                Err(Failure::Refused { reason }) => refusals.push(reason),
                Err(failure) => return Err(failure),
            }
        }
    }

    /// Runs until the end of the run, a shutdown request or an error.
    ///
    /// # Errors
    /// If a process exits or a request is refused. An error of writing the log does not end the run; it is printed.
    pub fn run_until_end(&mut self, stop: &Stop, pidfile: &mut Pidfile) -> Result<(), Failure> {
        match self.poll_until_end(stop, pidfile) {
            // The same signal also ends the controller, which may exit first.
            Err(Failure::ProcessEnded { .. } | Failure::NotRunning { .. })
                if stop.shutdown_requested() =>
            {
                Ok(())
            }
            ended => ended,
        }
    }

    fn poll_until_end(&mut self, stop: &Stop, pidfile: &mut Pidfile) -> Result<(), Failure> {
        let (mut fault_seen, mut pidfile_checked) = (false, Instant::now());
        while !stop.shutdown_requested() {
            if pidfile_checked.elapsed() >= PIDFILE_CHECK_INTERVAL {
                pidfile_checked = Instant::now();
                pidfile.restore();
            }
            let polled = match self.poll_and_advance() {
                Err(Failure::Refused { reason }) if self.wait_whether_start_up_aborts()? => {
                    print_status(&format!("refused: {reason}"));
                    continue;
                }
                polled => polled?,
            };
            match polled {
                Some(telemetry) => fault_seen |= telemetry.record().fault != 0,
                None if self.args.virtual_time
                    && self
                        .children
                        .exited_successfully(self.plan.clock_owner.name)? =>
                {
                    return Ok(());
                }
                None => {}
            }
            match self.session.check() {
                // The request was refused because an operator has requested another mode: this is not an error.
                Err(Failure::Refused { reason })
                    if self.limit.is_none() || self.wait_whether_start_up_aborts()? =>
                {
                    print_status(&format!("refused: {reason}"));
                }
                checked => {
                    checked?;
                }
            }
            let over = |limit| !self.args.virtual_time && self.statistics.cycles() >= limit;
            if self.limit.is_some_and(over) || (fault_seen && self.limit.is_some()) {
                return Ok(());
            }
            self.children
                .check_running(self.args.virtual_time, self.plan.clock_owner.name)?;
        }
        Ok(())
    }

    /// Processes the next cycles; returns whether the start-up was aborted. A refusal may arrive before the telemetry that shows
    /// its cause.
    fn wait_whether_start_up_aborts(&mut self) -> Result<bool, Failure> {
        for _ in 0..REFUSAL_CYCLES {
            if self.start_up.is_ended() || self.start_up.is_done() {
                break;
            }
            self.poll_and_advance()?;
        }
        Ok(self.start_up.is_ended())
    }

    /// Waits briefly for the next cycle, processes it and sends the requests that are due.
    ///
    /// # Errors
    /// The same as those of [`System::run_until_end`].
    pub fn poll_and_advance(&mut self) -> Result<Option<Telemetry>, Failure> {
        let Some(telemetry) = self.reader.wait(POLL_INTERVAL).map_err(Failure::system)? else {
            return Ok(None);
        };
        self.add(&telemetry);
        self.line.show(&telemetry, &self.statistics);
        if !self.args.virtual_time {
            let session = &mut self.session;
            self.start_up.advance(&telemetry, session, &self.approach)?;
        }
        Ok(Some(telemetry))
    }

    /// Waits briefly for the next cycle and processes it, without sending requests.
    ///
    /// # Errors
    /// If shared memory cannot be accessed.
    pub fn poll_telemetry(&mut self) -> Result<Option<Telemetry>, Failure> {
        let telemetry = self.reader.wait(POLL_INTERVAL).map_err(Failure::system)?;
        if let Some(telemetry) = &telemetry {
            self.add(telemetry);
        }
        Ok(telemetry)
    }

    fn add(&mut self, telemetry: &Telemetry) {
        let now = Instant::now();
        self.seen = Some((self.seen.map_or(now, |(first, _)| first), now));
        self.statistics.add(telemetry);
        self.run_log.add(telemetry);
    }

    /// Terminates the processes in order, even after errors, and collects their last telemetry.
    ///
    /// # Errors
    /// The first error, if shared memory fails or a process cannot be waited for.
    pub fn end(&mut self) -> Result<(), Failure> {
        self.line.end();
        let (reader, run_log, statistics) =
            (&mut self.reader, &mut self.run_log, &mut self.statistics);
        let virtual_time = self.args.virtual_time;
        let mut drain = || -> Result<(), Failure> {
            while let Some(telemetry) = reader.receive().map_err(Failure::system)? {
                match virtual_time {
                    true => statistics.add(&telemetry),
                    false => statistics.note_fault(&telemetry),
                }
                run_log.add(&telemetry);
            }
            Ok(())
        };
        let children = &mut self.children;
        forget_support();
        if self.plan.holds_until_supported {
            // The clock owner must know of the shutdown before it misses the controller: it would lay the arm down.
            let _ = children.signal(self.plan.clock_owner.name, Signal::TERM);
            print_status("an arm that is held is released by `supple stop --supported`");
        }
        let controller = children.end(self.plan.controller.name, SHUTDOWN_TIMEOUT, &mut drain);
        let within = self.plan.clock_owner_timeout();
        let clock_owner = children.end(self.plan.clock_owner.name, within, &mut drain);
        let drained = drain();
        if let Some(pendant) = &self.plan.pendant {
            match pendant.record() {
                Ok(arm_events) => {
                    for arm_event in arm_events {
                        run_log.event(arm_event.time_ns, &arm_event.what);
                    }
                }
                // A plant that has crashed cannot report events; the log is complete without them.
                Err(failure) if self.seen.is_some() => {
                    print_status(&format!("the log contains no arm events: {failure}"));
                }
                // A plant that did not start reports no events either; its own error is more informative.
                Err(_) => {}
            }
        }
        let arm = match &self.plan.arm {
            Some(arm) => children.end(arm.name, SHUTDOWN_TIMEOUT, &mut || Ok(())),
            None => Ok(()),
        };
        controller.and(clock_owner).and(drained).and(arm)
    }

    /// Closes the log and returns the summary of the run. A run without a cycle leaves the part of its log and every older log; another one
    /// first keeps the default log of the run before, if it should.
    pub fn finish(&mut self, keeps_previous: bool) -> UpSummary {
        if self.statistics.cycles() == 0 {
            self.run_log.leave_part();
        } else {
            if keeps_previous {
                outputs::keep_previous_log();
            }
            self.run_log.finish();
        }
        let mut summary = self.statistics.summary(self.reader.lost());
        summary.times_real_time = self.times_real_time();
        summary
    }

    /// The error of an incomplete output file, if any.
    pub fn incomplete_output(&mut self) -> Option<Failure> {
        let cause = self.run_log.ended().map(Box::new);
        let log = cause.map(|cause| Failure::LogEnded { cause });
        let trace = || self.children.trace_ended();
        log.or_else(|| trace().map(|name| Failure::TraceEnded { name }))
    }

    /// Sends a signal to a process.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`].
    pub fn signal(&self, name: &'static str, signal: Signal) -> Result<(), Failure> {
        self.children.signal(name, signal)
    }

    /// Restarts a process that was killed. The others keep running.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`], [`Failure::MissingProgram`].
    pub fn restart(&mut self, name: &'static str) -> Result<(), Failure> {
        let programs = [
            Some(&self.plan.controller),
            Some(&self.plan.clock_owner),
            self.plan.arm.as_ref(),
        ];
        let program = programs.into_iter().flatten().find(|p| p.name == name);
        self.children
            .restart(program.ok_or(Failure::NoSuchProcess { name })?)
    }

    /// Restarts the start-up sequence.
    pub fn restart_start_up(&mut self) {
        self.start_up = StartUp::after_restart(&self.plan, self.args, self.period_s);
    }

    /// Sends a request to the controller.
    ///
    /// # Errors
    /// [`Failure::Refused`] with its reason, [`Failure::NotRunning`].
    pub fn send_request(&mut self, request: &Request<N>) -> Result<(), Failure> {
        self.session.send_request(request, None).map(|_| ())
    }

    /// The pendant of an emulated arm.
    pub fn pendant(&self) -> Option<&Pendant> {
        self.plan.pendant.as_ref()
    }

    /// Real-time factor, in virtual time.
    fn times_real_time(&self) -> Option<f64> {
        let (first, last) = self.seen.filter(|_| self.args.virtual_time)?;
        let wall_s = last.duration_since(first).as_secs_f64();
        (wall_s > 0.0).then(|| self.statistics.cycles() as f64 * self.period_s / wall_s)
    }
}
