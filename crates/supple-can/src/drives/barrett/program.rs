//! A run with Barrett's drives: start-up, then cycles; repeated after the arm has lost its power.

use super::bus_time::BusTime;
use super::cycle::cycle;
use super::error::CanError;
use super::start_up::{Progress, StartupConfig, start_up};
use crate::cycles::{Ended, SEARCH_INTERVAL, open, run_until_shutdown, sum_counters};
use crate::options::{Options, print_budget};
use supple_bus::{Address, BusError};
use supple_drive::{Counters, CycleConfig, SharedMemoryLink};
use supple_ipc::{Domain, PlantLink};
use supple_model::{Description, with_dof};
use supple_process::Program;
use supple_puck::safety::{SafetyLimits, SpeedLimit};
use supple_realtime::{Stop, diagnostics, pause, spin_duration};

/// Runs an arm until a shutdown is requested or all cycles have run and returns its counters; `None` if only the budget of the bus
/// was requested.
///
/// # Errors
/// [`CanError`] with the mismatch and the remedy.
pub fn run(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Option<Counters>, CanError> {
    with_dof!(description.dof(), N => run_joints::<N>(description, options, stop))?
}

fn run_joints<const N: usize>(
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
        print_budget(&time.budget(cycle_config.period_ns));
        time.check(cycle_config.period_ns)?;
        return Ok(None);
    }
    let mut startup_config = StartupConfig {
        zero_at_rad: options.zero_at_home.then_some(home_rad),
        ask: None,
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
    let domain = Domain::new(Some(&options.process.prefix))?;
    // A process that was killed while it asked has left its question.
    domain.home_files().withdraw();
    let link = PlantLink::new(&domain)?;
    let mut link = SharedMemoryLink::new(link, options.process.virtual_time, stop.clone());
    let address = match &options.bus {
        Some(address) => address.clone(),
        None => Address::of_system(domain.prefix())?,
    };
    let mut bus = open(address, options.process.virtual_time, stop)?;
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
                // Once more the emergency stop.
                | CanError::Mode { .. }
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
            options
                .process
                .apply_realtime(Options::NAME, options.priority);
            link.spin(spin_duration(options.spin_us));
        }
        first = false;
        // An arm falls while it has no power: it is in its home pose, and its sensor unloaded, at the first start-up alone.
        startup_config = StartupConfig {
            zero_at_rad: None,
            ask: Some(domain.home_files()),
            tare: false,
            ..startup_config
        };
        let mut plant = cycle(bus, link, ready, &config, cycle_config)?;
        let names = config.joint_names;
        let ended = run_until_shutdown(&mut plant, options.cycles, stop, names.as_slice())?;
        counters = sum_counters(&counters, plant.counters());
        let (drive, used_link) = plant.into_parts();
        (bus, link) = (drive.into_bus(), used_link);
        if ended == Ended::ShutDown {
            return Ok(Some(counters));
        }
        diagnostics::post(format_args!(
            "supple-can: the arm does not reply any more: searching for it"
        ));
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
        Progress::WaitingForHome => diagnostics::post(format_args!(
            "supple-can: the arm has lost its positions: put it into its home pose, then confirm it with `supple at-home`"
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
