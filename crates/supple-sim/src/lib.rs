//! The simulated arm in the place of a real one: same messages, same clock, no bus.
//!
//! It owns the clock. By the wall clock each cycle begins at its time, whatever the controller does, and the
//! arm's time stands still while the machine holds up this process; an answer that does not come is met as
//! the arm's own side would ([`Motors`]). In virtual time each cycle waits for its answer, so that the same
//! controller gives the same bits, as fast as both can.
//!
//! It knows no controller: what it sends is what an arm reports, what it takes is torques.

mod error;
mod motors;
mod options;
mod world;

pub use error::SimError;
pub use motors::Motors;
pub use options::Options;
pub use world::{Summary, World};

use clap::Parser;
use std::process::ExitCode;
use supple_core::drive_guard::DriveGuard;
use supple_ipc::{Domain, PlantLink};
use supple_model::{Description, with_dof};
use supple_plant::{Plant, PlantConfig, Scene, TraceFile};
use supple_realtime::{Stop, diagnostics, die_with_parent, enter, spin_for};

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    let stop = match Stop::on_signals() {
        Ok(stop) => stop,
        Err(error) => return complain(&error.into()),
    };
    if options.supervised() {
        die_with_parent();
    }
    let description = match options.description() {
        Ok(description) => description,
        Err(error) => return complain(&error.into()),
    };
    // Who supervises has said them.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        eprintln!("supple-sim: warning: {warning}");
    }
    let ran = with_dof!(description.dof(), N => run::<N>(&description, &options, &stop));
    match ran.map_err(SimError::from).and_then(|ran| ran) {
        Ok(summary) => {
            diagnostics::post(format_args!("supple-sim: {summary}"));
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(error) => complain(&error),
    }
}

fn complain(error: &SimError) -> ExitCode {
    diagnostics::post(format_args!("supple-sim: error: {error}"));
    diagnostics::flush();
    ExitCode::from(error.code())
}

/// Runs until it is asked to end, or for as many cycles as the options say.
///
/// # Errors
/// [`SimError`]: an arm that is not sound, shared memory that cannot be used.
pub fn run<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Summary, SimError> {
    let mut config = PlantConfig::<N>::from_description(description)?;
    if let Some(face_m) = options.block_m {
        config.scene = Scene::beneath(face_m);
    }
    let home_rad = description.home::<N>()?;
    let motors = Motors::new(config.cycle_s, DriveGuard::new(&description.config()?));
    let plant = Plant::new(config, home_rad, supple_core::Vector::zeros())?;
    let domain = Domain::new(options.prefix.as_deref())?;
    let link = PlantLink::new(&domain)?;
    let mut world = World::new(plant, motors, link);
    world.inject(&options.inject)?;
    if let Some(file) = &options.trace {
        world.trace(TraceFile::create(file, N)?);
    }
    for shortfall in enter(&options.realtime()) {
        diagnostics::post(format_args!("supple-sim: warning: {shortfall}"));
    }
    world.spin(spin_for(options.spin_us));
    let ran = match options.virtual_time {
        true => world.run_in_virtual_time(options.cycles, stop),
        false => world.run_by_the_clock(options.cycles, options.answer_share, stop),
    };
    let summary = ran?;
    world.end_trace().map(|()| summary)
}
