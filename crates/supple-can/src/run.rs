//! A run with any type of drives: start-up, then cycles; repeated after the arm has lost its power.

use crate::cycles::{EndReason, SEARCH_INTERVAL, open, run_until_shutdown, sum_counters};
use crate::options::Options;
use supple_bus::{Address, Bus, BusError};
use supple_core::Config;
use supple_drive::{Counters, Drive, LoopError, PlantLoop, SharedMemoryLink, TorqueOffBehaviour};
use supple_ipc::{Domain, IpcError, PlantLink};
use supple_process::Program;
use supple_realtime::{Stop, diagnostics, pause, spin_duration};

/// What a run needs of a type of drives.
pub trait Startup<const N: usize> {
    /// The drives of an arm that is ready.
    type Drive: Drive<N>;
    /// What the start-up has found.
    type Ready;
    /// Why an arm cannot run.
    type Error: From<BusError> + From<IpcError> + From<LoopError>;

    /// Prepares the arm after it was powered up: the first time in the run, or again after a loss of power.
    ///
    /// # Errors
    /// What does not fit, with the remedy.
    fn prepare(
        &mut self,
        bus: &mut Box<dyn Bus>,
        first: bool,
        stop: &Stop,
    ) -> Result<Self::Ready, Self::Error>;

    /// Whether the arm may yet answer: if it has lost its power, the run tries again while the other processes continue.
    fn may_recover(error: &Self::Error) -> bool;

    /// The plant loop of the arm.
    ///
    /// # Errors
    /// A period that is too short for the bus.
    fn plant_loop(
        &self,
        bus: Box<dyn Bus>,
        link: SharedMemoryLink,
        ready: Self::Ready,
        first: bool,
    ) -> Result<PlantLoop<N, Self::Drive, SharedMemoryLink>, Self::Error>;

    /// Gives the bus back.
    fn into_bus(drive: Self::Drive) -> Box<dyn Bus>;
}

/// Runs an arm until a shutdown is requested or all cycles have run; returns its counters.
///
/// # Errors
/// Those of the start-up, the bus and the link to the controller.
pub fn run_arm<const N: usize, S: Startup<N>>(
    startup: &mut S,
    domain: &Domain,
    config: &Config<N>,
    options: &Options,
    stop: &Stop,
) -> Result<Counters, S::Error> {
    let virtual_time = options.process.virtual_time;
    let link = PlantLink::new(domain)?;
    let mut link = SharedMemoryLink::new(link, virtual_time, stop.clone());
    let address = match &options.bus {
        Some(address) => address.clone(),
        None => Address::of_system(domain.prefix())?,
    };
    let mut bus = open(address, virtual_time, stop)?;
    let mut counters = Counters::default();
    let mut first = true;
    loop {
        let ready = match startup.prepare(&mut bus, first, stop) {
            Err(error) if !first && S::may_recover(&error) && !stop.shutdown_requested() => {
                pause(SEARCH_INTERVAL);
                continue;
            }
            ready => ready?,
        };
        if first {
            options
                .process
                .apply_realtime(Options::NAME, options.priority);
            link.set_spin_duration(spin_duration(options.spin_us));
        }
        let mut plant = startup.plant_loop(bus, link, ready, first)?;
        let falls = plant.drive().torque_off_behaviour() == TorqueOffBehaviour::Falls;
        match (options.hold_until_supported, falls) {
            (true, true) => plant.hold_until_supported(),
            (true, false) => diagnostics::post(format_args!(
                "supple-can: warning: --hold-until-supported is ignored: the motors of this arm brake without torque"
            )),
            (false, _) => {}
        }
        first = false;
        let names = config.joint_names;
        let ended = run_until_shutdown(&mut plant, options.cycles, stop, names.as_slice())?;
        counters = sum_counters(&counters, plant.counters());
        let (drive, used_link) = plant.into_parts();
        (bus, link) = (S::into_bus(drive), used_link);
        if ended == EndReason::ShutDown {
            return Ok(counters);
        }
        diagnostics::post(format_args!(
            "supple-can: the arm does not reply any more: searching for it"
        ));
    }
}
