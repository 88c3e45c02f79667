//! The process: start-up, then cycles; repeated after the arm has lost its power.

use crate::bus_time::BusTime;
use crate::cycle::{Cycle, CycleConfig};
use crate::error::CanError;
use crate::guard::{LossReason, Stage};
use crate::link::{Counters, Drives};
use crate::options::Options;
use crate::shared_memory::SharedMemoryLink;
use crate::start_up::{Progress, StartupConfig, start_up};
use clap::Parser;
use std::process::ExitCode;
use supple_bus::virtual_time::LockstepBus;
use supple_bus::{Address, Bus, BusError, OwnerFolder, PacedBus, SocketCan};
use supple_ipc::{Domain, PlantLink};
use supple_model::{Description, with_dof};
use supple_puck::safety::{SafetyLimits, SpeedLimit};
use supple_realtime::{
    Stop, apply_realtime_settings, diagnostics, die_with_parent, monotonic_ns, pause, spin_duration,
};

/// Timeout for an emulated arm to appear \[ns\].
const EMULATOR_TIMEOUT_NS: u64 = 5_000_000_000;
/// Time without a reply from any motor puck after which start-up is repeated \[ns\].
const ARM_LOST_AFTER_NS: u64 = 500_000_000;
/// Maximum time for switching to idle at shutdown \[ns\].
const SHUTDOWN_TIMEOUT_NS: u64 = 250_000_000;
/// Interval between attempts to reach a lost arm, or an emulator that has not started yet.
const SEARCH_INTERVAL: core::time::Duration = core::time::Duration::from_millis(200);

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    match start(&options) {
        Ok(None) => ExitCode::SUCCESS,
        Ok(Some(counters)) => {
            diagnostics::post(format_args!(
                "supple-can: {} cycles, {} answers missed, {} answers unusable, {} periods skipped, {} frames lost, \
                 {} replies lost, {} receive overruns",
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

/// Runs the process; returns the counters if start-up succeeded.
fn start(options: &Options) -> Result<Option<Counters>, CanError> {
    let stop = Stop::on_signals().map_err(|error| CanError::Link(Box::new(error)))?;
    if options.supervised() {
        die_with_parent();
    }
    let description = options.description()?;
    // The supervising process has already printed the warnings.
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
    let cycle_config = CycleConfig {
        period_ns: (config.period_s * 1e9).round() as u64,
        answer_ns: options.answer_us * 1_000,
    };
    if options.budget {
        let time = BusTime::new(N, 0, true, cycle_config.answer_ns);
        println!("{}", time.budget(cycle_config.period_ns));
        time.check(cycle_config.period_ns)?;
        return Ok(None);
    }
    let mut startup_config = StartupConfig {
        zero_at_rad: options.zero_at_home.then_some(home_rad),
        limits: SafetyLimits {
            speed_fault: SpeedLimit::from_m_per_s(options.speed_limit_m_per_s).ok(),
            ..SafetyLimits::default()
        },
        tare: options.tare,
    };
    let warning = startup_config
        .limits
        .speed_warning
        .min(startup_config.limits.speed_fault);
    startup_config.limits.speed_warning = warning;
    let domain = Domain::new(options.prefix.as_deref())?;
    let link = PlantLink::new(&domain)?;
    let mut link = SharedMemoryLink::new(link, options.virtual_time, stop.clone());
    let mut bus = open(options, domain.prefix(), stop)?;
    let mut counters = Counters::default();
    let mut first = true;
    loop {
        let stop_requested = || stop.shutdown_requested();
        let ready = start_up(
            &mut bus,
            description,
            &startup_config,
            &stop_requested,
            &mut report_progress,
        );
        let ready = match ready {
            Ok(ready) => ready,
            // After a power loss keep trying; the other processes continue meanwhile.
            Err(
                CanError::Missing { .. }
                | CanError::BusFault(_)
                // Unacknowledged frames fill the transmit queue.
                | CanError::Bus(BusError::Full),
            ) if !first && !stop.shutdown_requested() => {
                pause(SEARCH_INTERVAL);
                continue;
            }
            Err(error) => return Err(error),
        };
        if first {
            for realtime_warning in apply_realtime_settings(&options.realtime()) {
                diagnostics::post(format_args!("supple-can: warning: {realtime_warning}"));
            }
            link.spin(spin_duration(options.spin_us));
        }
        first = false;
        let mut cycle = Cycle::new(bus, link, ready, &config, cycle_config)?;
        let shut_down = serve(&mut cycle, options, stop)?;
        counters = sum_counters(&counters, cycle.counters());
        (bus, link, _) = cycle.into_parts();
        if shut_down {
            return Ok(Some(counters));
        }
        diagnostics::post(format_args!(
            "supple-can: the arm does not reply any more: searching for it"
        ));
    }
}

/// Runs cycles until a shutdown is requested (`true`) or the arm has lost its power.
fn serve<const N: usize, B: Bus>(
    cycle: &mut Cycle<N, B, SharedMemoryLink>,
    options: &Options,
    stop: &Stop,
) -> Result<bool, CanError> {
    let mut last_reply_ns = cycle.bus().now_ns();
    let mut loss: Option<(LossReason, u64)> = None;
    let mut stage = Stage::Resting;
    let all_cycles_done = |cycles: u64| options.cycles.is_some_and(|max| cycles >= max);
    while !stop.shutdown_requested() && !all_cycles_done(cycle.counters().cycles) {
        cycle.run()?;
        let now_ns = cycle.bus().now_ns();
        if cycle.motors_replied() {
            last_reply_ns = now_ns;
        }
        if now_ns > last_reply_ns + ARM_LOST_AFTER_NS {
            return Ok(false);
        }
        let guard = cycle.guard();
        // Posts a message only when the drives become active or idle, so not in a cycle of steady operation.
        if guard.last_loss() != loss {
            loss = guard.last_loss();
            if let Some((reason, _)) = loss {
                diagnostics::post(format_args!("supple-can: set to idle: {reason}"));
            }
        }
        if guard.stage() != stage {
            stage = guard.stage();
            if stage == Stage::Active {
                diagnostics::post(format_args!("supple-can: active"));
            }
        }
    }
    cycle.begin_shutdown();
    let until_ns = cycle.bus().now_ns() + SHUTDOWN_TIMEOUT_NS;
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
            let until_ns = monotonic_ns() + EMULATOR_TIMEOUT_NS;
            loop {
                let opened: Result<Box<dyn Bus>, BusError> = match options.virtual_time {
                    true => LockstepBus::open(&folder).map(|bus| Box::new(bus) as _),
                    false => PacedBus::open(&folder).map(|bus| Box::new(bus) as _),
                };
                match opened {
                    Err(BusError::NoPeer { .. })
                        if monotonic_ns() < until_ns && !stop.shutdown_requested() =>
                    {
                        pause(SEARCH_INTERVAL);
                    }
                    opened => return Ok(opened?),
                }
            }
        }
    }
}

fn report_progress(progress: Progress) {
    match progress {
        Progress::WaitingForIdle => {
            diagnostics::post(format_args!(
                "supple-can: release the emergency stop and press Shift-Idle at the pendant"
            ));
        }
        Progress::Enumerating => diagnostics::post(format_args!(
            "supple-can: searching for the nodes of the arm"
        )),
        Progress::Waking(pucks) => {
            diagnostics::post(format_args!("supple-can: waking {pucks} pucks"))
        }
        Progress::Checking => diagnostics::post(format_args!(
            "supple-can: comparing the pucks with the description"
        )),
        Progress::Zeroing => diagnostics::post(format_args!(
            "supple-can: setting the positions to the home pose"
        )),
        Progress::Taring => {
            diagnostics::post(format_args!("supple-can: taring the force/torque sensor"))
        }
        Progress::Ready => diagnostics::post(format_args!(
            "supple-can: ready; with a controller that holds the arm, press Shift-Activate"
        )),
    }
}

/// Adds the counts of two runs; timing and load are those of the later run `b`.
fn sum_counters(a: &Counters, b: &Counters) -> Counters {
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
