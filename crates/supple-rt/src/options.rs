//! What the process is told.

use clap::Parser;
use std::path::PathBuf;
use supple_model::{Description, ModelError};
use supple_realtime::{RealtimeOptions, Settings};

/// The controller of one arm: waits for arm states in shared memory and answers with torques.
///
/// `supple up` starts it together with a plant; alone, it waits for one.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-rt", version)]
pub struct Options {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Refuses an arm whose URDF holds what is not read, instead of a warning.
    #[arg(long)]
    pub strict: bool,
    /// Cycles per second; the arm's own if not given. All processes of a system need the same.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
    /// Which system this belongs to; SUPPLE_PREFIX or `supple` if not given.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Waits for the plant however long it takes, and loses no telemetry.
    #[arg(long)]
    pub virtual_time: bool,
    /// Priority under SCHED_FIFO.
    #[arg(long, value_name = "1-99", default_value_t = 80, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    #[command(flatten)]
    realtime: RealtimeOptions,
    /// Folder for the last cycles before a fault; `faults` beside the system's sockets if not given.
    #[arg(long, value_name = "DIR")]
    pub fault_dir: Option<PathBuf>,
}

impl Options {
    /// The arm, at the rate asked for.
    ///
    /// # Errors
    /// As [`Description::find_at_rate`]; what is left out of its URDF where nothing may be.
    pub fn description(&self) -> Result<Description, ModelError> {
        Description::find_at_rate(&self.arm, self.rate_hz)?.strict_if(self.strict)
    }

    /// It is to end with the process that started it.
    pub fn supervised(&self) -> bool {
        self.realtime.supervised
    }

    /// What to ask of the system.
    pub fn realtime(&self) -> Settings {
        self.realtime.settings(self.priority, self.virtual_time)
    }
}
