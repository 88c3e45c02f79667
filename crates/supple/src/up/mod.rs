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
pub use stages::{HELD_S, START_S};
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
    let description = args.at_rate(arms::find(&args.arm, args.strict)?)?;
    with_dof!(description.dof(), N => sized::<N>(args, &description))?
}

fn sized<const N: usize>(args: &UpArgs, description: &Description) -> Result<(), Failure> {
    // Before there is a process or a file.
    for output in args.log_file().iter().chain(&args.trace) {
        let checked = supple_files::check_output(output);
        checked.map_err(|error| Failure::file("write", output, error))?;
    }
    let domain = Domain::new(args.prefix.as_deref())?;
    wait_for_no_reader();
    let stop = interrupt::catch();
    let _pidfile = Pidfile::create(&domain)?;
    let mut system = System::<N>::new(args, description, &domain)?;
    let started = system.start(description);
    let ended = started.and_then(|()| system.watch(&stop));
    let shut_down = system.end();
    let mut summary = system.finish();
    let cut_short = system.cut_short();
    summary.cut_short = cut_short.as_ref().map(ToString::to_string);
    let fault = (!summary.faults.is_empty()).then(|| Failure::RunFault {
        faults: summary.faults.join("; "),
    });
    match (ended.and(shut_down), &fault) {
        (Ok(()), _) => {}
        // What was asked for was refused because of the fault.
        (Err(Failure::Refused { words }), Some(_)) => remark(&words),
        (Err(failure), fault) => {
            if let Some(fault) = fault {
                remark(&fault.to_string());
            }
            return Err(failure);
        }
    }
    if args.json {
        say_json(&summary)?;
    } else {
        say(&summary.to_string())?;
        if let (Some(log), None) = (args.log_file(), &cut_short) {
            remark(&format!("log: {}", log.display()));
        }
    }
    fault.or(cut_short).map_or(Ok(()), Err)
}
