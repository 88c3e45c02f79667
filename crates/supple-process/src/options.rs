//! Options that all periodic programs have.

use clap::Args;
use supple_model::{Description, ModelError, UrdfArgs};
use supple_realtime::{RealtimeOptions, Settings, apply_realtime_settings, diagnostics};

/// Options that all periodic programs have.
#[derive(Clone, Debug, Args)]
pub struct ProcessOptions {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Treats URDF elements that are not supported as errors instead of warnings.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Prefix of the system.
    #[arg(
        long,
        value_name = "NAME",
        env = "SUPPLE_PREFIX",
        default_value = "supple"
    )]
    pub prefix: String,
    /// Runs in lockstep with the other processes, as fast as they can: each cycle waits for its answer.
    #[arg(long)]
    pub virtual_time: bool,
    #[command(flatten)]
    realtime: RealtimeOptions,
}

impl ProcessOptions {
    /// Loads the arm at the requested rate.
    ///
    /// # Errors
    /// As [`Description::find_at_rate`]; with `--strict`, also an unsupported URDF element.
    pub fn description(&self, rate: RateOption) -> Result<Description, ModelError> {
        Description::find_at_rate(&self.urdf.name(&self.arm), rate.rate_hz)?.strict_if(self.strict)
    }

    /// Whether the process must end when its parent ends.
    pub fn supervised(&self) -> bool {
        self.realtime.supervised
    }

    /// Realtime settings of the periodic thread with this priority.
    pub fn realtime(&self, priority: u8) -> Settings {
        self.realtime.settings(priority, self.virtual_time)
    }

    /// Applies the realtime settings to the calling thread; what the system refuses is a warning of this program.
    pub fn apply_realtime(&self, program: &str, priority: u8) {
        for warning in apply_realtime_settings(&self.realtime(priority)) {
            diagnostics::post(format_args!("{program}: warning: {warning}"));
        }
    }
}

/// The rate of a process that runs cycles.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct RateOption {
    /// Cycles per second; default: the rate of the arm. All processes of a system must use the same rate.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
}
