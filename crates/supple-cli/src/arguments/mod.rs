//! Arguments of the commands that need no running system; `supple` and `supple-report` both accept them.

mod demo;
mod effects;
mod identification;
mod log;
mod new;
mod plant;
mod ros;

pub use demo::DemoArgs;
pub use effects::EffectsArgs;
pub use identification::{
    BreakawayArgs, CalibrateArgs, CalibratePaperArgs, CalibrationPlant, Criterion, DesignArgs,
    EffectsArg, ExciteCommand, FrictionArg, IdentificationCommand, IdentifyArgs, LearnArgs,
    MovedArmArgs, RunArgs, Solver, TorqueDelay,
};
pub use log::{LogCommand, LogDataCommand, PlotArgs};
pub use new::NewArgs;
pub use plant::PlantCommand;
pub use ros::RosArgs;
pub use supple_model::UrdfArgs;
pub use supple_plant::PlantArgs;

use crate::exit::CODES;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use supple_model::DhConvention;

/// Command that needs no running system.
#[derive(Clone, Debug, Subcommand)]
pub enum OfflineCommand {
    /// Run the paper's experiments: figures, report, summary and one log per run.
    #[command(after_help = CODES)]
    Demo(DemoArgs),
    /// Measure how much each effect of a real arm degrades tracking at 5 N/m: each effect alone and all together, with and without
    /// calibration.
    #[command(after_help = CODES)]
    Effects(EffectsArgs),
    /// Identify an arm, and measure the quantities that an identification needs.
    #[command(flatten)]
    Identification(IdentificationCommand),
    /// Make an arm from a URDF: a commented TOML with every derived setting, a drawing, and a first run in simulation.
    #[command(after_help = CODES)]
    New(NewArgs),
    /// Inspect, export, replay and recover logs.
    #[command(subcommand)]
    Log(LogCommand),
    /// List and show the options of the simulated arm.
    #[command(subcommand)]
    Plant(PlantCommand),
    /// List the built-in arms, or copy one.
    Arms(ArmsArgs),
}

/// Arguments of `supple arms`.
#[derive(Clone, Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct ArmsArgs {
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
    /// Action instead of listing the arms.
    #[command(subcommand)]
    pub command: Option<ArmsCommand>,
}

/// Action on a built-in arm.
#[derive(Clone, Debug, Subcommand)]
pub enum ArmsCommand {
    /// Write the TOML and the URDF of an arm into a folder, as a start for another arm.
    Copy {
        /// A built-in arm, or the path of an arm's TOML or of its folder.
        arm: String,
        /// Folder of the copy; it is created if necessary.
        folder: PathBuf,
        /// Leave out the `held` entries, so that the law controls every joint, as the pose mode requires.
        #[arg(long)]
        all_joints_active: bool,
        /// Replace files of an existing arm.
        #[arg(long)]
        force: bool,
    },
    /// Write the URDF of an arm of which only a Denavit-Hartenberg table is known.
    ///
    /// The table is a CSV with a row for each revolute joint and the columns a_m, alpha_rad or alpha_deg, d_m, theta_rad or
    /// theta_deg (where the joint's angle is zero) and, if known, mass_kg. Links without a mass are balls of 1 kg.
    FromDh {
        /// The table.
        table: PathBuf,
        /// The URDF to write, with the links base, link1 .. and tool0.
        urdf: PathBuf,
        /// Convention of the table; with the wrong one the arm is another arm.
        #[arg(long, value_enum)]
        convention: DhConvention,
        /// Replace an existing file.
        #[arg(long)]
        force: bool,
    },
}

impl OfflineCommand {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        match self {
            OfflineCommand::Demo(args) => args.json,
            OfflineCommand::Effects(args) => args.json,
            OfflineCommand::Identification(command) => command.json(),
            OfflineCommand::New(args) => args.json,
            OfflineCommand::Log(command) => command.json(),
            OfflineCommand::Plant(command) => command.json(),
            OfflineCommand::Arms(args) => args.json,
        }
    }
}
