//! Command-line options.

use clap::Parser;
use core::fmt::Display;
use std::io::Write as _;
use supple_bus::Address;
use supple_model::{Description, ModelError, UrdfArgs};
use supple_puck::safety::SpeedLimit;
use supple_realtime::{RealtimeOptions, Settings};

/// Operates an arm on its CAN bus: polls it, publishes its state, and sends the controller's torques.
///
/// It never activates Barrett's pucks: the operator does, at the pendant. Damiao motors have no pendant: it enables them
/// when a controller in gravity hold requests torque. It may end torque at any time.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-can", version)]
pub struct Options {
    /// A WAM with 4 or 7 joints, or an arm with `[bus]`: a built-in arm, or the path of its TOML, of its
    /// folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Treats URDF elements that are not supported as errors instead of warnings.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Cycles per second; default: the rate of the arm. All processes of a system must use the same rate.
    #[arg(long, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=10_000))]
    pub rate_hz: Option<u32>,
    /// Prefix of the system; default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// can:NAME or unix:FOLDER; default: the sockets of an emulator with the same prefix.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// The emulator owns the time, and each cycle waits for its answer.
    #[arg(long)]
    pub virtual_time: bool,
    /// The arm is in its home pose now; if its positions are lost, they are set to the home pose. Not repeated after a loss of power: `supple at-home` confirms it then.
    #[arg(long)]
    pub zero_at_home: bool,
    /// Speed of elbow and forearm at which the safety module ends torque (m/s).
    #[arg(long, value_name = "M_PER_S", default_value_t = 1.0, value_parser = speed)]
    pub speed_limit_m_per_s: f64,
    /// Tares the force/torque sensor at start-up.
    #[arg(long)]
    pub tare: bool,
    /// Time reserved in each cycle for the controller's answer (us).
    #[arg(long, value_name = "US", default_value_t = 100, value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    pub answer_us: u64,
    /// Prints the bus time of a cycle of this arm, with the force/torque sensor and without joint encoders, and
    /// ends. The exit code shows whether it fits.
    #[arg(long)]
    pub budget: bool,
    /// Ends after this many cycles.
    #[arg(long, value_name = "N")]
    pub cycles: Option<u64>,
    /// Time to poll for the answer before blocking (us); uses the processor for that time in each cycle.
    /// Default: 50 if the thread may use several processors, else 0.
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub spin_us: Option<u32>,
    /// Priority under SCHED_FIFO.
    #[arg(long, value_name = "1-99", default_value_t = 79, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    #[command(flatten)]
    realtime: RealtimeOptions,
}

impl Options {
    /// The arm, at the requested rate.
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

    /// Real-time settings of the process.
    pub fn realtime(&self) -> Settings {
        self.realtime.settings(self.priority, self.virtual_time)
    }
}

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().map_err(|_| "give a number".to_owned())?;
    SpeedLimit::from_m_per_s(speed)
        .map(|_| speed)
        .map_err(|error| error.to_string())
}

/// Writes a budget to standard output. Errors are ignored: the exit code says whether the rate fits.
pub fn print_budget(text: &dyn Display) {
    let _ = writeln!(std::io::stdout(), "{text}");
}
