//! `supple status`: shows the state of a running system.

use super::system_request::running;
use crate::cli::SystemArgs;
use crate::up::{Percentiles, RunStatistics};
use core::fmt;
use core::time::Duration;
use serde::Serialize;
use std::time::Instant;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_core::controller::CycleRecord;
use supple_ipc::message::Telemetry;
use supple_learning::FreezeReason;

/// Duration of the telemetry sample.
const SAMPLE_WINDOW: Duration = Duration::from_millis(500);

/// State of a system, and its statistics over the last half second.
#[derive(Serialize)]
struct Status {
    mode: &'static str,
    mode_time_s: f64,
    drives: &'static str,
    #[serde(skip)]
    caution: &'static str,
    cycle: u64,
    /// Number of sampled cycles.
    cycles: u64,
    missed: u64,
    late: u64,
    /// Number of torque commands discarded because they had a wrong number of joints or were not finite.
    unusable: u64,
    /// Number of messages discarded because their writer is not this system's controller or plant, or because they
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
    learning: LearningStatus,
}

/// Learned terms in effect, one value per joint.
#[derive(Serialize)]
struct LearningStatus {
    on: bool,
    /// Reason why learning is paused.
    frozen: Option<&'static str>,
    viscous_nm_s_per_rad: Vec<f64>,
    coulomb_nm: Vec<f64>,
    offset_nm: Vec<f64>,
    torque_scale: Vec<f64>,
    payload_kg: f64,
    payload_moment_kg_m: [f64; 3],
    tilt_rad: [f64; 3],
    /// Torque of all learned terms \[N m\].
    torque_nm: Vec<f64>,
}

impl LearningStatus {
    fn new<const N: usize>(record: &CycleRecord<N>, joints: usize) -> LearningStatus {
        let of = |values: &[f64]| values[..joints].to_vec();
        LearningStatus {
            on: record.learning,
            frozen: FreezeReason::of_cycle(record).map(FreezeReason::name),
            viscous_nm_s_per_rad: of(record.learned_viscous_nm_s_per_rad.as_slice()),
            coulomb_nm: of(record.learned_coulomb_nm.as_slice()),
            offset_nm: of(record.learned_offset_nm.as_slice()),
            torque_scale: of(record.learned_torque_scale.as_slice()),
            payload_kg: record.learned_payload_kg,
            payload_moment_kg_m: record.learned_payload_moment_kg_m,
            tilt_rad: record.learned_tilt_rad,
            torque_nm: of(record.torques.learned.as_slice()),
        }
    }

    /// Whether the status prints the learned terms.
    fn is_in_use(&self) -> bool {
        let parts = [
            &self.viscous_nm_s_per_rad,
            &self.coulomb_nm,
            &self.offset_nm,
            &self.torque_scale,
            &self.torque_nm,
        ];
        self.on
            || parts
                .iter()
                .any(|part| part.iter().any(|value| *value != 0.0))
    }
}

impl fmt::Display for LearningStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers = |values: &[f64], scale: f64, digits: usize| {
            let each = values
                .iter()
                .map(|value| format!("{:+.digits$}", value * scale));
            each.collect::<Vec<_>>().join(" ")
        };
        let state = match (self.on, self.frozen) {
            (false, _) => "off".to_owned(),
            (true, None) => "on".to_owned(),
            (true, Some(frozen)) => format!("on, frozen: {frozen}"),
        };
        writeln!(
            f,
            "learning  {state}; torque {} N m; payload {:+.1} g, tilt {} mrad",
            numbers(&self.torque_nm, 1.0, 3),
            1e3 * self.payload_kg,
            numbers(&self.tilt_rad, 1e3, 2)
        )?;
        writeln!(
            f,
            "          Coulomb {} N m, viscous {} N m s/rad, offset {} N m, torque scale {} %",
            numbers(&self.coulomb_nm, 1.0, 3),
            numbers(&self.viscous_nm_s_per_rad, 1.0, 3),
            numbers(&self.offset_nm, 1.0, 3),
            numbers(&self.torque_scale, 100.0, 2)
        )
    }
}

/// Reads telemetry for half a second and prints the status.
///
/// # Errors
/// [`Failure::NotRunning`] if no system is running; [`Failure::SystemInFault`] after the status is printed, if a fault is
/// latched.
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
        true => print_json(&status)?,
        false => print_line(&status.to_string())?,
    }
    match status.fault {
        Some(_) => Err(Failure::SystemInFault),
        None => Ok(()),
    }
}

impl Status {
    fn new(last: &Telemetry, statistics: &RunStatistics) -> Status {
        let (seen, record) = (statistics.summary(0), last.record());
        Status {
            mode: record.mode().map_or("unknown", |mode| mode.name()),
            mode_time_s: record.mode_time_s,
            drives: last.state.drives().name(),
            caution: last.state.drives().caution(),
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
            learning: LearningStatus::new(&record, last.dof()),
        }
    }
}

/// Formats three numbers with at most six decimals, because a ramp to 1.5 may end at 1.4999999999999998.
fn axes(values: &[f64; 3]) -> String {
    let values = values.map(|value| {
        // Adding zero converts -0 to 0.
        let rounded = (value * 1e6).round() / 1e6 + 0.0;
        rounded.to_string()
    });
    format!("[{}]", values.join(", "))
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "mode      {} for {:.1} s, drives {}{}, cycle {}",
            self.mode, self.mode_time_s, self.drives, self.caution, self.cycle
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
            "gains     K {} N/m, B {} N s/m",
            axes(&self.stiffness_n_per_m),
            axes(&self.damping_n_s_per_m)
        )?;
        if self.learning.is_in_use() {
            write!(f, "{}", self.learning)?;
        }
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

#[cfg(test)]
mod tests {
    use super::axes;

    #[test]
    fn gains_are_printed_without_rounding_errors() {
        assert_eq!(axes(&[1.4999999999999998, 5.0, -0.0]), "[1.5, 5, 0]");
    }
}
