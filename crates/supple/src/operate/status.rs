//! `supple status`: shows the state of a running system.

use super::running;
use crate::cli::SystemArgs;
use crate::up::{Percentiles, RunStatistics};
use core::fmt;
use core::time::Duration;
use serde::Serialize;
use std::time::Instant;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_ipc::message::Telemetry;

/// Duration of the telemetry sample.
const SAMPLE_WINDOW: Duration = Duration::from_millis(500);

/// State of a system, and its statistics over the last half second.
#[derive(Serialize)]
struct Status {
    mode: &'static str,
    mode_time_s: f64,
    drives: &'static str,
    cycle: u64,
    /// Number of sampled cycles.
    cycles: u64,
    missed: u64,
    late: u64,
    /// Torque commands that were discarded: wrong number of joints, or not finite.
    unusable: u64,
    /// Messages that were discarded because their writer is not this system's controller or plant, or because they
    /// belong to another arm.
    foreign: u64,
    tx_lost: u64,
    bus_load: f64,
    wake_us: Percentiles,
    step_ns: Percentiles,
    round_trip_us: Percentiles,
    tip_position_m: [f64; 3],
    tip_error_m: Option<f64>,
    stiffness_n_per_m: [f64; 3],
    damping_n_s_per_m: [f64; 3],
    in_contact: bool,
    fault: Option<String>,
}

/// Reads telemetry for half a second and prints the status.
///
/// # Errors
/// [`Failure::NotRunning`] if no system is running.
pub fn status(system: &SystemArgs) -> Result<(), Failure> {
    let (_, mut reader, mut last) = running(system)?;
    let mut statistics = RunStatistics::default();
    let start = Instant::now();
    while start.elapsed() < SAMPLE_WINDOW {
        if let Some(telemetry) = reader.wait(SAMPLE_WINDOW).map_err(Failure::system)? {
            statistics.add(&telemetry);
            last = telemetry;
        }
    }
    let status = Status::new(&last, &statistics);
    match system.json {
        true => print_json(&status),
        false => print_line(&status.to_string()),
    }
}

impl Status {
    fn new(last: &Telemetry, statistics: &RunStatistics) -> Status {
        let (seen, record) = (statistics.summary(0), last.record());
        Status {
            mode: record.mode().map_or("unknown", |mode| mode.name()),
            mode_time_s: record.mode_time_s,
            drives: last.state.drives().name(),
            cycle: last.state.cycle,
            cycles: seen.cycles,
            missed: last.state.plant.missed,
            late: last.state.plant.late,
            unusable: last.state.plant.unusable,
            foreign: last.state.plant.foreign + last.states_dropped,
            tx_lost: last.state.plant.tx_lost,
            bus_load: seen.bus_load,
            wake_us: seen.wake_us,
            step_ns: seen.step_ns,
            round_trip_us: seen.round_trip_us,
            tip_position_m: record.tip_position_m,
            tip_error_m: record.tip_error_m(),
            stiffness_n_per_m: record.stiffness_n_per_m,
            damping_n_s_per_m: record.damping_n_s_per_m,
            in_contact: record.in_contact,
            fault: (record.fault != 0).then(|| record.fault_text.to_string()),
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "mode      {} for {:.1} s, drives {}, cycle {}",
            self.mode, self.mode_time_s, self.drives, self.cycle
        )?;
        if let Some(fault) = &self.fault {
            writeln!(f, "fault     {fault}")?;
        }
        let [x, y, z] = self.tip_position_m;
        write!(f, "tip       {x:.4} {y:.4} {z:.4} m")?;
        match self.tip_error_m {
            Some(error_m) => writeln!(f, ", {:.2} mm from its reference", error_m * 1e3)?,
            None => writeln!(f)?,
        }
        writeln!(
            f,
            "gains     K {:?} N/m, B {:?} N s/m",
            self.stiffness_n_per_m, self.damping_n_s_per_m
        )?;
        writeln!(
            f,
            "round trip  p50 {:.0} p99 {:.0} max {:.0} us, over {} cycles",
            self.round_trip_us.p50, self.round_trip_us.p99, self.round_trip_us.max, self.cycles
        )?;
        write!(
            f,
            "since start  {} missed, {} late, {} frames lost, bus load {:.0} %",
            self.missed,
            self.late,
            self.tx_lost,
            self.bus_load * 100.0
        )?;
        if self.unusable + self.foreign > 0 {
            write!(
                f,
                "\ndropped   {} invalid commands, {} messages from other processes: check for a second controller or plant",
                self.unusable, self.foreign
            )?;
        }
        Ok(())
    }
}
