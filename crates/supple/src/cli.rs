//! The command line: what can be asked for.

use crate::exit::CODES;
use crate::identification;
use clap::{Parser, Subcommand};
use clap_complete::Shell;
use std::num::NonZeroU64;
use std::path::PathBuf;

/// Minimum-impedance control of a backdrivable arm, in simulation.
#[derive(Debug, Parser)]
#[command(version, after_help = CODES, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Clone, Debug, Subcommand)]
pub enum Command {
    /// Run the paper's experiments: figures, report, summary and one log a run.
    #[command(after_help = CODES)]
    Demo(DemoArgs),
    /// Look into logs.
    #[command(subcommand)]
    Log(LogCommand),
    #[command(flatten)]
    Identification(identification::Command),
    /// List the built-in arms.
    Arms {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Look whether this machine can run an arm in real time.
    #[command(after_help = CODES)]
    Doctor {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Print the completions of a shell.
    Completions {
        /// Which.
        shell: Shell,
    },
}

/// Arguments of `demo`.
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// What the controller knows of it, such as `supple identify` wrote: the path of a TOML or of its folder.
    /// Default: the arm's own parameters, perturbed where the experiments say so.
    #[arg(long, value_name = "PATH")]
    pub model: Option<PathBuf>,
    /// Folder for all results. Files in it of the same names are replaced, others are left alone.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out: PathBuf,
    /// Seed of the perturbed models and of every noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the summary as JSON instead of a table; an error is then an object on standard output too.
    #[arg(long)]
    pub json: bool,
    /// No progress, only the results.
    #[arg(long)]
    pub quiet: bool,
    /// Write no logs; all of them take about half a gigabyte.
    #[arg(long)]
    pub no_logs: bool,
}

/// What to do with a log.
#[derive(Clone, Debug, Subcommand)]
pub enum LogCommand {
    /// What is in a log: arm, span, channels, modes, faults.
    Info {
        /// The log.
        file: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// A channel as comma-separated values.
    Export {
        /// The log; one that was cut has to be recovered first.
        file: PathBuf,
        /// The channel.
        #[arg(long, value_name = "NAME", default_value = "/controller_state")]
        channel: String,
        /// Every N-th message.
        #[arg(long, value_name = "N", default_value = "1")]
        every: NonZeroU64,
        /// The table's file; standard output if not given.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Run the controller over a log again and compare every answer to the last bit.
    #[command(after_help = CODES)]
    Replay {
        /// The log; one with missing steps is refused.
        file: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Save every whole chunk of a log that was cut or damaged.
    Recover {
        /// The log.
        from: PathBuf,
        /// Where to; `<name>.recovered.mcap` beside it if not given.
        to: Option<PathBuf>,
        /// Replace what is there.
        #[arg(long)]
        force: bool,
        /// Print what was saved as JSON.
        #[arg(long)]
        json: bool,
    },
}

impl Command {
    /// JSON is expected on standard output.
    pub fn json(&self) -> bool {
        match self {
            Command::Demo(args) => args.json,
            Command::Identification(command) => command.json(),
            Command::Arms { json } | Command::Doctor { json } => *json,
            Command::Log(
                LogCommand::Info { json, .. }
                | LogCommand::Recover { json, .. }
                | LogCommand::Replay { json, .. },
            ) => *json,
            Command::Log(LogCommand::Export { .. }) | Command::Completions { .. } => false,
        }
    }
}
