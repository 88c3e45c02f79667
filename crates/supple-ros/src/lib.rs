//! Bridge of a running system to ROS 2 over Zenoh, in the form of rmw_zenoh: joint states, transforms, wrenches, the arm's
//! description and the controller's state out; on request, joint trajectories in, checked as any request.
//!
//! It is a process of its own beside the control path: it polls telemetry, and nothing waits for it.

#![forbid(unsafe_code)]

mod attachment;
mod bridge;
mod error;
mod names;
mod session;
mod trajectory;
mod type_hash;

pub use error::RosError;

use bridge::Bridge;
use clap::Parser;
use std::process::ExitCode;
use supple_cli::arguments::RosArgs;
use supple_cli::arms::{self, DEFAULT_ARM};
use supple_cli::console::{self, print_json, print_status};
use supple_cli::exit::{CODES, Failure};
use supple_cli::interrupt;
use supple_ipc::Domain;
use supple_model::with_dof;

/// Priority of the process: below all others.
const NICENESS: i32 = 10;

/// Bridge of a running system to ROS 2 over Zenoh; `supple ros` starts it with the arm of the system.
#[derive(Debug, Parser)]
#[command(name = "supple-ros", version, after_help = CODES)]
struct Cli {
    #[command(flatten)]
    args: RosArgs,
}

/// Runs the program: parses its arguments and returns its exit code.
pub fn run() -> ExitCode {
    let cli: Cli = supple_cli::parse::parse();
    console::exit_code(bridge(&cli.args), cli.args.json)
}

fn bridge(args: &RosArgs) -> Result<(), Failure> {
    let stop = interrupt::shutdown_on_interrupt();
    // If this fails, the process keeps its priority.
    let _ = rustix::process::nice(NICENESS);
    let domain = Domain::new(args.prefix.as_deref()).map_err(Failure::system)?;
    let arm = args.urdf.name(args.arm.as_deref().unwrap_or(DEFAULT_ARM));
    let description = arms::find(&arm, args.strict)?;
    let started = || -> Result<(), Failure> {
        let topics = if args.accept_trajectories {
            "commands"
        } else {
            "data"
        };
        if args.json {
            return print_json(
                &serde_json::json!({"domain_id": args.domain_id, "accepts_trajectories": args.accept_trajectories}),
            );
        }
        print_status(&format!(
            "ROS 2 node `supple` of domain {}: {topics}; Ctrl-C ends it",
            args.domain_id
        ));
        if args.accept_trajectories {
            print_status("everybody who reaches the Zenoh network can now move the arm");
        }
        Ok(())
    };
    let tell = |text: &str| print_status(text);
    with_dof!(description.dof(), N => {
        let mut bridge = Bridge::<N>::new(&domain, &description, args).map_err(failure)?;
        started()?;
        bridge.run(&stop, &tell).map_err(failure)
    })
    .map_err(Failure::from)?
}

fn failure(error: RosError) -> Failure {
    match error {
        RosError::Model(error) => error.into(),
        RosError::Log(error) => error.into(),
        error => Failure::system(error),
    }
}
