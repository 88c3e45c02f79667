//! A run with Barrett's drives.

use super::bus_time::BusTime;
use super::drive::Barrett;
use super::error::CanError;
use super::plant_loop::{BarrettLoop, new_plant_loop};
use super::start_up::{Progress, Ready, StartupConfig, start_up};
use crate::options::{Options, print_budget};
use crate::run::{Startup, run_arm};
use supple_bus::{Bus, BusError};
use supple_core::{Config, Vector};
use supple_drive::{Counters, CycleConfig, SharedMemoryLink};
use supple_ipc::Domain;
use supple_model::{Description, with_dof};
use supple_puck::safety::{SafetyLimits, SpeedLimit};
use supple_realtime::{Stop, diagnostics};

/// Runs an arm until a shutdown is requested or all cycles have run and returns its counters; `None` if only the budget of the bus
/// was requested.
///
/// # Errors
/// [`CanError`], with the cause and the remedy.
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
    let speed_fault = SpeedLimit::from_m_per_s(options.speed_limit_m_per_s).ok();
    let defaults = SafetyLimits::default();
    let limits = SafetyLimits {
        speed_fault,
        speed_warning: defaults.speed_warning.min(speed_fault),
        ..defaults
    };
    let domain = Domain::new(Some(&options.process.prefix))?;
    // A process that was killed while it waited for the confirmation has left its request.
    domain.home_pose_confirmation().remove_request();
    let mut startup = Pucks {
        description,
        options,
        domain: &domain,
        config: &config,
        cycle_config,
        home_rad: description.home::<N>()?,
        limits,
    };
    run_arm(&mut startup, &domain, &config, options, stop).map(Some)
}

/// Start-up of the pucks.
struct Pucks<'a, const N: usize> {
    description: &'a Description,
    options: &'a Options,
    domain: &'a Domain,
    config: &'a Config<N>,
    cycle_config: CycleConfig,
    home_rad: Vector<N>,
    limits: SafetyLimits,
}

impl<const N: usize> Startup<N> for Pucks<'_, N> {
    type Drive = Barrett<N, Box<dyn Bus>>;
    type Ready = Ready<N>;
    type Error = CanError;

    fn prepare(
        &mut self,
        bus: &mut Box<dyn Bus>,
        first: bool,
        stop: &Stop,
    ) -> Result<Ready<N>, CanError> {
        // An arm falls while it has no power: only at the first start-up may it be in its home pose, and its sensor
        // unloaded, because an option says so.
        let startup_config = StartupConfig {
            zero_at_rad: (first && self.options.zero_at_home).then_some(self.home_rad),
            confirmation: (!first).then(|| self.domain.home_pose_confirmation()),
            limits: self.limits,
            tare: first && self.options.tare,
        };
        let stop_requested = || stop.shutdown_requested();
        start_up(
            bus,
            self.description,
            &startup_config,
            &stop_requested,
            &mut report_progress,
        )
    }

    fn may_recover(error: &CanError) -> bool {
        matches!(
            error,
            CanError::Missing { .. }
                // The emergency stop is pressed again.
                | CanError::Mode { .. }
                | CanError::BusFault(_)
                // Unacknowledged frames fill the transmit queue.
                | CanError::Bus(BusError::Full)
        )
    }

    fn plant_loop(
        &self,
        bus: Box<dyn Bus>,
        link: SharedMemoryLink,
        ready: Ready<N>,
        _: bool,
    ) -> Result<BarrettLoop<N, Box<dyn Bus>, SharedMemoryLink>, CanError> {
        new_plant_loop(bus, link, ready, self.config, self.cycle_config)
    }

    fn into_bus(drive: Self::Drive) -> Box<dyn Bus> {
        drive.into_bus()
    }
}

fn report_progress(progress: Progress) {
    match progress {
        Progress::WaitingForIdle => {
            diagnostics::post(format_args!(
                "supple-can: release the emergency stop and press Shift-Idle on the pendant"
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
            "supple-can: the arm has lost its position reference: move it to its home pose, then confirm that with `supple at-home`"
        )),
        Progress::Zeroing => diagnostics::post(format_args!(
            "supple-can: setting the position counters to the home pose; the arm does not move"
        )),
        Progress::Taring => {
            diagnostics::post(format_args!("supple-can: taring the force/torque sensor"))
        }
        Progress::Ready => diagnostics::post(format_args!(
            "supple-can: ready: start a controller in gravity hold, then press Shift-Activate"
        )),
    }
}
