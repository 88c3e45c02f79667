//! Timing statistics of the loop: histograms of fixed size.

use hdrhistogram::Histogram;
use std::fmt;
use supple_ipc::message::CycleTiming;

/// Upper bound of the histograms \[ns\]; longer times are clamped to it.
const MAX_RECORDED_NS: u64 = 10_000_000_000;
/// Number of significant decimal digits of the histograms.
const DIGITS: u8 = 3;

/// Statistics of all cycles since the start.
#[derive(Clone, Debug)]
pub struct Timing {
    cycles: u64,
    latency: Histogram<u64>,
    step: Histogram<u64>,
}

/// Percentiles of a distribution \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Percentiles {
    /// Median.
    pub p50_ns: u64,
    /// 99th percentile.
    pub p99_ns: u64,
    /// 99.9th percentile.
    pub p999_ns: u64,
    /// Maximum.
    pub max_ns: u64,
}

impl Timing {
    /// Creates empty histograms; allocates all memory.
    pub fn new() -> Timing {
        let histogram = Histogram::new_with_bounds(1, MAX_RECORDED_NS, DIGITS);
        let histogram = histogram.expect("the bounds and digits of the histogram are valid");
        Timing {
            cycles: 0,
            latency: histogram.clone(),
            step: histogram,
        }
    }

    /// Records a cycle.
    pub fn record(&mut self, timing: &CycleTiming) {
        self.cycles += 1;
        self.latency.saturating_record(timing.latency_ns);
        self.step.saturating_record(timing.step_ns);
    }

    /// Returns the number of recorded cycles.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Time from the measurement to the start of the step.
    pub fn latency(&self) -> Percentiles {
        Percentiles::of(&self.latency)
    }

    /// Duration of the step, including the check for requests.
    pub fn step(&self) -> Percentiles {
        Percentiles::of(&self.step)
    }
}

impl Default for Timing {
    fn default() -> Self {
        Timing::new()
    }
}

impl Percentiles {
    fn of(histogram: &Histogram<u64>) -> Percentiles {
        Percentiles {
            p50_ns: histogram.value_at_quantile(0.5),
            p99_ns: histogram.value_at_quantile(0.99),
            p999_ns: histogram.value_at_quantile(0.999),
            max_ns: histogram.max(),
        }
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (latency, step) = (self.latency(), self.step());
        write!(
            f,
            "{} cycles; state to step p50 {} p99 {} max {} ns; step p50 {} p99 {} max {} ns",
            self.cycles,
            latency.p50_ns,
            latency.p99_ns,
            latency.max_ns,
            step.p50_ns,
            step.p99_ns,
            step.max_ns
        )
    }
}
