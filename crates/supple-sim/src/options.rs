//! Command-line options.

use clap::Parser;
use std::path::PathBuf;
use supple_model::{Description, ModelError, UrdfArgs};
use supple_plant::Injection;
use supple_realtime::{RealtimeOptions, Settings};

/// A simulated arm on shared memory; replaces `supple-can` and a real arm.
///
/// `supple up --plant sim` starts it together with a controller; alone, it waits for one with its motors
/// idle.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-sim", version)]
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
    /// Runs in lockstep: each cycle waits for its answer before the next one starts.
    #[arg(long)]
    pub virtual_time: bool,
    /// Adds a wooden block below the workspace; its top face is at this height above the base frame (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = height)]
    pub block_m: Option<f64>,
    /// Writes joint torques and tip forces to a CSV file every millisecond.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Effects of a real arm, as TOML, or a built-in set by name; `supple plant list` has all options.
    #[arg(long, value_name = "FILE", conflicts_with = "realistic")]
    pub plant_options: Option<PathBuf>,
    /// All effects of a real arm, each of modest size: `supple plant show realistic`.
    #[arg(long)]
    pub realistic: bool,
    /// Injects a fault: KIND or KIND:key=value,..., for example encoder-stuck:joint=1,at-s=2; see --help. May be
    /// repeated.
    #[arg(long, value_name = "SPEC", long_help = supple_plant::injection::HELP)]
    pub inject: Vec<Injection>,
    /// Ends after this number of cycles.
    #[arg(long, value_name = "N")]
    pub cycles: Option<u64>,
    /// Fraction of a cycle for which the simulation waits for the answer.
    #[arg(long, value_name = "0-1", default_value_t = 0.75, value_parser = share)]
    pub answer_share: f64,
    /// Time to poll for the answer before blocking (us); uses the processor for that time in each cycle. Default: 50 if
    /// the thread may use several processors, else 0.
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub spin_us: Option<u32>,
    /// Priority under SCHED_FIFO.
    #[arg(long, value_name = "1-99", default_value_t = 79, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    #[command(flatten)]
    realtime: RealtimeOptions,
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

fn height(text: &str) -> Result<f64, String> {
    let height = text.parse().ok();
    let height = height.filter(|m| (-10.0..=10.0).contains(m));
    height.ok_or_else(|| "give a height from -10 to 10 m".to_owned())
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if 0.0 < share && share < 1.0 => Ok(share),
        _ => Err("give a number between 0 and 1".to_owned()),
    }
}
