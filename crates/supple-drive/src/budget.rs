//! Timing budget of a control period: maximum times of the frames on the bus, other times, and the maximum rate.

use core::fmt;
use supple_can_frame::BitRates;
use supple_can_frame::timing::FrameLayout;

/// Fraction of a period in which the bus is free at the default rate.
pub const SPARE_SHARE: f64 = 0.2;

const NS_PER_S: u64 = 1_000_000_000;
/// Maximum number of lines of a budget.
const LINES: usize = 8;

/// Frames of one kind in a period, or a time that is not on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BudgetLine {
    /// Description of the frames or of the time.
    pub what: &'static str,
    /// Number of frames; one for a time that is not on the bus.
    pub count: u32,
    /// Maximum time of each frame \[ns\].
    pub each_ns: u64,
    /// Whether the bus is busy during this time.
    pub on_bus: bool,
}

/// Times of a period, one line for each kind of frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    rates: BitRates,
    joints: usize,
    lines: [Option<BudgetLine>; LINES],
}

/// Error: the period is too short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overload {
    /// Times that must fit into the period.
    pub budget: Budget,
    /// Requested period \[ns\].
    pub period_ns: u64,
}

impl Budget {
    /// Creates an empty budget of an arm with `joints` motors.
    pub fn new(rates: BitRates, joints: usize) -> Budget {
        Budget {
            rates,
            joints,
            lines: [None; LINES],
        }
    }

    /// Adds `count` frames of this layout, each with the maximum bit stuffing of its length.
    pub fn frames(self, what: &'static str, count: usize, layout: FrameLayout) -> Budget {
        let each_ns = self.rates.max_ns(layout);
        self.line(BudgetLine {
            what,
            count: count as u32,
            each_ns,
            on_bus: true,
        })
    }

    /// Adds a time in which the bus is busy \[ns\].
    pub fn bus_busy_time(self, what: &'static str, each_ns: u64) -> Budget {
        self.line(BudgetLine {
            what,
            count: 1,
            each_ns,
            on_bus: true,
        })
    }

    /// Adds a time in which the bus is free \[ns\].
    pub fn off_bus_time(self, what: &'static str, each_ns: u64) -> Budget {
        self.line(BudgetLine {
            what,
            count: 1,
            each_ns,
            on_bus: false,
        })
    }

    fn line(mut self, line: BudgetLine) -> Budget {
        if line.count > 0 {
            let slot = self.lines.iter_mut().find(|slot| slot.is_none());
            // Without the line, a period that is too short would pass the check.
            assert!(slot.is_some(), "a budget has at most {LINES} lines");
            slot.into_iter().for_each(|slot| *slot = Some(line));
        }
        self
    }

    /// The lines.
    pub fn lines(&self) -> impl Iterator<Item = &BudgetLine> {
        self.lines.iter().flatten()
    }

    /// Bit rates of the bus.
    pub fn rates(&self) -> BitRates {
        self.rates
    }

    /// Number of motors.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Shortest possible period \[ns\].
    pub fn min_period_ns(&self) -> u64 {
        self.lines()
            .map(|line| u64::from(line.count) * line.each_ns)
            .sum()
    }

    /// Time of a period in which the bus is busy \[ns\].
    pub fn bus_ns(&self) -> u64 {
        self.lines()
            .filter(|line| line.on_bus)
            .map(|line| u64::from(line.count) * line.each_ns)
            .sum()
    }

    /// Largest possible rate \[Hz\], rounded down.
    pub fn max_rate_hz(&self) -> u64 {
        NS_PER_S / self.min_period_ns().max(1)
    }

    /// Returns the largest standard rate \[Hz\] at which the bus is free for [`SPARE_SHARE`] of the period; `None` if the bus
    /// is busier at every standard rate.
    pub fn default_rate_hz(&self) -> Option<u32> {
        const STANDARD_RATES_HZ: [u32; 8] = [1000, 800, 500, 400, 250, 200, 125, 100];
        let fits = |rate_hz: &u32| {
            let period_ns = NS_PER_S as f64 / f64::from(*rate_hz);
            let spare = self.bus_ns() as f64 <= (1.0 - SPARE_SHARE) * period_ns;
            spare && self.min_period_ns() as f64 <= period_ns
        };
        STANDARD_RATES_HZ.into_iter().find(fits)
    }

    /// Rejects a period \[ns\] that is too short.
    ///
    /// # Errors
    /// [`Overload`] with the times of all lines.
    pub fn check(&self, period_ns: u64) -> Result<(), Box<Overload>> {
        if self.min_period_ns() <= period_ns {
            return Ok(());
        }
        Err(Box::new(Overload {
            budget: *self,
            period_ns,
        }))
    }

    /// Formats the budget as a table for a period \[ns\], which may be too short.
    pub fn display(&self, period_ns: u64) -> impl fmt::Display {
        Table {
            budget: *self,
            period_ns,
        }
    }
}

struct Table {
    budget: Budget,
    period_ns: u64,
}

fn us(ns: u64) -> u64 {
    ns.div_ceil(1_000)
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let budget = &self.budget;
        writeln!(
            f,
            "A cycle of {} us with {} motors on {}, each frame with the maximum bit stuffing of its length:",
            us(self.period_ns),
            budget.joints,
            budget.rates
        )?;
        for line in budget.lines() {
            let all_us = us(u64::from(line.count) * line.each_ns);
            if line.count > 1 {
                let each_us = line.each_ns as f64 * 1e-3;
                let each = format!("{} x {each_us:.1} us =", line.count);
                writeln!(f, "{:<50}{each:>16} {all_us:>5} us", line.what)?;
            } else {
                writeln!(f, "{:<67}{all_us:>5} us", line.what)?;
            }
        }
        let min_ns = budget.min_period_ns();
        writeln!(f, "{:<67}{:>5} us", "together", us(min_ns))?;
        let load = 100.0 * budget.bus_ns() as f64 / self.period_ns.max(1) as f64;
        let busy = "the bus is busy for at most";
        writeln!(f, "{busy:<67}{load:>5.1} %")?;
        write!(f, "The maximum rate is {} Hz", budget.max_rate_hz())?;
        match budget.default_rate_hz() {
            Some(rate_hz) => write!(
                f,
                "; at {rate_hz} Hz the bus is free for at least {:.0} % of the time.",
                100.0 * SPARE_SHARE
            ),
            None => f.write_str("."),
        }
    }
}

impl fmt::Display for Overload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let budget = &self.budget;
        write!(
            f,
            "a cycle of {} us is too short for {} joints on {} with maximum bit stuffing: ",
            us(self.period_ns),
            budget.joints,
            budget.rates
        )?;
        for (index, line) in budget.lines().enumerate() {
            let sign = if index == 0 { "" } else { " + " };
            let all_us = us(u64::from(line.count) * line.each_ns);
            write!(f, "{sign}{} {all_us} us", line.what)?;
        }
        write!(
            f,
            " = {} us; the maximum rate is {} Hz, set with --rate-hz",
            us(budget.min_period_ns()),
            budget.max_rate_hz()
        )
    }
}

impl core::error::Error for Overload {}
