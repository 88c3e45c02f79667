//! The process: start-up, service, and again after the arm has lost its power.

use crate::bus_time::BusTime;
use crate::cycle::{Cycle, Rhythm};
use crate::error::CanError;
use crate::guard::{Loss, Stage};
use crate::link::{Counters, Drives};
use crate::options::Options;
use crate::shared_memory::SharedMemory;
use crate::start_up::{Progress, StartUp, start_up};
use clap::Parser;
use std::process::ExitCode;
use supple_bus::virtual_time::Lockstep;
use supple_bus::{Address, Bus, BusError, OwnerFolder, Paced, SocketCan, monotonic_ns};
use supple_ipc::{Domain, PlantLink, pause};
use supple_model::{Description, with_dof};
use supple_puck::safety::{SafetyLimits, SpeedLimit};
use supple_realtime::{Stop, diagnostics, die_with_parent, enter, spin_for};

/// How long an emulated arm may take to come \[ns\].
const PEER_NS: u64 = 5_000_000_000;
/// Silence of every motor puck after which the arm is looked for anew \[ns\].
const SILENCE_NS: u64 = 500_000_000;
/// How long the way to idle may take at the end \[ns\].
const LEAVE_NS: u64 = 250_000_000;
/// How often a lost arm is looked for.
const LOOK: core::time::Duration = core::time::Duration::from_millis(200);

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    match start(&options) {
        Ok(None) => ExitCode::SUCCESS,
        Ok(Some(counters)) => {
            diagnostics::post(format_args!(
                "supple-can: {} cycles, {} missed, {} unusable, {} skipped, {} frames lost, {} replies lost, {} overruns",
                counters.cycles,
                counters.missed,
                counters.unusable,
                counters.skipped,
                counters.tx_lost,
                counters.replies_lost,
                counters.overruns
            ));
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(CanError::Stopped) => ExitCode::SUCCESS,
        Err(error) => {
            diagnostics::post(format_args!("supple-can: error: {error}"));
            diagnostics::flush();
            ExitCode::from(error.code())
        }
    }
}

/// What was counted in service, if it came to service.
fn start(options: &Options) -> Result<Option<Counters>, CanError> {
    let stop = Stop::on_signals().map_err(|error| CanError::Link(Box::new(error)))?;
    if options.supervised() {
        die_with_parent();
    }
    let description = options.description()?;
    // Who supervises has said them.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        eprintln!("supple-can: warning: {warning}");
    }
    with_dof!(description.dof(), N => run::<N>(&description, options, &stop))?
}

fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Option<Counters>, CanError> {
    let config = description.config::<N>()?;
    let home_rad = description.home::<N>()?;
    let rhythm = Rhythm {
        period_ns: (config.period_s * 1e9).round() as u64,
        answer_ns: options.answer_us * 1_000,
    };
    if options.budget {
        let time = BusTime::new(N, 0, true, rhythm.answer_ns);
        println!("{}", time.budget(rhythm.period_ns));
        time.check(rhythm.period_ns)?;
        return Ok(None);
    }
    let mut wishes = StartUp {
        zero_at_rad: options.zero_at_home.then_some(home_rad),
        limits: SafetyLimits {
            speed_fault: SpeedLimit::from_m_per_s(options.speed_limit_m_per_s).ok(),
            ..SafetyLimits::default()
        },
        tare: options.tare,
    };
    let warning = wishes.limits.speed_warning.min(wishes.limits.speed_fault);
    wishes.limits.speed_warning = warning;
    let domain = Domain::new(options.prefix.as_deref())?;
    let link = PlantLink::new(&domain)?;
    let mut link = SharedMemory::new(link, options.virtual_time, stop.clone());
    let mut bus = open(options, domain.prefix(), stop)?;
    let mut counters = Counters::default();
    let mut first = true;
    loop {
        let asked = || stop.asked();
        let ready = start_up(&mut bus, description, &wishes, &asked, &mut tell);
        let ready = match ready {
            Ok(ready) => ready,
            // An arm that was there comes back: the others go on meanwhile.
            Err(
                CanError::Missing { .. }
                | CanError::BusFault(_)
                // What nobody acknowledges stays in the queue.
                | CanError::Bus(BusError::Full),
            ) if !first && !stop.asked() => {
                pause(LOOK);
                continue;
            }
            Err(error) => return Err(error),
        };
        if first {
            for shortfall in enter(&options.realtime()) {
                diagnostics::post(format_args!("supple-can: warning: {shortfall}"));
            }
            link.spin(spin_for(options.spin_us));
        }
        first = false;
        let mut cycle = Cycle::new(bus, link, ready, &config, rhythm)?;
        let ended = serve(&mut cycle, options, stop)?;
        counters = added(&counters, cycle.counters());
        (bus, link, _) = cycle.into_parts();
        if ended {
            return Ok(Some(counters));
        }
        diagnostics::post(format_args!(
            "supple-can: the arm has gone silent: looking for it"
        ));
    }
}

/// Cycles until it is asked to end (`true`), or the arm has no power any more.
fn serve<const N: usize, B: Bus>(
    cycle: &mut Cycle<N, B, SharedMemory>,
    options: &Options,
    stop: &Stop,
) -> Result<bool, CanError> {
    let mut heard_ns = cycle.bus().now_ns();
    let mut loss: Option<(Loss, u64)> = None;
    let mut stage = Stage::Resting;
    let enough = |cycles: u64| options.cycles.is_some_and(|most| cycles >= most);
    while !stop.asked() && !enough(cycle.counters().cycles) {
        cycle.run()?;
        let now_ns = cycle.bus().now_ns();
        if cycle.hears_motors() {
            heard_ns = now_ns;
        }
        if now_ns > heard_ns + SILENCE_NS {
            return Ok(false);
        }
        let guard = cycle.guard();
        // Said on the way out of service and into it, never in between.
        if guard.last_loss() != loss {
            loss = guard.last_loss();
            if let Some((loss, _)) = loss {
                diagnostics::post(format_args!("supple-can: lowered to idle: {loss}"));
            }
        }
        if guard.stage() != stage {
            stage = guard.stage();
            if stage == Stage::Active {
                diagnostics::post(format_args!("supple-can: active"));
            }
        }
    }
    cycle.leave();
    let until_ns = cycle.bus().now_ns() + LEAVE_NS;
    while cycle.drives() == Drives::Active && cycle.bus().now_ns() < until_ns {
        cycle.run()?;
    }
    Ok(true)
}

fn open(options: &Options, prefix: &str, stop: &Stop) -> Result<Box<dyn Bus>, CanError> {
    let address = match &options.bus {
        Some(address) => address.clone(),
        None => Address::of_system(prefix)?,
    };
    diagnostics::post(format_args!("supple-can: bus {address}"));
    match address {
        Address::Interface(name) => Ok(Box::new(SocketCan::open(&name)?)),
        Address::Folder(folder) => {
            let folder = OwnerFolder::open(folder)?;
            let until_ns = monotonic_ns() + PEER_NS;
            loop {
                let opened: Result<Box<dyn Bus>, BusError> = match options.virtual_time {
                    true => Lockstep::open(&folder).map(|bus| Box::new(bus) as _),
                    false => Paced::open(&folder).map(|bus| Box::new(bus) as _),
                };
                match opened {
                    Err(BusError::NoPeer { .. }) if monotonic_ns() < until_ns && !stop.asked() => {
                        pause(LOOK);
                    }
                    opened => return Ok(opened?),
                }
            }
        }
    }
}

fn tell(progress: Progress) {
    match progress {
        Progress::WaitingForIdle => {
            diagnostics::post(format_args!(
                "supple-can: release the emergency stop and press Shift-Idle at the pendant"
            ));
        }
        Progress::Enumerating => {
            diagnostics::post(format_args!("supple-can: looking for the nodes of the arm"))
        }
        Progress::Waking(pucks) => {
            diagnostics::post(format_args!("supple-can: waking {pucks} pucks"))
        }
        Progress::Checking => diagnostics::post(format_args!(
            "supple-can: comparing the pucks with the description"
        )),
        Progress::Zeroing => diagnostics::post(format_args!(
            "supple-can: taking the arm's pose for its home pose"
        )),
        Progress::Taring => {
            diagnostics::post(format_args!("supple-can: taring the force/torque sensor"))
        }
        Progress::Ready => diagnostics::post(format_args!(
            "supple-can: ready; with a controller that holds the arm, press Shift-Activate"
        )),
    }
}

fn added(a: &Counters, b: &Counters) -> Counters {
    Counters {
        cycles: a.cycles + b.cycles,
        missed: a.missed + b.missed,
        late_answers: a.late_answers + b.late_answers,
        skipped: a.skipped + b.skipped,
        tx_lost: a.tx_lost + b.tx_lost,
        unusable: a.unusable + b.unusable,
        replies_lost: a.replies_lost + b.replies_lost,
        overruns: a.overruns + b.overruns,
        ..*b
    }
}
