//! Statistics of a run: counts, times, tracking error.

use core::fmt;
use hdrhistogram::Histogram;
use serde::Serialize;
use supple_core::codes::fault_kind;
use supple_core::controller::Mode;
use supple_ipc::message::{PlantReport, Telemetry};

/// Upper end of the histogram range \[ns\].
const MAX_LATENCY_NS: u64 = 10_000_000_000;
/// Time for which the plant's clock was paused in all, and delay of a wake-up, above which the machine may have caused a fault. A stall pauses
/// the clock, and only what is left of it delays the wake-up.
const STALL_MS: f64 = 2.0;
/// Significant decimal digits of the histograms.
const DIGITS: u8 = 3;

/// Statistics since the first cycle.
#[derive(Debug)]
pub struct RunStatistics {
    cycles: u64,
    plant: PlantReport,
    states_dropped: u64,
    wake: Histogram<u64>,
    step: Histogram<u64>,
    round_trip: Histogram<u64>,
    bus_load: f64,
    squared_error_m2: f64,
    tracked: u64,
    fault: u8,
    faults: Vec<String>,
    input_was_missing: bool,
}

/// Percentiles of a distribution.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Maximum.
    pub max: f64,
}

/// Summary of a run.
#[derive(Clone, Debug, Serialize)]
pub struct UpSummary {
    /// Number of cycles of the controller.
    pub cycles: u64,
    /// Number of cycles with active drives whose torque command did not arrive in time.
    pub missed: u64,
    /// Number of torque commands that arrived after their cycle.
    pub late: u64,
    /// Number of torque commands discarded because they had a wrong number of joints or were not finite.
    pub unusable: u64,
    /// Number of messages discarded because their writer is not this system's controller or plant, or because they
    /// belong to another arm.
    pub foreign: u64,
    /// Wake-up latency of a cycle.
    pub wake_us: Percentiles,
    /// Computing time of the controller's step.
    pub step_ns: Percentiles,
    /// Time from publishing the state until the torque command arrives.
    pub round_trip_us: Percentiles,
    /// Mean fraction of a cycle in which the bus is busy; 0 without a bus.
    pub bus_load: f64,
    /// Number of CAN frames whose transmission was not confirmed.
    pub tx_lost: u64,
    /// Time for which simulated time was paused because the host stalled the plant process.
    pub clock_stall_ms: f64,
    /// Number of cycles whose telemetry was lost; they are missing in the log.
    pub telemetry_lost: u64,
    /// RMS distance of the tip from its reference while tracking, computed from the encoders; none if no cycle tracked.
    pub rms_error_m: Option<f64>,
    /// Number of tracked cycles.
    pub tracked_cycles: u64,
    /// Descriptions of the faults that latched.
    pub faults: Vec<String>,
    /// Whether a fault latched because states or replies were missing, as they also are if the machine stalls.
    #[serde(skip)]
    pub input_was_missing: bool,
    /// Reason why the log or the trace is incomplete; none if both are complete.
    pub incomplete_output: Option<String>,
    /// Real-time factor: simulated time over wall-clock time; none in real time.
    pub times_real_time: Option<f64>,
}

impl UpSummary {
    /// Whether inputs were missing and this machine may be the reason, because it stalled.
    pub fn may_have_stalled(&self) -> bool {
        self.input_was_missing && self.clock_stall_ms.max(1e-3 * self.wake_us.max) > STALL_MS
    }
}

impl Default for RunStatistics {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, MAX_LATENCY_NS, DIGITS);
        let histogram = histogram.expect("the bounds and digits of the histogram are valid");
        RunStatistics {
            cycles: 0,
            plant: PlantReport::default(),
            states_dropped: 0,
            wake: histogram.clone(),
            step: histogram.clone(),
            round_trip: histogram,
            bus_load: 0.0,
            squared_error_m2: 0.0,
            tracked: 0,
            fault: 0,
            faults: Vec::new(),
            input_was_missing: false,
        }
    }
}

impl RunStatistics {
    /// Adds a cycle.
    pub fn add(&mut self, telemetry: &Telemetry) {
        self.cycles += 1;
        self.plant = telemetry.state.plant;
        self.states_dropped = telemetry.states_dropped;
        self.wake.saturating_record(self.plant.wake_ns);
        self.step.saturating_record(telemetry.timing.step_ns);
        if self.plant.round_trip_ns > 0 {
            self.round_trip.saturating_record(self.plant.round_trip_ns);
        }
        self.bus_load += self.plant.bus_load;
        let tracking = matches!(telemetry.record().mode(), Some(Mode::Track | Mode::Probe));
        if let (true, Some(error_m)) = (tracking, telemetry.record().tip_error_m()) {
            self.squared_error_m2 += error_m * error_m;
            self.tracked += 1;
        }
        self.note_fault(telemetry);
    }

    /// Adds a latched fault of a cycle that is not counted otherwise.
    pub fn note_fault(&mut self, telemetry: &Telemetry) {
        if telemetry.record().fault != self.fault && telemetry.record().fault != 0 {
            self.faults.push(telemetry.record().fault_text.to_string());
            let kinds = [
                fault_kind::STATE_STALE,
                fault_kind::ENCODER_LOST,
                fault_kind::ENCODER_UNRELIABLE,
            ];
            self.input_was_missing |= kinds.contains(&telemetry.record().fault);
        }
        self.fault = telemetry.record().fault;
    }

    /// Number of cycles so far.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// The last report of the plant.
    pub fn plant(&self) -> &PlantReport {
        &self.plant
    }

    /// Time from publishing the state until the torque command arrives \[us\].
    pub fn round_trip_us(&self) -> Percentiles {
        percentiles(&self.round_trip, 1e-3)
    }

    /// Summary of the run so far.
    pub fn summary(&self, telemetry_lost: u64) -> UpSummary {
        let mean = |sum: f64, count: u64| (count > 0).then(|| sum / count as f64);
        UpSummary {
            cycles: self.cycles,
            missed: self.plant.missed,
            late: self.plant.late,
            unusable: self.plant.unusable,
            foreign: self.plant.foreign + self.states_dropped,
            wake_us: percentiles(&self.wake, 1e-3),
            step_ns: percentiles(&self.step, 1.0),
            round_trip_us: self.round_trip_us(),
            bus_load: mean(self.bus_load, self.cycles).unwrap_or_default(),
            tx_lost: self.plant.tx_lost,
            clock_stall_ms: self.plant.clock_stall_ns as f64 * 1e-6,
            telemetry_lost,
            rms_error_m: mean(self.squared_error_m2, self.tracked).map(f64::sqrt),
            tracked_cycles: self.tracked,
            faults: self.faults.clone(),
            input_was_missing: self.input_was_missing,
            incomplete_output: None,
            times_real_time: None,
        }
    }
}

fn percentiles(histogram: &Histogram<u64>, scale: f64) -> Percentiles {
    let at = |quantile| histogram.value_at_quantile(quantile) as f64 * scale;
    Percentiles {
        p50: at(0.5),
        p99: at(0.99),
        p999: at(0.999),
        max: histogram.max() as f64 * scale,
    }
}

/// The result first, then how the cycles kept their time.
impl fmt::Display for UpSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut row = |name: &str, value: String| writeln!(f, "{name:<27}{value}");
        let error = match self.rms_error_m {
            Some(error_m) => format!("{:.2} mm RMS", error_m * 1e3),
            None => "nothing was tracked".to_owned(),
        };
        row("tip error while tracking", error)?;
        let late = format!("{} of {} cycles", self.missed, self.cycles);
        row("torque not in time", late)?;
        if self.tx_lost > 0 {
            row("CAN frames lost", self.tx_lost.to_string())?;
        }
        if self.clock_stall_ms > 0.0 {
            let paused = format!("{:.1} ms, while the host stalled", self.clock_stall_ms);
            row("simulated time paused for", paused)?;
        }
        if let Some(times) = self.times_real_time {
            row("speed", format!("{times:.1} times real time"))?;
        }
        let columns = |cells: [String; 4]| cells.map(|cell| format!("{cell:>10}")).concat();
        let head = ["median", "99 %", "99.9 %", "maximum"].map(str::to_owned);
        row("times (us)", columns(head))?;
        for (name, scale, times) in [
            ("  waking up for a cycle", 1.0, &self.wake_us),
            ("  computing the torque", 1e-3, &self.step_ns),
            ("  from state to torque", 1.0, &self.round_trip_us),
        ] {
            let each = [times.p50, times.p99, times.p999, times.max];
            row(
                name,
                columns(each.map(|time| format!("{:.1}", scale * time))),
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::RunStatistics;

    /// A stall pauses the plant's clock, so that a wake-up is hardly late; either may be the reason of missing inputs.
    #[test]
    fn a_stall_is_the_pause_of_the_clock_or_the_delay_of_a_wake_up() {
        for (input_was_missing, clock_stall_ms, late_us, expected) in [
            (true, 50.0, 100.0, true),
            (true, 0.0, 3000.0, true),
            (true, 0.2, 300.0, false),
            (false, 50.0, 3000.0, false),
        ] {
            let mut summary = RunStatistics::default().summary(0);
            summary.input_was_missing = input_was_missing;
            summary.clock_stall_ms = clock_stall_ms;
            summary.wake_us.max = late_us;
            assert_eq!(
                summary.may_have_stalled(),
                expected,
                "{clock_stall_ms} ms, {late_us} us"
            );
        }
    }
}
