//! `supple up`: runs a complete system.
//!
//! The command starts controller and plant, moves the arm to the start of the sinusoid, tracks it, supervises the processes,
//! shows progress and writes the log. It shuts down in order: first the controller, which sets the drives to idle, then the
//! plant.
//!
//! An arm on a bus is activated on its pendant after the controller has entered gravity hold: this program presses the
//! button of an emulated pendant; an operator presses the button of a real pendant.

mod children;
mod outputs;
mod plan;
mod recorder;
mod shared_processor;
mod start_up;
mod statistics;
mod status_line;
mod system;
mod viewer;

pub use children::{ChildProcesses, Pidfile, RunningSystem};
pub use plan::{CONTROLLER, Plan, SHUTDOWN_TIMEOUT};
pub use recorder::Recorder;
pub use start_up::{GRAVITY_HOLD_S, START_S};
pub use statistics::{Percentiles, RunStatistics};
pub use system::System;

use crate::cli::{PlantKind, UpArgs};
use std::os::unix::process::CommandExt;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line, print_status, write_stderr_in_background};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_cli::sibling::program_beside;
use supple_ipc::Domain;
use supple_model::{Description, with_dof};
use viewer::Viewer;

/// Runs `supple up`.
///
/// # Errors
/// [`Failure`]; [`Failure::RunFault`] after the system is shut down and all files are written.
pub fn run(args: &UpArgs) -> Result<(), Failure> {
    // The other processes receive the arm's name with its tip in a form that is valid in every folder.
    let args = &UpArgs {
        arm: arms::absolute(&args.urdf.name(&args.arm)),
        ..args.clone()
    };
    let description = args.at_rate(arms::find(&args.arm, args.strict)?)?;
    if args.budget {
        return show_budget(args);
    }
    with_dof!(description.dof(), N => sized::<N>(args, &description))?
}

/// Replaces this process with the program that owns the bus, which prints the bus time.
fn show_budget(args: &UpArgs) -> Result<(), Failure> {
    if args.plant == PlantKind::Sim {
        return print_line("A simulated arm has no bus: use --plant emu or --plant can.");
    }
    let program = program_beside(PlantKind::Can.clock_owner())?;
    let mut command = std::process::Command::new(&program);
    command.args(["--arm", &args.arm, "--budget"]);
    if let Some(rate_hz) = args.rate_hz {
        command.args(["--rate-hz".to_owned(), rate_hz.to_string()]);
    }
    Err(Failure::file("start", &program, command.exec()))
}

fn sized<const N: usize>(args: &UpArgs, description: &Description) -> Result<(), Failure> {
    outputs::check(args.log_file().as_deref(), args.trace.as_deref())?;
    let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
    write_stderr_in_background();
    let stop = interrupt::shutdown_on_interrupt();
    let mut pidfile = Pidfile::create(&domain, &args.arm, args.hold_until_supported)?;
    let mut system = System::<N>::new(args, description, &domain)?;
    let started = system.start(description);
    let viewer = match (&started, args.view) {
        (Ok(()), true) => Viewer::start(args, &domain).map(Some),
        _ => Ok(None),
    };
    if let Err(failure) = &viewer {
        print_status(&format!("the system runs without the live page: {failure}"));
    }
    let result = started.and_then(|()| system.run_until_end(&stop, &mut pidfile));
    drop(viewer);
    let shut_down = system.end();
    let mut summary = system.finish(args.log.is_none() && !args.no_log);
    let incomplete = system.incomplete_output();
    summary.incomplete_output = incomplete.as_ref().map(ToString::to_string);
    let fault = (!summary.faults.is_empty()).then(|| Failure::RunFault {
        faults: summary.faults.join("; "),
    });
    if args.stalls_matter() && summary.may_have_stalled() {
        print_status(&format!(
            "this machine stopped the plant for {:.1} ms in all and woke it up to {:.1} ms late, {} commands were missed: a fault of replies or \
             states that are missing may be its own; an emulated or simulated arm needs two free processors (`supple doctor`), or \
             --virtual-time",
            summary.clock_stall_ms,
            1e-3 * summary.wake_us.max,
            summary.missed
        ));
    }
    match (result.and(shut_down), &fault) {
        (Ok(()), _) => {}
        // The request was refused because of the fault; report the fault.
        (Err(Failure::Refused { reason }), Some(_)) => print_status(&format!("refused: {reason}")),
        (Err(failure), fault) => {
            if let Some(fault) = fault {
                print_status(&fault.to_string());
            }
            return Err(failure);
        }
    }
    if args.json {
        print_json(&summary)?;
    } else {
        print_line(summary.to_string().trim_end())?;
        if let (Some(log), None, true) = (args.log_file(), &incomplete, summary.cycles > 0) {
            print_status(&format!("log: {}", log.display()));
        }
    }
    fault.or(incomplete).map_or(Ok(()), Err)
}
