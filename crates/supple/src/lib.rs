//! The supple command line: demo with figures and report, complete systems as processes, operator commands, log
//! tools.
//!
//! It is a library only so that tests can reach its parts; the program is `supple`.

#![forbid(unsafe_code)]

mod arms;
mod cli;
mod console;
mod demo;
mod doctor;
mod drill;
pub mod exit;
pub mod figures;
mod identification;
mod interrupt;
mod log;
mod operate;
mod out;
mod progress;
mod range;
pub mod report;
pub mod sections;
mod table;
mod units;
mod up;

use clap::{CommandFactory, Parser};
use cli::{Cli, Command};
use exit::Failure;
use std::process::ExitCode;

/// Runs the program: parses its arguments and returns its exit code.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    interrupt::install();
    let code = match dispatch(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            console::report_error(&failure, cli.command.json());
            ExitCode::from(&failure)
        }
    };
    console::flush();
    code
}

fn dispatch(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Demo(args) => demo::run(args),
        Command::Up(args) => up::run(args),
        Command::Drill(args) => drill::run(args),
        Command::Status(system) => operate::status(system),
        Command::Mode(args) => operate::mode(args),
        Command::Gains(args) => operate::gains(args),
        Command::Track(args) => operate::track(args),
        Command::Probe {
            arm,
            strict,
            system,
        } => operate::probe(arm, *strict, system),
        Command::Pendant { action, prefix } => operate::pendant(*action, prefix.as_deref()),
        Command::Reset(system) => operate::reset(system),
        Command::Stop(system) => operate::stop(system),
        Command::Log(command) => log::run(command),
        Command::Identification(command) => identification::run(command),
        Command::Arms { json } => arms::list(*json),
        Command::Doctor { json } => doctor::run(*json),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "supple", &mut script);
            console::print_line(String::from_utf8_lossy(&script).trim_end())
        }
    }
}
