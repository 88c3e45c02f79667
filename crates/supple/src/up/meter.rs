//! What a run measures as it goes: counts, times, tracking error.

use core::fmt;
use hdrhistogram::Histogram;
use serde::Serialize;
use supple_core::controller::Mode;
use supple_ipc::message::{PlantReport, Telemetry};

/// Longest time that is told apart \[ns\].
const LONGEST_NS: u64 = 10_000_000_000;
/// Significant decimal digits.
const DIGITS: u8 = 3;

/// Everything since the first cycle.
#[derive(Debug)]
pub struct Meter {
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
}

/// A distribution in a few numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// Median.
    pub p50: f64,
    /// 99 % are below.
    pub p99: f64,
    /// 99.9 % are below.
    pub p999: f64,
    /// Greatest.
    pub max: f64,
}

/// A run in numbers.
#[derive(Clone, Debug, Serialize)]
pub struct UpSummary {
    /// Cycles of the controller.
    pub cycles: u64,
    /// Cycles with active drives whose answer did not come in time.
    pub missed: u64,
    /// Answers that came after their cycle.
    pub late: u64,
    /// Torque commands that counted as no answer: of another arm, or not finite.
    pub unusable: u64,
    /// Messages dropped because another program than this system's controller or plant wrote them, or of another arm.
    pub foreign: u64,
    /// By how much a cycle began late.
    pub wake_us: Spread,
    /// The controller's step.
    pub step_ns: Spread,
    /// From the state published to its answer.
    pub round_trip_us: Spread,
    /// Mean share of a cycle in which the bus is busy; 0 without a bus.
    pub bus_load: f64,
    /// Frames that were not seen to leave.
    pub tx_lost: u64,
    /// How long the arm's time stood still because the machine held up what plays it.
    pub stood_still_ms: f64,
    /// Cycles whose telemetry did not arrive here; they are missing in the log.
    pub telemetry_lost: u64,
    /// Distance of the tip from its reference, by the encoders, root mean square while tracking; none where
    /// nothing was tracked.
    pub rms_error_m: Option<f64>,
    /// Cycles of them.
    pub tracked_cycles: u64,
    /// Faults that latched, in words.
    pub faults: Vec<String>,
    /// Why the log or the trace ended before the run; none where both are whole.
    pub cut_short: Option<String>,
    /// Time of the arm over time of the wall; none where they are the same.
    pub times_real_time: Option<f64>,
}

impl Default for Meter {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS);
        let histogram = histogram.expect("1 to 10^10 with 3 digits is a histogram");
        Meter {
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
        }
    }
}

impl Meter {
    /// A cycle.
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
        let tracking = matches!(telemetry.mode(), Some(Mode::Track | Mode::Probe));
        if let (true, Some(error_m)) = (tracking, telemetry.tip_error_m()) {
            self.squared_error_m2 += error_m * error_m;
            self.tracked += 1;
        }
        self.note_fault(telemetry);
    }

    /// Takes note of a fault that has latched, of a cycle that is not counted otherwise.
    pub fn note_fault(&mut self, telemetry: &Telemetry) {
        if telemetry.fault != self.fault && telemetry.fault != 0 {
            self.faults.push(telemetry.fault_text.to_string());
        }
        self.fault = telemetry.fault;
    }

    /// Cycles so far.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// The plant's last report.
    pub fn plant(&self) -> &PlantReport {
        &self.plant
    }

    /// From the state published to its answer \[us\].
    pub fn round_trip_us(&self) -> Spread {
        spread(&self.round_trip, 1e-3)
    }

    /// All of it.
    pub fn summary(&self, telemetry_lost: u64) -> UpSummary {
        let mean = |sum: f64, count: u64| (count > 0).then(|| sum / count as f64);
        UpSummary {
            cycles: self.cycles,
            missed: self.plant.missed,
            late: self.plant.late,
            unusable: self.plant.unusable,
            foreign: self.plant.foreign + self.states_dropped,
            wake_us: spread(&self.wake, 1e-3),
            step_ns: spread(&self.step, 1.0),
            round_trip_us: self.round_trip_us(),
            bus_load: mean(self.bus_load, self.cycles).unwrap_or_default(),
            tx_lost: self.plant.tx_lost,
            stood_still_ms: self.plant.stood_still_ns as f64 * 1e-6,
            telemetry_lost,
            rms_error_m: mean(self.squared_error_m2, self.tracked).map(f64::sqrt),
            tracked_cycles: self.tracked,
            faults: self.faults.clone(),
            cut_short: None,
            times_real_time: None,
        }
    }
}

fn spread(histogram: &Histogram<u64>, scale: f64) -> Spread {
    let at = |quantile| histogram.value_at_quantile(quantile) as f64 * scale;
    Spread {
        p50: at(0.5),
        p99: at(0.99),
        p999: at(0.999),
        max: histogram.max() as f64 * scale,
    }
}

impl fmt::Display for UpSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} cycles, {} missed, {} late, {} frames lost",
            self.cycles, self.missed, self.late, self.tx_lost
        )?;
        for (name, unit, s) in [
            ("wake-up late by", "us", &self.wake_us),
            ("step", "ns", &self.step_ns),
            ("state to answer", "us", &self.round_trip_us),
        ] {
            writeln!(
                f,
                "{name}: p50 {:.1}, p99 {:.1}, p99.9 {:.1}, max {:.1} {unit}",
                s.p50, s.p99, s.p999, s.max
            )?;
        }
        if self.stood_still_ms > 0.0 {
            writeln!(
                f,
                "the arm's time stood still for {:.1} ms",
                self.stood_still_ms
            )?;
        }
        if let Some(times) = self.times_real_time {
            writeln!(f, "{times:.1} times real time")?;
        }
        match self.rms_error_m {
            Some(error_m) => write!(f, "tip error while tracking: {:.2} mm RMS", error_m * 1e3),
            None => write!(f, "nothing was tracked"),
        }
    }
}
