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

use clap::Parser;
use std::process::ExitCode;
use supple_drive::SharedMemoryLink;
use supple_ipc::{Domain, PlantLink};
use supple_model::{Description, with_dof};
use supple_plant::{Plant, PlantConfig, PlantOptions, Scene, TraceFile};
use supple_realtime::{Stop, apply_realtime_settings, diagnostics, die_with_parent, spin_duration};

/// Runs the program: parses the arguments and returns the exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    let stop = match Stop::on_signals() {
        Ok(stop) => stop,
        Err(error) => return report_error(&error.into()),
    };
    if options.supervised() {
        die_with_parent();
    }
    let description = match options.description() {
        Ok(description) => description,
        Err(error) => return report_error(&error.into()),
    };
    // The supervising process has already printed the warnings.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        diagnostics::post(format_args!("supple-sim: warning: {warning}"));
    }
    let result = with_dof!(description.dof(), N => run::<N>(&description, &options, &stop));
    match result.map_err(SimError::from).flatten() {
        Ok(summary) => {
            diagnostics::post(format_args!("supple-sim: {summary}"));
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(error) => report_error(&error),
    }
}

fn report_error(error: &SimError) -> ExitCode {
    diagnostics::post(format_args!("supple-sim: error: {error}"));
    diagnostics::flush();
    ExitCode::from(error.code())
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
    let effects = PlantOptions::chosen(
        description,
        options.plant_options.as_deref(),
        options.realistic,
    )?;
    let mut config = effects.apply(PlantConfig::<N>::from_description(description)?)?;
    if let Some(face_m) = options.block_m {
        config.scene = Scene::with_block_at(face_m);
    }
    let home_rad = description.home::<N>()?;
    let plant = Plant::new(config, home_rad, supple_core::Vector::zeros())?;
    let domain = Domain::new(options.prefix.as_deref())?;
    let link = PlantLink::new(&domain)?;
    let mut link = SharedMemoryLink::new(link, options.virtual_time, stop.clone());
    let mut arm = SimulatedArm::new(plant, options.virtual_time, options.answer_share);
    arm.inject(&options.inject)?;
    if let Some(file) = &options.trace {
        arm.trace(TraceFile::create(file, N)?);
    }
    for realtime_warning in apply_realtime_settings(&options.realtime()) {
        diagnostics::post(format_args!("supple-sim: warning: {realtime_warning}"));
    }
    link.spin(spin_duration(options.spin_us));
    let mut simulation = simulation(arm, link, &description.config()?)?;
    let result = run_simulation(&mut simulation, options.cycles, options.virtual_time, stop);
    let summary = result?;
    simulation.drive_mut().end_trace()?;
    Ok(summary)
}
