//! Status line on the terminal.

use super::RunStatistics;
use std::io::IsTerminal;
use supple_cli::console::print_status_part;
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, Telemetry};

/// Cycles between two updates of the line.
const EVERY: u64 = 200;

/// The status line; it is disabled without a terminal.
#[derive(Debug)]
pub struct StatusLine {
    shown: bool,
    enabled: bool,
}

impl StatusLine {
    /// Creates the line; `quiet` disables it.
    pub fn new(quiet: bool) -> StatusLine {
        StatusLine {
            shown: false,
            enabled: !quiet && std::io::stderr().is_terminal(),
        }
    }

    /// Updates the line every few cycles.
    pub fn show(&mut self, telemetry: &Telemetry, statistics: &RunStatistics) {
        if !self.enabled || !statistics.cycles().is_multiple_of(EVERY) {
            return;
        }
        let cycle = statistics.round_trip_us();
        let error = telemetry.record().tip_error_m().map_or_else(
            || "-".to_owned(),
            |error_m| format!("{:.1} mm", error_m * 1e3),
        );
        let waits = match (telemetry.record().mode(), telemetry.state.drives()) {
            (Some(Mode::Idle | Mode::Fault) | None, _) | (_, Drives::Active) => "",
            (_, Drives::Idle) => " (waiting for Shift-Activate)",
            (_, Drives::Off) => " (waiting for Shift-Idle: emergency stop)",
        };
        // Ignore write errors; they must not stop the arm.
        print_status_part(format!(
            "\r\x1b[K{}{waits}  round trip p50 {:.0} p99 {:.0} max {:.0} us  missed {}  bus {:.0} %  tip error {error}",
            telemetry
                .record()
                .mode()
                .map_or("unknown", |mode| mode.name()),
            cycle.p50,
            cycle.p99,
            cycle.max,
            statistics.plant().missed,
            statistics.plant().bus_load * 100.0,
        ));
        self.shown = true;
    }

    /// Ends the line.
    pub fn end(&self) {
        if self.shown {
            print_status_part("\n".to_owned());
        }
    }
}
