//! Arguments of `supple log`.

use crate::exit::CODES;
use clap::Subcommand;
use std::num::NonZeroU64;
use std::path::PathBuf;

/// Command of `supple log`.
#[derive(Clone, Debug, Subcommand)]
pub enum LogCommand {
    /// Show the contents of a log: arm, time span, channels, modes, faults.
    Info {
        /// The log.
        file: PathBuf,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Export a channel as comma-separated values.
    Export {
        /// The log. A truncated log must be recovered first.
        file: PathBuf,
        /// The channel.
        #[arg(long, value_name = "NAME", default_value = "/controller_state")]
        channel: String,
        /// Every N-th message.
        #[arg(long, value_name = "N", default_value = "1")]
        every: NonZeroU64,
        /// Output file. Default: standard output.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Run the controller over a log again and compare every output bit for bit.
    #[command(after_help = CODES)]
    Replay {
        /// The log. A log with missing steps is rejected.
        file: PathBuf,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Copy every intact chunk of a truncated or damaged log into a new file.
    Recover {
        /// The log.
        from: PathBuf,
        /// Output file. Default: `<name>.recovered.mcap` beside the log.
        to: Option<PathBuf>,
        /// Replace an existing output file.
        #[arg(long)]
        force: bool,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
}

impl LogCommand {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        match self {
            LogCommand::Info { json, .. }
            | LogCommand::Recover { json, .. }
            | LogCommand::Replay { json, .. } => *json,
            LogCommand::Export { .. } => false,
        }
    }
}
