//! Arguments of the commands that need no running system; `supple` and `supple-report` both accept them.

mod demo;
mod effects;
mod identification;
mod log;
mod plant;

pub use demo::DemoArgs;
pub use effects::EffectsArgs;
pub use identification::{
    BreakawayArgs, CalibrateArgs, Criterion, DesignArgs, ExciteCommand, IdentificationCommand,
    IdentifyArgs, LearnArgs, RunArgs, Solver,
};
pub use log::LogCommand;
pub use plant::{PlantArgs, PlantCommand};

use crate::exit::CODES;
use clap::Subcommand;

/// Command that needs no running system.
#[derive(Clone, Debug, Subcommand)]
pub enum OfflineCommand {
    /// Run the paper's experiments: figures, report, summary and one log per run.
    #[command(after_help = CODES)]
    Demo(DemoArgs),
    /// Measure which effects of a real arm ruin tracking at 5 N/m: each alone, all together, calibrated or not.
    #[command(after_help = CODES)]
    Effects(EffectsArgs),
    /// Identify an arm, and measure what the identification needs.
    #[command(flatten)]
    Identification(IdentificationCommand),
    /// Inspect, export, replay and recover logs.
    #[command(subcommand)]
    Log(LogCommand),
    /// List and show the options of the simulated arm.
    #[command(subcommand)]
    Plant(PlantCommand),
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
            OfflineCommand::Effects(args) => args.json,
            OfflineCommand::Identification(command) => command.json(),
            OfflineCommand::Log(command) => command.json(),
            OfflineCommand::Plant(command) => command.json(),
            OfflineCommand::Arms { json } => *json,
        }
    }
}
