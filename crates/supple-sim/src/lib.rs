//! The simulated arm as a process: same messages as a real one, no bus.
//!
//! It owns the clock, and runs the plant loop and the guard of every arm ([`supple_drive`]), so that the loss of the controller has
//! the same consequences as on a real arm. In real time each cycle starts at its scheduled time, whatever the controller does; when the host
//! stalls, simulated time pauses. In virtual time each cycle waits for its answer, so results are reproducible bit for
//! bit and the run is as fast as both processes allow.
//!
//! It does not depend on the controller: it sends what an arm reports, and receives torques.

mod error;
mod options;
mod simulated;
mod simulation;

pub use error::SimError;
pub use options::Options;
pub use simulated::SimulatedArm;
pub use simulation::{Simulation, Summary, run as run_simulation, simulation};

use std::process::ExitCode;
use supple_drive::SharedMemoryLink;
use supple_ipc::{Domain, PlantLink};
use supple_model::{Description, with_dof};
use supple_plant::{Plant, TraceFile};
use supple_process::{Failure, ProcessOptions, Program, RateOption};
use supple_realtime::{Stop, spin_duration};

/// Runs the program: parses the arguments and returns the exit code.
pub fn main() -> ExitCode {
    supple_process::main::<Options>()
}

impl Program for Options {
    const NAME: &'static str = "supple-sim";

    fn process(&self) -> &ProcessOptions {
        &self.process
    }

    fn rate(&self) -> RateOption {
        self.rate
    }

    fn run(&self, description: &Description, stop: &Stop) -> Result<Option<String>, Failure> {
        let summary = with_dof!(description.dof(), N => run::<N>(description, self, stop))?;
        Ok(Some(summary?.to_string()))
    }
}

/// Runs until shutdown is requested, or for the number of cycles in the options.
///
/// # Errors
/// [`SimError`]: an invalid arm, plant options or fault, a trace file that cannot be written, shared memory that cannot be used.
pub fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Summary, SimError> {
    let config = options.simulation.config::<N>(description)?;
    let home_rad = description.home::<N>()?;
    let plant = Plant::new(config, home_rad, supple_core::Vector::zeros())?;
    let domain = Domain::new(Some(&options.process.prefix))?;
    let link = PlantLink::new(&domain)?;
    let mut link = SharedMemoryLink::new(link, options.process.virtual_time, stop.clone());
    let mut arm = SimulatedArm::new(plant, options.process.virtual_time, options.answer_share);
    arm.inject(&options.simulation.inject)?;
    if let Some(file) = &options.simulation.trace {
        arm.trace(TraceFile::create(file, N)?);
    }
    options
        .process
        .apply_realtime(Options::NAME, options.priority);
    link.set_spin_duration(spin_duration(options.spin_us));
    let mut simulation = simulation(arm, link, &description.config()?)?;
    let result = run_simulation(
        &mut simulation,
        options.cycles,
        options.process.virtual_time,
        stop,
    );
    let summary = result?;
    simulation.drive_mut().end_trace()?;
    Ok(summary)
}
