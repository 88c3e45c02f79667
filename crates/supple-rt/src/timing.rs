//! How the loop keeps its time: histograms that are always on and never grow.

use hdrhistogram::Histogram;
use std::fmt;
use supple_ipc::message::CycleTiming;

/// Longest time that is told apart \[ns\]; what is longer counts as this.
const LONGEST_NS: u64 = 10_000_000_000;
/// Significant decimal digits.
const DIGITS: u8 = 3;

/// Times of all cycles since the start.
#[derive(Clone, Debug)]
pub struct Timing {
    cycles: u64,
    latency: Histogram<u64>,
    step: Histogram<u64>,
}

/// A distribution in a few numbers \[ns\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spread {
    /// Median.
    pub p50_ns: u64,
    /// 99 % are below.
    pub p99_ns: u64,
    /// 99.9 % are below.
    pub p999_ns: u64,
    /// Greatest.
    pub max_ns: u64,
}

impl Timing {
    /// No cycles yet; all memory is there.
    pub fn new() -> Timing {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS);
        let histogram = histogram.expect("1 to 10^10 with 3 digits is a histogram");
        Timing {
            cycles: 0,
            latency: histogram.clone(),
            step: histogram,
        }
    }

    /// A cycle.
    pub fn record(&mut self, timing: &CycleTiming) {
        self.cycles += 1;
        self.latency.saturating_record(timing.latency_ns);
        self.step.saturating_record(timing.step_ns);
    }

    /// Cycles recorded.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// From the measurement to the beginning of the step.
    pub fn latency(&self) -> Spread {
        Spread::of(&self.latency)
    }

    /// From there until the torques are known, with a look for requests.
    pub fn step(&self) -> Spread {
        Spread::of(&self.step)
    }
}

impl Default for Timing {
    fn default() -> Self {
        Timing::new()
    }
}

impl Spread {
    fn of(histogram: &Histogram<u64>) -> Spread {
        Spread {
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
