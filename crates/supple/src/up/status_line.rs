//! Shows the state of the arm on standard error: one line that is updated on a terminal, otherwise one line for each change of
//! mode or drives.

use super::RunStatistics;
use std::io::IsTerminal;
use supple_cli::console::{print_status, print_status_part};
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, Telemetry};

/// Cycles between two updates of the line.
const EVERY: u64 = 200;

/// The status line or lines.
#[derive(Debug)]
pub struct StatusLine {
    output: Output,
    /// Whether operators activate the drives on a pendant.
    pendant: bool,
    period_s: f64,
}

#[derive(Debug)]
enum Output {
    Terminal {
        shown: bool,
    },
    /// The last mode and state of the drives.
    Lines(Option<(Option<Mode>, Drives)>),
    Quiet,
}

impl StatusLine {
    /// Creates the line; `quiet` disables it. With `pendant`, the line of idle drives shows the button to press.
    pub fn new(quiet: bool, pendant: bool, period_s: f64) -> StatusLine {
        StatusLine {
            output: match (quiet, std::io::stderr().is_terminal()) {
                (true, _) => Output::Quiet,
                (false, true) => Output::Terminal { shown: false },
                (false, false) => Output::Lines(None),
            },
            pendant,
            period_s,
        }
    }

    /// Shows a cycle: on a terminal every [`EVERY`] cycles, otherwise cycles that change mode or drives.
    pub fn show(&mut self, telemetry: &Telemetry, statistics: &RunStatistics) {
        let (mode, drives) = (telemetry.record().mode(), telemetry.state.drives());
        let name = mode.map_or("unknown", |mode| mode.name());
        let waits = self.waits(mode, drives);
        match &mut self.output {
            Output::Terminal { shown } if statistics.cycles().is_multiple_of(EVERY) => {
                let cycle = statistics.round_trip_us();
                let error = telemetry.record().tip_error_m().map_or_else(
                    || "-".to_owned(),
                    |error_m| format!("{:.1} mm", error_m * 1e3),
                );
                // Ignore write errors; they must not stop the arm.
                print_status_part(format!(
                    "\r\x1b[K{name}{waits}  round trip p50 {:.0} p99 {:.0} max {:.0} us  missed {}  bus {:.0} %  tip error {error}",
                    cycle.p50,
                    cycle.p99,
                    cycle.max,
                    statistics.plant().missed,
                    statistics.plant().bus_load * 100.0,
                ));
                *shown = true;
            }
            Output::Lines(last) if *last != Some((mode, drives)) => {
                *last = Some((mode, drives));
                print_status(&format!(
                    "{:.2} s: {name}, drives {}{}{waits}",
                    telemetry.state.cycle as f64 * self.period_s,
                    drives.name(),
                    drives.caution()
                ));
            }
            Output::Terminal { .. } | Output::Lines(_) | Output::Quiet => {}
        }
    }

    fn waits(&self, mode: Option<Mode>, drives: Drives) -> &'static str {
        match (mode, drives) {
            (Some(Mode::Idle | Mode::Fault) | None, _) | (_, Drives::Active) => "",
            _ if !self.pendant => "",
            (_, Drives::Held) => "",
            (_, Drives::Idle) => " (waiting for Shift-Activate)",
            (_, Drives::Off) => " (waiting for Shift-Idle: emergency stop)",
        }
    }

    /// Ends the line.
    pub fn end(&self) {
        if let Output::Terminal { shown: true } = self.output {
            print_status_part("\n".to_owned());
        }
    }
}
