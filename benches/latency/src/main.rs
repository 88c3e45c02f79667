//! Measures a running system, or a bare echo with the same rhythm, and prints every time measured as JSON.
//! `run.sh` runs it in turn with cyclictest.

mod echo;
mod messages;
mod system;

use clap::{Args, Parser, Subcommand};
use serde::Serialize;
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode};
use supple_realtime::{Settings, enter, monotonic_ns, sleep_until_ns};

/// As `supple-sim` and `supple-rt` have them: who answers comes before who asks.
const ASKING_PRIORITY: u8 = 79;
const ANSWERING_PRIORITY: u8 = 80;
const PERIOD_NS: u64 = 1_000_000;
/// Cycles before those that count.
const WARM_UP: u64 = 1000;

#[derive(Parser)]
#[command(about)]
struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// The simulated arm and its controller, as processes, holding the arm.
    System {
        /// Folder of supple-sim and supple-rt.
        #[arg(long)]
        programs: PathBuf,
        #[command(flatten)]
        common: Common,
    },
    /// Two processes and a Unix datagram there and back, of the same sizes.
    Echo {
        #[command(flatten)]
        common: Common,
    },
    /// Two processes and the messages of a system, through shared memory, with nothing computed on either side.
    Messages {
        #[command(flatten)]
        common: Common,
    },
    /// The other process of the messages.
    #[command(hide = true)]
    Answer {
        #[command(flatten)]
        common: Common,
    },
    /// The other process of the echo, on its standard input.
    #[command(hide = true)]
    Reflect {
        #[command(flatten)]
        common: Common,
    },
}

#[derive(Args, Clone)]
struct Common {
    /// How long to measure (s).
    #[arg(long, default_value_t = 60)]
    seconds: u64,
    /// Processor of both processes.
    #[arg(long)]
    cpu: usize,
    /// Neither priority nor locked memory.
    #[arg(long)]
    no_realtime: bool,
}

impl Common {
    fn enter(&self, priority: u8) {
        let settings = Settings {
            priority: (!self.no_realtime).then_some(priority),
            cpu: Some(self.cpu),
            lock_memory: !self.no_realtime,
        };
        for shortfall in enter(&settings) {
            eprintln!("latency: warning: {shortfall}");
        }
    }

    fn cycles(&self) -> u64 {
        self.seconds * 1_000_000_000 / PERIOD_NS
    }
}

/// Times of all cycles \[ns\].
#[derive(Default, Serialize)]
struct Measured {
    /// From when a cycle was due to when it began.
    wake_ns: Vec<u64>,
    /// From when it asked to when it had its answer.
    round_trip_ns: Vec<u64>,
    /// Cycles without an answer.
    missed: u64,
}

impl Measured {
    fn with_capacity(cycles: u64) -> Measured {
        let cycles = usize::try_from(cycles).unwrap_or(0);
        Measured {
            wake_ns: Vec::with_capacity(cycles),
            round_trip_ns: Vec::with_capacity(cycles),
            missed: 0,
        }
    }
}

/// This program again, as the other side of an exchange; ends with this.
struct Other(Child);

impl Other {
    fn start(
        what: &str,
        common: &Common,
        set_up: impl FnOnce(&mut Command),
    ) -> Result<Other, Failure> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args([what, "--cpu", &common.cpu.to_string()]);
        if common.no_realtime {
            command.arg("--no-realtime");
        }
        set_up(&mut command);
        Ok(Other(command.spawn()?))
    }
}

impl Drop for Other {
    fn drop(&mut self) {
        // It ends when this side does; this is for one that has not noticed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Does an exchange once a period, and measures it.
fn once_a_period(
    common: &Common,
    mut exchange: impl FnMut(u64) -> Result<(), Failure>,
) -> Result<Measured, Failure> {
    let mut measured = Measured::with_capacity(common.cycles());
    let mut due_ns = monotonic_ns() + PERIOD_NS;
    for cycle in 0..WARM_UP + common.cycles() {
        sleep_until_ns(due_ns);
        let begin_ns = monotonic_ns();
        exchange(cycle)?;
        let end_ns = monotonic_ns();
        if cycle >= WARM_UP {
            measured.wake_ns.push(begin_ns.saturating_sub(due_ns));
            measured.round_trip_ns.push(end_ns - begin_ns);
        }
        // A period that is long past is not caught up with.
        due_ns = (due_ns + PERIOD_NS).max(end_ns);
    }
    Ok(measured)
}

type Failure = Box<dyn std::error::Error>;

fn run(what: &What) -> Result<(), Failure> {
    let measured = match what {
        What::System { programs, common } => system::measure(programs, common)?,
        What::Echo { common } => echo::measure(common)?,
        What::Messages { common } => messages::measure(common)?,
        What::Reflect { common } => return echo::reflect(common),
        What::Answer { common } => return messages::answer(common),
    };
    println!("{}", serde_json::to_string(&measured)?);
    Ok(())
}

fn main() -> ExitCode {
    match run(&Options::parse().what) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("latency: error: {error}");
            ExitCode::FAILURE
        }
    }
}
