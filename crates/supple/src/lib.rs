//! The operator's command line: complete systems as processes, commands to running systems, fault tests, logs.
//!
//! For a command that draws figures, the process replaces itself with `supple-report` (exec), so that `supple` needs no
//! plotting library.

#![forbid(unsafe_code)]

mod cli;
mod doctor;
mod drill;
mod man;
mod motors;
mod operate;
mod procedure;
mod ros;
mod sweep;
mod up;
mod view;

use clap::CommandFactory;
use cli::{Cli, Command};
use std::os::unix::process::CommandExt;
use std::process::ExitCode;
use supple_cli::arguments::{ExciteCommand, IdentificationCommand, LogCommand, OfflineCommand};
use supple_cli::exit::Failure;
use supple_cli::sibling::{REPORT, program_beside};
use supple_cli::{arms, console, interrupt, log};

/// Runs the program: parses its arguments and returns its exit code.
pub fn run() -> ExitCode {
    let cli: Cli = supple_cli::parse::parse();
    interrupt::install();
    let result = dispatch(&cli.command);
    console::exit_code(result, cli.command.json())
}

fn dispatch(command: &Command) -> Result<(), Failure> {
    if let Command::Offline(OfflineCommand::Identification(command)) = command
        && let Some(result) = with_moved_arm(command)
    {
        return result;
    }
    match command {
        Command::Offline(
            OfflineCommand::Demo(_)
            | OfflineCommand::Effects(_)
            | OfflineCommand::New(_)
            | OfflineCommand::Log(LogCommand::Plot(_))
            | OfflineCommand::Identification(_),
        ) => Err(exec_report()),
        Command::View(args) => view::run(args),
        Command::Ros(args) => Err(ros::exec(args)),
        Command::Up(args) => up::run(args),
        Command::Drill(args) => drill::run(args),
        Command::Motors(args) => motors::run(args),
        Command::HoldCheck(args) => procedure::hold_check::run(args),
        Command::Sweep(_) => Err(sweep::exec()),
        Command::Status(system) => operate::status(system),
        Command::Mode(args) => operate::mode(args),
        Command::Gains(args) => operate::gains(args),
        Command::Learning(args) => operate::learning(&args.action),
        Command::Track(args) => operate::track(args),
        Command::Teach(args) => operate::teach(args),
        Command::Play(args) => operate::play(args),
        Command::Probe {
            arm,
            strict,
            urdf,
            system,
        } => operate::probe(arm.as_deref(), urdf, *strict, system),
        Command::Pendant { action, system } => operate::pendant(*action, system.prefix.as_deref()),
        Command::AtHome(args) => operate::at_home(args),
        Command::Reset(system) => operate::reset(system),
        Command::Stop(args) => operate::stop(args),
        Command::Offline(OfflineCommand::Log(LogCommand::Data(command))) => log::run(command),
        Command::Offline(OfflineCommand::Arms(args)) => arms::run(args),
        Command::Offline(OfflineCommand::Plant(command)) => command.run(),
        Command::Doctor { json } => doctor::run(*json),
        Command::Man { folder, json } => man::run(Cli::command(), folder, *json),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "supple", &mut script);
            console::print_line(String::from_utf8_lossy(&script).trim_end())
        }
    }
}

/// Runs an identification command with `--plant`; `None` without it.
fn with_moved_arm(command: &IdentificationCommand) -> Option<Result<(), Failure>> {
    Some(match command {
        IdentificationCommand::Calibrate(args) => procedure::calibrate::run(args, args.moved.on?),
        IdentificationCommand::Breakaway(args) => procedure::breakaway::run(args, args.moved.on?),
        IdentificationCommand::Excite(ExciteCommand::Run(args)) => {
            procedure::excite::run(args, args.moved.on?)
        }
        IdentificationCommand::Learn(args) => procedure::learn::run(args, args.moved.on?),
        _ => return None,
    })
}

/// Replaces this process with `supple-report`, with the same arguments. Returns only if that fails.
fn exec_report() -> Failure {
    let program = match program_beside(REPORT) {
        Ok(program) => program,
        Err(failure) => return failure,
    };
    let error = std::process::Command::new(&program)
        .args(std::env::args_os().skip(1))
        .exec();
    Failure::file("start", &program, error)
}
