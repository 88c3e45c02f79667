//! The paper's experiments and identification, with figures and HTML reports.
//!
//! The program `supple-report` has every command that needs no running system; `supple` starts it for the commands
//! that draw figures. It links neither shared memory nor a bus. It is a library only so that tests can use its modules.

#![forbid(unsafe_code)]

mod demo;
mod effects;
pub mod figures;
mod identification;
mod new_arm;
mod plot;
mod progress;
pub mod report;
pub mod sections;
mod table;
mod units;

use clap::Parser;
use std::process::ExitCode;
use supple_cli::arguments::{LogCommand, OfflineCommand};
use supple_cli::exit::{CODES, Failure};
use supple_cli::{arms, console, interrupt, log};

/// Experiments, identification and logs of a backdrivable arm. The program `supple` has these commands too, and those
/// for running systems.
#[derive(Debug, Parser)]
#[command(version, after_help = CODES, arg_required_else_help = true)]
struct Cli {
    /// Command to run.
    #[command(subcommand)]
    command: OfflineCommand,
}

/// Runs the program: parses its arguments and returns its exit code.
pub fn run() -> ExitCode {
    let cli: Cli = supple_cli::parse::parse();
    interrupt::install();
    let result = dispatch(&cli.command);
    console::exit_code(result, cli.command.json())
}

fn dispatch(command: &OfflineCommand) -> Result<(), Failure> {
    match command {
        OfflineCommand::Demo(args) => demo::run(args),
        OfflineCommand::Effects(args) => effects::run(args),
        OfflineCommand::Identification(command) => identification::run(command),
        OfflineCommand::New(args) => new_arm::run(args),
        OfflineCommand::Log(LogCommand::Plot(args)) => plot::run(args),
        OfflineCommand::Log(LogCommand::Data(command)) => log::run(command),
        OfflineCommand::Arms(args) => arms::run(args),
        OfflineCommand::Plant(command) => command.run(),
    }
}
