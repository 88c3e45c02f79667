//! A run of the simulated arm in the plant loop that every arm has.

use crate::error::SimError;
use crate::simulated::SimulatedArm;
use core::fmt;
use supple_core::Config;
use supple_drive::{CycleConfig, Drives, Link, PlantLoop};
use supple_realtime::Stop;

/// Maximum time for the drives to become idle at shutdown \[ns\].
const SHUTDOWN_TIMEOUT_NS: u64 = 300_000_000;

/// Summary of a simulation run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Number of cycles.
    pub cycles: u64,
    /// Cycles with active drives whose answer did not arrive in time.
    pub missed: u64,
    /// Answers that arrived after their cycle.
    pub late: u64,
    /// Total time for which simulated time was paused because the host stalled \[ns\].
    pub clock_stall_ns: u64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} cycles, {} missed, {} late, clock paused for {:.1} ms",
            self.cycles,
            self.missed,
            self.late,
            self.clock_stall_ns as f64 * 1e-6
        )
    }
}

/// The plant loop of a simulated arm.
pub type Simulation<const N: usize, L> = PlantLoop<N, SimulatedArm<N>, L>;

/// A simulation before its first cycle, with the limits of `config`.
///
/// # Errors
/// [`SimError::Rate`] never: a simulated arm has no bus.
pub fn simulation<const N: usize, L: Link<N>>(
    arm: SimulatedArm<N>,
    link: L,
    config: &Config<N>,
) -> Result<Simulation<N, L>, SimError> {
    let cycle_config = CycleConfig {
        period_ns: arm.period_ns(),
        answer_ns: 0,
    };
    Ok(PlantLoop::new(arm, link, config, cycle_config, None)?)
}

/// Runs until shutdown is requested, or for a number of cycles. On a shutdown in real time it continues until the
/// drives are idle, so that the controller can complete its own shutdown.
///
/// # Errors
/// [`SimError::Loop`].
pub fn run<const N: usize, L: Link<N>>(
    simulation: &mut Simulation<N, L>,
    cycles: Option<u64>,
    virtual_time: bool,
    stop: &Stop,
) -> Result<Summary, SimError> {
    let mut rest_cycles = SHUTDOWN_TIMEOUT_NS / simulation.drive().period_ns();
    while cycles.is_none_or(|cycles| simulation.counters().cycles < cycles) {
        if stop.shutdown_requested() {
            let done = virtual_time || rest_cycles == 0;
            if done || simulation.drives() != Drives::Active {
                break;
            }
            simulation.begin_shutdown();
            rest_cycles -= 1;
        }
        simulation.run()?;
    }
    let counters = simulation.counters();
    Ok(Summary {
        cycles: counters.cycles,
        missed: counters.missed,
        late: counters.late_answers,
        clock_stall_ns: counters.clock_stall_ns,
    })
}
