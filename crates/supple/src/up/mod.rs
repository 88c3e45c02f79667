//! `supple up`: a whole system, from its processes to its log.
//!
//! Starts the controller and a plant, brings the arm to the start of the sinusoid and lets it follow, watches
//! over the processes, shows how it goes, records everything, and shuts down in order: first the controller,
//! which has the drives lowered to idle, then the plant.

mod children;
mod meter;
mod recorder;
mod status_line;

pub use children::stop_running;
pub use meter::{Meter, Spread};

use crate::arms;
use crate::cli::{PlantKind, UpArgs};
use crate::console::{remark, say_json};
use crate::exit::Failure;
use crate::interrupt;
use crate::operate::{Approach, Session};
use children::{Children, Pidfile};
use core::time::Duration;
use recorder::Recorder;
use status_line::StatusLine;
use supple_core::controller::Request;
use supple_experiment::scenario;
use supple_ipc::message::{Drives, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::{Description, with_dof};

/// Longest wait for a process to take its place \[s\].
const JOIN_S: u64 = 20;
/// How long the shutdown waits for a process before it is killed.
const END_WITHIN: Duration = Duration::from_secs(5);
/// One wait for telemetry.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Gravity hold before the way to the start \[s\].
const SETTLE_S: f64 = 0.1;

/// Runs it.
///
/// # Errors
/// [`Failure`]; [`Failure::RunFault`] once everything is shut down and written.
pub fn run(args: &UpArgs) -> Result<(), Failure> {
    let description = arms::find(&args.arm)?;
    with_dof!(description.dof(), N => sized::<N>(args, &description))?
}

fn sized<const N: usize>(args: &UpArgs, description: &Description) -> Result<(), Failure> {
    let config = description.config::<N>()?;
    let domain = Domain::new(args.prefix.as_deref())?;
    let stop = interrupt::catch();
    let (trajectory, duration_s) = scenario::sinusoid(1.0);
    let approach = Approach::new(&config, trajectory, duration_s)?;
    let limit = args
        .for_s
        .map(|for_s| (for_s / config.period_s).round() as u64);

    let _pidfile = Pidfile::create(&domain)?;
    let log = args.log_file();
    let mut recorder = match &log {
        Some(file) => Some(Recorder::<N>::create(
            file,
            description,
            &config,
            args.virtual_time,
        )?),
        None => None,
    };
    // Readers first, so that nothing is missed.
    let mut reader = TelemetryReader::new(&domain)?;
    let mut session = Session::<N>::new(&domain)?;
    let mut children = Children::default();
    children.start("supple-rt", &args.controller_arguments(&domain))?;
    let mut meter = Meter::default();
    let mut line = StatusLine::new(args.json);

    if args.virtual_time {
        // All requests wait for their cycles before there is a first one: two runs hear them alike.
        let home = description.home::<N>()?;
        session.ask_when_there(&Request::GravityHold, Some(0), JOIN_S, &mut || {
            children.check()
        })?;
        let start = (SETTLE_S / config.period_s).round() as u64;
        session.follow(&approach, &home, Some(start))?;
        children.start(args.plant.process(), &args.plant_arguments(&domain, limit))?;
    } else {
        children.start(args.plant.process(), &args.plant_arguments(&domain, None))?;
    }

    let mut stage = match args.virtual_time {
        true => Stage::Following,
        false => Stage::Joining,
    };
    let mut fault_seen = false;
    let ended = loop {
        if stop.asked() {
            break Ok(());
        }
        match reader.wait(LOOK_EVERY) {
            Ok(Some(telemetry)) => {
                meter.add(&telemetry);
                if let Some(recorder) = &mut recorder {
                    recorder.add(&telemetry)?;
                }
                line.show(&telemetry, &meter);
                fault_seen |= telemetry.fault != 0;
                stage = match advance(stage, &telemetry, &mut session, &approach, config.period_s) {
                    Ok(stage) => stage,
                    Err(failure) => break Err(failure),
                };
            }
            Ok(None) => {
                if args.virtual_time && children.all_ended_well(args.plant.process())? {
                    break Ok(());
                }
            }
            Err(error) => break Err(error.into()),
        }
        match session.check() {
            // Somebody has other plans for the arm than this program had.
            Err(Failure::Refused { words }) if limit.is_none() => remark(&words),
            Err(failure) => break Err(failure),
            Ok(_) => {}
        }
        let over = limit.is_some_and(|limit| !args.virtual_time && meter.cycles() >= limit);
        if over || (fault_seen && limit.is_some()) {
            break Ok(());
        }
        if let Err(failure) = children.check_running(args.virtual_time, args.plant.process()) {
            break Err(failure);
        }
    };
    line.end();
    let mut drain = || -> Result<(), Failure> {
        while let Some(telemetry) = reader.receive()? {
            if args.virtual_time {
                meter.add(&telemetry);
            }
            if let Some(recorder) = &mut recorder {
                recorder.add(&telemetry)?;
            }
        }
        Ok(())
    };
    children.end("supple-rt", END_WITHIN, &mut drain)?;
    children.end(args.plant.process(), END_WITHIN, &mut drain)?;
    drain()?;
    if let Some(recorder) = recorder {
        recorder.finish()?;
    }
    ended?;
    report(args, &meter, reader.lost())
}

/// How far the way to the trajectory is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// No state yet.
    Joining,
    /// The arm is held, the drives are not active yet.
    Held,
    /// On the way, or there.
    Following,
}

fn advance<const N: usize>(
    stage: Stage,
    telemetry: &Telemetry,
    session: &mut Session<N>,
    approach: &Approach<N>,
    period_s: f64,
) -> Result<Stage, Failure> {
    let settle = (SETTLE_S / period_s).round() as u64;
    match stage {
        Stage::Joining => {
            session.ask(&Request::GravityHold, None)?;
            Ok(Stage::Held)
        }
        Stage::Held if telemetry.state.drives() == Drives::Active => {
            let position = core::array::from_fn(|i| telemetry.position_rad[i]);
            let start = telemetry.state.cycle + settle;
            session.follow(approach, &position.into(), Some(start))?;
            Ok(Stage::Following)
        }
        stage => Ok(stage),
    }
}

fn report(args: &UpArgs, meter: &Meter, lost: u64) -> Result<(), Failure> {
    let summary = meter.summary(lost);
    if args.json {
        say_json(&summary)?;
    } else {
        crate::console::say(&summary.to_string())?;
        if let Some(log) = args.log_file() {
            remark(&format!("log: {}", log.display()));
        }
    }
    match summary.faults.is_empty() {
        true => Ok(()),
        false => Err(Failure::RunFault {
            faults: summary.faults.join("; "),
        }),
    }
}

impl PlantKind {
    /// The program of the plant.
    pub fn process(self) -> &'static str {
        match self {
            PlantKind::Sim => "supple-sim",
        }
    }
}

impl UpArgs {
    /// Where the log goes, if anywhere.
    pub fn log_file(&self) -> Option<std::path::PathBuf> {
        (!self.no_log).then(|| self.log.clone())
    }

    fn common_arguments(&self, domain: &Domain) -> Vec<String> {
        let mut arguments = vec![
            "--arm".to_owned(),
            self.arm.clone(),
            "--prefix".to_owned(),
            domain.prefix().to_owned(),
            "--supervised".to_owned(),
        ];
        if self.virtual_time {
            arguments.push("--virtual-time".to_owned());
        }
        if self.no_realtime {
            arguments.push("--no-realtime".to_owned());
        }
        arguments
    }

    fn controller_arguments(&self, domain: &Domain) -> Vec<String> {
        self.common_arguments(domain)
    }

    fn plant_arguments(&self, domain: &Domain, cycles: Option<u64>) -> Vec<String> {
        let mut arguments = self.common_arguments(domain);
        if let Some(cycles) = cycles {
            arguments.extend(["--cycles".to_owned(), cycles.to_string()]);
        }
        arguments
    }
}
