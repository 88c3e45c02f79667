//! How far the demo is: a bar on a terminal, a line now and then elsewhere, nothing if asked so.

use crate::console::remark;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::Duration;
use supple_experiment::Progress;

/// Share of the work between two lines.
const LINE_EVERY: f64 = 0.2;
/// Steps of the bar.
const STEPS: u64 = 1000;

/// Shows progress.
pub enum Meter {
    /// On a terminal.
    Bar(ProgressBar),
    /// Elsewhere: the share at which the next line is due.
    Lines(Mutex<f64>),
    /// Not at all.
    Quiet,
}

impl Meter {
    /// The one for this standard error.
    pub fn new(quiet: bool) -> Meter {
        if quiet {
            return Meter::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Meter::Lines(Mutex::new(LINE_EVERY));
        }
        let bar = ProgressBar::new(STEPS);
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {elapsed}  {msg}")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Meter::Bar(bar)
    }

    /// Takes note of a run that has ended.
    pub fn show(&self, progress: &Progress) {
        let share = progress.done_s / progress.total_s;
        match self {
            Meter::Bar(bar) => {
                bar.set_position((share * STEPS as f64) as u64);
                bar.set_message(progress.finished.clone());
            }
            Meter::Lines(next) => {
                let mut next = next.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                if share >= *next - 1e-9 {
                    *next = (share / LINE_EVERY).floor() * LINE_EVERY + LINE_EVERY;
                    let Progress {
                        done_s, total_s, ..
                    } = progress;
                    remark(&format!(
                        "{:3.0} %  {done_s:.0} of {total_s:.0} s of simulated time",
                        100.0 * share
                    ));
                }
            }
            Meter::Quiet => {}
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Meter::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
