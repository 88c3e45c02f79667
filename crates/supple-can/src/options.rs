//! Command-line options.

use clap::Parser;
use core::fmt::Display;
use std::io::Write as _;
use supple_bus::Address;
use supple_process::{ProcessOptions, RateOption};
use supple_puck::safety::SpeedLimit;

/// Operates an arm on its CAN bus: polls it, publishes its state, and sends the controller's torques.
///
/// It never activates Barrett's pucks: the operator does, on the pendant. Damiao motors have no pendant: it enables them
/// when a controller in gravity hold requests torque. It may end torque at any time. The arm is a WAM with 4 or 7 joints, or
/// has `[bus]` in its TOML.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-can", version)]
pub struct Options {
    /// What all periodic programs have.
    #[command(flatten)]
    pub process: ProcessOptions,
    /// The rate.
    #[command(flatten)]
    pub rate: RateOption,
    /// can:NAME or unix:FOLDER; default: the sockets of an emulator with the same prefix.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<Address>,
    /// The arm is in its home pose now; if its positions are lost, they are set to the home pose. Not repeated after a loss of power: `supple at-home` confirms it then.
    #[arg(long)]
    pub zero_at_home: bool,
    /// Speed of elbow and forearm at which the safety module ends torque (m/s).
    #[arg(long, value_name = "M_PER_S", default_value_t = 1.0, value_parser = speed)]
    pub speed_limit_m_per_s: f64,
    /// At the end, holds an arm that falls without torque until SIGUSR1 declares that the arm is supported, instead of laying it down.
    #[arg(long, conflicts_with = "virtual_time")]
    pub hold_until_supported: bool,
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
