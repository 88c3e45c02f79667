//! Progress of the demo: a bar on a terminal, a line every 20 % otherwise, nothing in quiet mode.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::Duration;
use supple_cli::console::print_status;
use supple_experiment::Progress;

/// Fraction of the work between two lines.
const LINE_EVERY: f64 = 0.2;
/// Steps of the bar.
const STEPS: u64 = 1000;

/// Reports progress on standard error.
pub enum ProgressReporter {
    /// Progress bar, on a terminal.
    Bar(ProgressBar),
    /// Lines of text, otherwise: the fraction at which the next line is due.
    Lines(Mutex<f64>),
    /// No output.
    Quiet,
}

impl ProgressReporter {
    /// Selects the reporter for this standard error.
    pub fn new(quiet: bool) -> ProgressReporter {
        if quiet {
            return ProgressReporter::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return ProgressReporter::Lines(Mutex::new(LINE_EVERY));
        }
        let bar = ProgressBar::new(STEPS);
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {elapsed}  {msg}")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        ProgressReporter::Bar(bar)
    }

    /// Updates the progress after a finished run.
    pub fn show(&self, progress: &Progress) {
        let fraction = progress.done_s / progress.total_s;
        match self {
            ProgressReporter::Bar(bar) => {
                bar.set_position((fraction * STEPS as f64) as u64);
                bar.set_message(progress.finished.clone());
            }
            ProgressReporter::Lines(next) => {
                let mut next = next.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                if fraction >= *next - 1e-9 {
                    *next = (fraction / LINE_EVERY).floor() * LINE_EVERY + LINE_EVERY;
                    let Progress {
                        done_s, total_s, ..
                    } = progress;
                    print_status(&format!(
                        "{:3.0} %  {done_s:.0} of {total_s:.0} s of simulated time",
                        100.0 * fraction
                    ));
                }
            }
            ProgressReporter::Quiet => {}
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let ProgressReporter::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
