//! Arguments of `supple log`.

use crate::exit::CODES;
use clap::{Args, Subcommand};
use std::num::NonZeroU64;
use std::path::PathBuf;

/// Command of `supple log`.
#[derive(Clone, Debug, Subcommand)]
pub enum LogCommand {
    /// Commands that draw no figures.
    #[command(flatten)]
    Data(LogDataCommand),
    /// Draw the standard figures of a log: tracking and contact, the torque terms of every joint, the timing.
    Plot(PlotArgs),
}

/// Arguments of `supple log plot`.
#[derive(Clone, Debug, Args)]
pub struct PlotArgs {
    /// The log. A truncated log must be recovered first.
    pub file: PathBuf,
    /// Folder for the figures, each as SVG and PNG; it is created if necessary.
    #[arg(long, value_name = "FOLDER", default_value = "out/plot")]
    pub out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Command of `supple log` that draws no figures.
#[derive(Clone, Debug, Subcommand)]
pub enum LogDataCommand {
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
        /// Print file, channel and number of rows as JSON; the table itself stays comma-separated.
        #[arg(long, requires = "out")]
        json: bool,
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
            LogCommand::Plot(args) => args.json,
            LogCommand::Data(
                LogDataCommand::Info { json, .. }
                | LogDataCommand::Export { json, .. }
                | LogDataCommand::Recover { json, .. }
                | LogDataCommand::Replay { json, .. },
            ) => *json,
        }
    }
}
