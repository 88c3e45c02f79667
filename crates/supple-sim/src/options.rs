//! Command-line options.

use clap::Parser;
use supple_plant::SimulationArgs;
use supple_process::{ProcessOptions, RateOption};

/// A simulated arm on shared memory; replaces `supple-can` and a real arm.
///
/// `supple up --plant sim` starts it together with a controller; alone, it waits for one with its motors
/// idle.
#[derive(Clone, Debug, Parser)]
#[command(name = "supple-sim", version)]
pub struct Options {
    /// What all periodic programs have.
    #[command(flatten)]
    pub process: ProcessOptions,
    /// The simulated arm.
    #[command(flatten)]
    pub simulation: SimulationArgs,
    /// The rate.
    #[command(flatten)]
    pub rate: RateOption,
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
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if 0.0 < share && share < 1.0 => Ok(share),
        _ => Err("give a number between 0 and 1".to_owned()),
    }
}
