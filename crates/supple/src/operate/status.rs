//! `supple status`: what a running system does now.

use super::running;
use crate::cli::Place;
use crate::console::{say, say_json};
use crate::exit::Failure;
use crate::up::{Meter, Spread};
use core::fmt;
use core::time::Duration;
use serde::Serialize;
use std::time::Instant;
use supple_ipc::message::Telemetry;

/// How long it looks.
const LOOK_FOR: Duration = Duration::from_millis(500);

/// A system at one moment, and over the last half second.
#[derive(Serialize)]
struct Status {
    mode: &'static str,
    mode_time_s: f64,
    drives: &'static str,
    cycle: u64,
    /// Cycles looked at.
    cycles: u64,
    missed: u64,
    late: u64,
    /// Torque commands that counted as no answer: of another arm, or not finite.
    unusable: u64,
    /// Messages dropped because another program than this system's controller or plant wrote them, or of another arm.
    foreign: u64,
    tx_lost: u64,
    bus_load: f64,
    wake_us: Spread,
    step_ns: Spread,
    round_trip_us: Spread,
    tip_position_m: [f64; 3],
    tip_error_m: Option<f64>,
    stiffness_n_per_m: [f64; 3],
    damping_n_s_per_m: [f64; 3],
    in_contact: bool,
    fault: Option<String>,
}

/// Looks, and says what it saw.
///
/// # Errors
/// [`Failure::NotRunning`] where there is no system.
pub fn status(place: &Place) -> Result<(), Failure> {
    let (_, mut reader, mut last) = running(place)?;
    let mut meter = Meter::default();
    let start = Instant::now();
    while start.elapsed() < LOOK_FOR {
        if let Some(telemetry) = reader.wait(LOOK_FOR)? {
            meter.add(&telemetry);
            last = telemetry;
        }
    }
    let status = Status::new(&last, &meter);
    match place.json {
        true => say_json(&status),
        false => say(&status.to_string()),
    }
}

impl Status {
    fn new(last: &Telemetry, meter: &Meter) -> Status {
        let seen = meter.summary(0);
        Status {
            mode: last.mode().map_or("unknown", |mode| mode.name()),
            mode_time_s: last.mode_time_s,
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
            tip_position_m: last.tip_position_m,
            tip_error_m: last.tip_error_m(),
            stiffness_n_per_m: last.stiffness_n_per_m,
            damping_n_s_per_m: last.damping_n_s_per_m,
            in_contact: last.in_contact != 0,
            fault: (last.fault != 0).then(|| last.fault_text.to_string()),
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
            "answer    p50 {:.0} p99 {:.0} max {:.0} us, over {} cycles",
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
                "\ndropped   {} unusable commands, {} messages of other writers: look for a second controller or plant",
                self.unusable, self.foreign
            )?;
        }
        Ok(())
    }
}
