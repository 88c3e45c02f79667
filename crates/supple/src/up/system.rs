//! A system that runs: its processes, its telemetry, its log.

use super::children::Children;
use super::meter::{Meter, UpSummary};
use super::plan::Plan;
use super::recorder::{Journal, Recorder};
use super::stages::{HELD_S, START_S, Stages, cycles_of};
use super::status_line::StatusLine;
use crate::cli::UpArgs;
use crate::console::remark;
use crate::exit::Failure;
use crate::operate::{Approach, Pendant, Session, course};
use core::time::Duration;
use rustix::process::Signal;
use std::time::Instant;
use supple_core::controller::Request;
use supple_ipc::message::Telemetry;
use supple_ipc::{Domain, TelemetryReader};
use supple_model::Description;
use supple_realtime::Stop;

/// Longest wait for a process to take its place \[s\].
const JOIN_S: u64 = 20;
/// How long the shutdown waits for a process before it is killed.
const END_WITHIN: Duration = Duration::from_secs(5);
/// One wait for telemetry.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// A system that runs.
pub struct System<'a, const N: usize> {
    args: &'a UpArgs,
    plan: Plan,
    period_s: f64,
    /// Cycles after which it ends.
    limit: Option<u64>,
    approach: Approach<N>,
    stages: Stages,
    journal: Journal<N>,
    reader: TelemetryReader,
    session: Session<N>,
    children: Children,
    meter: Meter,
    line: StatusLine,
    /// When the first cycle came, and the last.
    seen: Option<(Instant, Instant)>,
}

impl<'a, const N: usize> System<'a, N> {
    /// Everything but its processes.
    ///
    /// # Errors
    /// What the arm, the log or shared memory refuses.
    pub fn new(
        args: &'a UpArgs,
        description: &Description,
        domain: &Domain,
    ) -> Result<Self, Failure> {
        let config = description.config::<N>()?;
        let period_s = config.period_s;
        let limit = args.for_s.map(|for_s| cycles_of(for_s, period_s));
        let (trajectory, duration_s) = course(args.track, description);
        let plan = Plan::new(args, domain, limit)?;
        let recorder = args
            .log_file()
            .map(|file| Recorder::create(&file, description, &config, args.virtual_time));
        Ok(System {
            stages: Stages::new(plan.pendant.clone(), args.plant, period_s),
            approach: Approach::new(&config, trajectory, duration_s)?,
            journal: Journal::new(recorder.transpose()?),
            // Readers before writers, so that nothing is missed.
            reader: TelemetryReader::for_log(domain)?,
            session: Session::for_system(domain)?,
            children: Children::default(),
            meter: Meter::default(),
            line: StatusLine::new(args.json),
            seen: None,
            args,
            plan,
            period_s,
            limit,
        })
    }

    /// Starts the processes. In virtual time all requests wait for their cycles before there is a first one,
    /// so that two runs hear them alike.
    ///
    /// # Errors
    /// A process that cannot start or does not come.
    pub fn start(&mut self, description: &Description) -> Result<(), Failure> {
        self.launch()?;
        if self.args.virtual_time {
            let home = description.home::<N>()?;
            self.hold_first()?;
            let start = self.stages.plan()?;
            self.session.follow(&self.approach, &home, Some(start))?;
        }
        self.children.start(&self.plan.clock)
    }

    /// As [`System::start`] in virtual time, with requests of another's choice, each with its cycle from when the way
    /// to the start may begin, and presses of an emulated arm's pendant.
    ///
    /// # Errors
    /// As [`System::start`].
    pub fn start_scripted(
        &mut self,
        requests: &[(u64, Request<N>)],
        activate: bool,
        presses: &[String],
    ) -> Result<(), Failure> {
        self.launch()?;
        self.hold_first()?;
        let start_s = START_S[usize::from(self.plan.pendant.is_some())];
        if let Some(pendant) = &self.plan.pendant {
            if activate {
                pendant.press(&format!("activate@held+{HELD_S}"))?;
            }
            for press in presses {
                pendant.press(press)?;
            }
        }
        let start = cycles_of(start_s, self.period_s);
        for (cycle, request) in requests {
            self.session.queue(request, start + cycle)?;
        }
        self.children.start(&self.plan.clock)
    }

    /// Starts all but the process that owns the clock.
    fn launch(&mut self) -> Result<(), Failure> {
        let children = &mut self.children;
        if let Some(arm) = &self.plan.arm {
            children.start(arm)?;
        }
        if let Some(pendant) = &self.plan.pendant {
            pendant.wait(Duration::from_secs(JOIN_S), &mut || children.check())?;
            pendant.press("idle")?;
        }
        children.start(&self.plan.controller)?;
        Ok(())
    }

    /// Gravity hold in the first cycle.
    fn hold_first(&mut self) -> Result<(), Failure> {
        let (children, hold) = (&mut self.children, Request::GravityHold);
        let mut check = || children.check();
        self.session
            .ask_when_there(&hold, Some(0), JOIN_S, &mut check)
    }

    /// In virtual time: the process that owns the clock has run all its cycles.
    ///
    /// # Errors
    /// [`Failure::ProcessEnded`]: it ended otherwise.
    pub fn clock_has_ended(&mut self) -> Result<bool, Failure> {
        self.children.all_ended_well(self.plan.clock.name)
    }

    /// What was refused since this was last asked, in the controller's words.
    ///
    /// # Errors
    /// Shared memory.
    pub fn refusals(&mut self) -> Result<Vec<String>, Failure> {
        let mut refusals = Vec::new();
        loop {
            match self.session.check() {
                Ok(_) => return Ok(refusals),
                Err(Failure::Refused { words }) => refusals.push(words),
                Err(failure) => return Err(failure),
            }
        }
    }

    /// Until it is over, is asked to end, or something fails.
    ///
    /// # Errors
    /// A process that ended, a request that was refused. A log that cannot be written is said, and no error.
    pub fn watch(&mut self, stop: &Stop) -> Result<(), Failure> {
        match self.watch_on(stop) {
            // The controller is asked to end by the same word, and may be the first.
            Err(Failure::ProcessEnded { .. } | Failure::NotRunning { .. }) if stop.asked() => {
                Ok(())
            }
            ended => ended,
        }
    }

    fn watch_on(&mut self, stop: &Stop) -> Result<(), Failure> {
        let mut fault_seen = false;
        while !stop.asked() {
            match self.turn()? {
                Some(telemetry) => fault_seen |= telemetry.fault != 0,
                None if self.args.virtual_time
                    && self.children.all_ended_well(self.plan.clock.name)? =>
                {
                    return Ok(());
                }
                None => {}
            }
            match self.session.check() {
                // Somebody has other plans for the arm than this program had.
                Err(Failure::Refused { words }) if self.limit.is_none() => remark(&words),
                checked => {
                    checked?;
                }
            }
            let over = |limit| !self.args.virtual_time && self.meter.cycles() >= limit;
            if self.limit.is_some_and(over) || (fault_seen && self.limit.is_some()) {
                return Ok(());
            }
            self.children
                .check_running(self.args.virtual_time, self.plan.clock.name)?;
        }
        Ok(())
    }

    /// Waits a little for the next cycle, takes it in, and asks for what is due then.
    ///
    /// # Errors
    /// As [`System::watch`].
    pub fn turn(&mut self) -> Result<Option<Telemetry>, Failure> {
        let Some(telemetry) = self.reader.wait(LOOK_EVERY)? else {
            return Ok(None);
        };
        self.add(&telemetry);
        self.line.show(&telemetry, &self.meter);
        if !self.args.virtual_time {
            let session = &mut self.session;
            self.stages.advance(&telemetry, session, &self.approach)?;
        }
        Ok(Some(telemetry))
    }

    /// As [`System::turn`], asking for nothing.
    ///
    /// # Errors
    /// Shared memory.
    pub fn hear(&mut self) -> Result<Option<Telemetry>, Failure> {
        let telemetry = self.reader.wait(LOOK_EVERY)?;
        if let Some(telemetry) = &telemetry {
            self.add(telemetry);
        }
        Ok(telemetry)
    }

    fn add(&mut self, telemetry: &Telemetry) {
        let now = Instant::now();
        self.seen = Some((self.seen.map_or(now, |(first, _)| first), now));
        self.meter.add(telemetry);
        self.journal.add(telemetry);
    }

    /// Ends the processes in order, whatever fails on the way, and hears what they still say.
    ///
    /// # Errors
    /// The first that failed: shared memory, or a process that cannot be waited for.
    pub fn end(&mut self) -> Result<(), Failure> {
        self.line.end();
        let (reader, journal, meter) = (&mut self.reader, &mut self.journal, &mut self.meter);
        let virtual_time = self.args.virtual_time;
        let mut drain = || -> Result<(), Failure> {
            while let Some(telemetry) = reader.receive()? {
                match virtual_time {
                    true => meter.add(&telemetry),
                    false => meter.note_fault(&telemetry),
                }
                journal.add(&telemetry);
            }
            Ok(())
        };
        let children = &mut self.children;
        let controller = children.end(self.plan.controller.name, END_WITHIN, &mut drain);
        let clock = children.end(self.plan.clock.name, END_WITHIN, &mut drain);
        let heard = drain();
        if let Some(pendant) = &self.plan.pendant {
            match pendant.record() {
                Ok(happenings) => {
                    for happening in happenings {
                        journal.event(happening.time_ns, &happening.what);
                    }
                }
                // An arm that was lost tells no more; the log is whole without.
                Err(failure) => remark(&format!("no events of the arm in the log: {failure}")),
            }
        }
        let arm = match &self.plan.arm {
            Some(arm) => children.end(arm.name, END_WITHIN, &mut || Ok(())),
            None => Ok(()),
        };
        controller.and(clock).and(heard).and(arm)
    }

    /// Closes the log; what the run was in numbers.
    pub fn finish(&mut self) -> UpSummary {
        self.journal.finish();
        let mut summary = self.meter.summary(self.reader.lost());
        summary.times_real_time = self.times_real_time();
        summary
    }

    /// What was to be written and is not whole, once all is over.
    pub fn cut_short(&mut self) -> Option<Failure> {
        let cause = self.journal.ended().map(Box::new);
        let log = cause.map(|cause| Failure::LogEnded { cause });
        let trace = || self.children.trace_ended();
        log.or_else(|| trace().map(|name| Failure::TraceEnded { name }))
    }

    /// Sends a process a signal.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`].
    pub fn signal(&self, name: &'static str, signal: Signal) -> Result<(), Failure> {
        self.children.signal(name, signal)
    }

    /// Starts a process again that was killed. The others go on.
    ///
    /// # Errors
    /// [`Failure::NoSuchProcess`], [`Failure::NoSibling`].
    pub fn restart(&mut self, name: &'static str) -> Result<(), Failure> {
        let programs = [
            Some(&self.plan.controller),
            Some(&self.plan.clock),
            self.plan.arm.as_ref(),
        ];
        let program = programs.into_iter().flatten().find(|p| p.name == name);
        self.children
            .restart(program.ok_or(Failure::NoSuchProcess { name })?)
    }

    /// The way to tracking begins anew.
    pub fn begin_again(&mut self) {
        let pendant = self.plan.pendant.clone();
        self.stages = Stages::new(pendant, self.args.plant, self.period_s);
    }

    /// Asks the controller for something.
    ///
    /// # Errors
    /// [`Failure::Refused`] with its words, [`Failure::NotRunning`].
    pub fn ask(&mut self, request: &Request<N>) -> Result<(), Failure> {
        self.session.ask(request, None).map(|_| ())
    }

    /// The pendant of an emulated arm.
    pub fn pendant(&self) -> Option<&Pendant> {
        self.plan.pendant.as_ref()
    }

    /// How much faster than the wall the arm's time went.
    fn times_real_time(&self) -> Option<f64> {
        let (first, last) = self.seen.filter(|_| self.args.virtual_time)?;
        let wall_s = last.duration_since(first).as_secs_f64();
        (wall_s > 0.0).then(|| self.meter.cycles() as f64 * self.period_s / wall_s)
    }
}
