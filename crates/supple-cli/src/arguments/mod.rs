//! Arguments of the commands that need no running system; `supple` and `supple-report` both accept them.

mod demo;
mod identification;
mod log;

pub use demo::DemoArgs;
pub use identification::{
    BreakawayArgs, CalibrateArgs, Criterion, DesignArgs, ExciteCommand, IdentificationCommand,
    IdentifyArgs, LearnArgs, RunArgs, Solver,
};
pub use log::LogCommand;

use crate::exit::CODES;
use clap::Subcommand;

/// Command that needs no running system.
#[derive(Clone, Debug, Subcommand)]
pub enum OfflineCommand {
    /// Run the paper's experiments: figures, report, summary and one log per run.
    #[command(after_help = CODES)]
    Demo(DemoArgs),
    /// Identify an arm, and measure what the identification needs.
    #[command(flatten)]
    Identification(IdentificationCommand),
    /// Inspect, export, replay and recover logs.
    #[command(subcommand)]
    Log(LogCommand),
    /// List the built-in arms.
    Arms {
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
}

impl OfflineCommand {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        match self {
            OfflineCommand::Demo(args) => args.json,
            OfflineCommand::Identification(command) => command.json(),
            OfflineCommand::Log(command) => command.json(),
            OfflineCommand::Arms { json } => *json,
        }
    }
}
