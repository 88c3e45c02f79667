//! Reports the progress of long work on standard error. The demo has a bar on a terminal, otherwise a line every 20 %. Work
//! in steps has a line at the beginning of each step.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use supple_cli::console::print_status;
use supple_experiment::Progress;

/// Fraction of the work between two lines.
const LINE_EVERY: f64 = 0.2;
/// Resolution of the bar.
const BAR_RESOLUTION: u64 = 1000;

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
        let bar = ProgressBar::new(BAR_RESOLUTION);
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
                bar.set_position((fraction * BAR_RESOLUTION as f64) as u64);
                bar.set_message(progress.finished.clone());
            }
            ProgressReporter::Lines(next) => {
                let mut next = next.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                if fraction >= *next - 1e-9 {
                    // The fraction may be below the next line's fraction by a rounding error.
                    *next = (((fraction + 1e-9) / LINE_EVERY).floor() + 1.0) * LINE_EVERY;
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

/// Progress of work in steps: a line when a step begins, with the time since the start; on a terminal the running step
/// shows its own time as well.
pub struct Steps {
    total: usize,
    begun: usize,
    start: Instant,
    spinner: Option<ProgressBar>,
    quiet: bool,
}

impl Steps {
    /// Creates the progress of work in `total` steps.
    pub fn new(total: usize, quiet: bool) -> Steps {
        Steps {
            total,
            begun: 0,
            start: Instant::now(),
            spinner: None,
            quiet,
        }
    }

    /// Ends the running step and begins the next one.
    pub fn begin(&mut self, text: &str) {
        self.finish();
        self.begun += 1;
        if self.quiet {
            return;
        }
        let elapsed_s = self.start.elapsed().as_secs_f64();
        let line = format!("{elapsed_s:5.1} s  {}/{}  {text}", self.begun, self.total);
        if !std::io::stderr().is_terminal() {
            return print_status(&line);
        }
        let spinner = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{msg}  {elapsed}") {
            spinner.set_style(style);
        }
        spinner.set_message(line);
        spinner.enable_steady_tick(Duration::from_millis(200));
        self.spinner = Some(spinner);
    }

    /// Ends the running step; its line remains visible.
    pub fn finish(&mut self) {
        if let Some(spinner) = self.spinner.take() {
            spinner.finish();
        }
    }
}
