//! The command line of supple: the demo with its figures and report, whole systems as processes, talking to
//! them, and what is done with logs.
//!
//! A library only so that its parts can be tested; the program is `supple`.

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

/// The whole program, from its arguments to its exit code.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    interrupt::install();
    let code = match dispatch(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            console::complain(&failure, cli.command.json());
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
        Command::Status(place) => operate::status(place),
        Command::Mode { mode, place } => operate::mode(*mode, place),
        Command::Gains(args) => operate::gains(args),
        Command::Track(args) => operate::track(args),
        Command::Probe { arm, strict, place } => operate::probe(arm, *strict, place),
        Command::Pendant { action, prefix } => operate::pendant(*action, prefix.as_deref()),
        Command::Reset(place) => operate::reset(place),
        Command::Stop(place) => operate::stop(place),
        Command::Log(command) => log::run(command),
        Command::Identification(command) => identification::run(command),
        Command::Arms { json } => arms::list(*json),
        Command::Doctor { json } => doctor::run(*json),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "supple", &mut script);
            console::say(String::from_utf8_lossy(&script).trim_end())
        }
    }
}
