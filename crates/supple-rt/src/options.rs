//! Command-line options.

use clap::Parser;
use std::path::PathBuf;
use supple_process::{ProcessOptions, RateOption};

/// The controller of one arm: waits for arm states in shared memory and answers with torques.
///
/// `supple up` starts it together with a plant; alone, it waits for one.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-rt", version)]
pub struct Options {
    /// What all periodic programs have.
    #[command(flatten)]
    pub process: ProcessOptions,
    /// The rate.
    #[command(flatten)]
    pub rate: RateOption,
    /// Priority under SCHED_FIFO.
    #[arg(long, value_name = "1-99", default_value_t = 80, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    /// Folder for the last cycles before a fault; `faults` beside the system's sockets if not given.
    #[arg(long, value_name = "DIR")]
    pub fault_dir: Option<PathBuf>,
}
