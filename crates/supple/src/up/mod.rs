//! `supple up`: a whole system, from its processes to its log.
//!
//! Starts the controller and a plant, brings the arm to the start of the sinusoid and lets it follow, watches
//! over the processes, shows how it goes, records everything, and shuts down in order: first the controller,
//! which has the drives lowered to idle, then the plant.
//!
//! An arm on a bus is activated at its pendant, once the controller holds it: at an emulated one by this
//! program, at a real one by its operator.

mod children;
mod meter;
mod plan;
mod recorder;
mod stages;
mod status_line;
mod system;

pub use children::stop_running;
pub use meter::{Meter, Spread};
pub use plan::CONTROLLER;
pub use system::System;

use crate::arms;
use crate::cli::UpArgs;
use crate::console::{remark, say, say_json, wait_for_no_reader};
use crate::exit::Failure;
use crate::interrupt;
use children::Pidfile;
use supple_ipc::Domain;
use supple_model::{Description, with_dof};

/// Runs it.
///
/// # Errors
/// [`Failure`]; [`Failure::RunFault`] once everything is shut down and written.
pub fn run(args: &UpArgs) -> Result<(), Failure> {
    let description = args.at_rate(arms::find(&args.arm)?)?;
    with_dof!(description.dof(), N => sized::<N>(args, &description))?
}

fn sized<const N: usize>(args: &UpArgs, description: &Description) -> Result<(), Failure> {
    let domain = Domain::new(args.prefix.as_deref())?;
    wait_for_no_reader();
    let stop = interrupt::catch();
    let _pidfile = Pidfile::create(&domain)?;
    let mut system = System::<N>::new(args, description, &domain)?;
    let started = system.start(description);
    let ended = started.and_then(|()| system.watch(&stop));
    let shut_down = system.end();
    let (summary, log) = (system.finish()?, args.log_file());
    let ended = ended.and(shut_down);
    // A run that ended in a fault says so, whatever came of the fault.
    match &ended {
        Err(failure) if !summary.faults.is_empty() => remark(&format!("error: {failure}")),
        _ => ended?,
    }
    if args.json {
        say_json(&summary)?;
    } else {
        say(&summary.to_string())?;
        if let Some(log) = log {
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
