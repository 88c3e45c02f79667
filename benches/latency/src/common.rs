//! What every measurement shares: its options, its times and its second process.

use clap::Args;
use serde::Serialize;
use std::process::{Child, Command};
use supple_realtime::{Settings, apply_realtime_settings, monotonic_ns, sleep_until_ns};

/// Priorities of `supple-sim` and `supple-rt`: the replying process has the higher priority.
pub(super) const PLANT_PRIORITY: u8 = 79;

pub(super) const CONTROLLER_PRIORITY: u8 = 80;

pub(super) const PERIOD_NS: u64 = 1_000_000;

/// Number of cycles before the measurement.
pub(super) const WARM_UP: u64 = 1000;

#[derive(Args, Clone)]
pub(super) struct Common {
    /// Duration of the measurement (s).
    #[arg(long, default_value_t = 60)]
    pub(super) seconds: u64,
    /// CPU of both processes.
    #[arg(long)]
    pub(super) cpu: usize,
    /// Use neither real-time priority nor locked memory.
    #[arg(long)]
    pub(super) no_realtime: bool,
}

impl Common {
    pub(super) fn enter(&self, priority: u8) {
        let settings = Settings {
            priority: (!self.no_realtime).then_some(priority),
            cpu: Some(self.cpu),
            lock_memory: !self.no_realtime,
        };
        for realtime_warning in apply_realtime_settings(&settings) {
            eprintln!("latency: warning: {realtime_warning}");
        }
    }

    pub(super) fn cycles(&self) -> u64 {
        self.seconds * 1_000_000_000 / PERIOD_NS
    }
}

/// Measured times of all cycles \[ns\].
#[derive(Default, Serialize)]
pub(super) struct Measured {
    /// Delay from the due time to the start of each cycle.
    pub(super) wake_ns: Vec<u64>,
    /// Time from each request to its reply.
    pub(super) round_trip_ns: Vec<u64>,
    /// Number of cycles without a reply.
    pub(super) missed: u64,
}

impl Measured {
    pub(super) fn with_capacity(cycles: u64) -> Measured {
        let cycles = usize::try_from(cycles).unwrap_or(0);
        Measured {
            wake_ns: Vec::with_capacity(cycles),
            round_trip_ns: Vec::with_capacity(cycles),
            missed: 0,
        }
    }
}

/// A second process of this program, the peer of an exchange; it is ended on drop.
pub(super) struct PeerProcess(Child);

impl PeerProcess {
    pub(super) fn start(
        what: &str,
        common: &Common,
        set_up: impl FnOnce(&mut Command),
    ) -> Result<PeerProcess, Failure> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args([what, "--cpu", &common.cpu.to_string()]);
        if common.no_realtime {
            command.arg("--no-realtime");
        }
        set_up(&mut command);
        Ok(PeerProcess(command.spawn()?))
    }
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        // The peer ends by itself when this process ends; kill it in case it has not noticed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs and measures one exchange per period.
pub(super) fn run_periodically(
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
        // Skip periods that have been missed.
        due_ns = (due_ns + PERIOD_NS).max(end_ns);
    }
    Ok(measured)
}

pub(super) type Failure = Box<dyn std::error::Error>;
