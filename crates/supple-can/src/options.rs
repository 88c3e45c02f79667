//! What the process is told.

use clap::Parser;
use supple_bus::Address;
use supple_model::{Description, ModelError};
use supple_puck::safety::SpeedLimit;
use supple_realtime::{RealtimeOptions, Settings};

/// Takes an arm on its CAN bus into service: polls it, publishes its state, sends the torques that answer.
///
/// It never activates the arm: the operator does, at the pendant. It may lower it to idle at any time.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-can", version)]
pub struct Options {
    /// A WAM with 4 or 7 joints: a built-in arm, or the path of its TOML or of its folder.
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
    /// can:NAME or unix:FOLDER; an emulator's sockets of the same prefix if not given.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// The emulator keeps the time, and each cycle waits for its answer.
    #[arg(long)]
    pub virtual_time: bool,
    /// The arm is in its home pose now: where its positions are lost, this is where it is.
    #[arg(long)]
    pub zero_at_home: bool,
    /// Speed of elbow and forearm at which the safety module ends torque (m/s).
    #[arg(long, value_name = "M_PER_S", default_value_t = 1.0, value_parser = speed)]
    pub speed_limit_m_per_s: f64,
    /// Takes what the force/torque sensor feels at the start for zero.
    #[arg(long)]
    pub tare: bool,
    /// Time that is kept in each cycle for the controller's answer (us).
    #[arg(long, value_name = "US", default_value_t = 100, value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    pub answer_us: u64,
    /// Prints what a cycle of this arm takes of the bus, with the force/torque sensor and without joint
    /// encoders, and ends. The exit code says whether it fits.
    #[arg(long)]
    pub budget: bool,
    /// Ends after so many cycles.
    #[arg(long, value_name = "N")]
    pub cycles: Option<u64>,
    /// Time in which an answer is looked for without sleeping (us), of this processor's time in each cycle; 50 if
    /// not given where the thread may use several processors, else 0.
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub spin_us: Option<u32>,
    /// Priority under SCHED_FIFO.
    #[arg(long, value_name = "1-99", default_value_t = 79, value_parser = clap::value_parser!(u8).range(1..=99))]
    pub priority: u8,
    #[command(flatten)]
    realtime: RealtimeOptions,
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

fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().map_err(|_| "give a number".to_owned())?;
    SpeedLimit::from_m_per_s(speed)
        .map(|_| speed)
        .map_err(|error| error.to_string())
}
