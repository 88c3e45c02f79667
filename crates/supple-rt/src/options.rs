//! Command-line options.

use clap::Parser;
use std::path::PathBuf;
use supple_model::{Description, ModelError, UrdfArgs};
use supple_realtime::{RealtimeOptions, Settings};

/// The controller of one arm: waits for arm states in shared memory and answers with torques.
///
/// `supple up` starts it together with a plant; alone, it waits for one.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-rt", version)]
pub struct Options {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Treats URDF elements that are not supported as errors instead of warnings.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Cycles per second; the arm's own if not given. All processes of a system need the same.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
    /// Prefix of the system; SUPPLE_PREFIX or `supple` if not given.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// Waits for the plant without a timeout, and loses no telemetry.
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
    /// Loads the arm at the requested rate.
    ///
    /// # Errors
    /// As [`Description::find_at_rate`]; with `--strict`, also an unsupported URDF element.
    pub fn description(&self) -> Result<Description, ModelError> {
        Description::find_at_rate(&self.urdf.name(&self.arm), self.rate_hz)?.strict_if(self.strict)
    }

    /// Whether the process must end when its parent ends.
    pub fn supervised(&self) -> bool {
        self.realtime.supervised
    }

    /// Realtime settings of the loop's thread.
    pub fn realtime(&self) -> Settings {
        self.realtime.settings(self.priority, self.virtual_time)
    }
}
