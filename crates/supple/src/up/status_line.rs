//! One line on the terminal that says how it goes.

use super::Meter;
use crate::console::remark_part;
use std::io::IsTerminal;
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, Telemetry};

/// Cycles between two looks of the line.
const EVERY: u64 = 200;

/// The line; nothing where there is no terminal.
#[derive(Debug)]
pub struct StatusLine {
    shown: bool,
    wanted: bool,
}

impl StatusLine {
    /// Not shown yet; never, where the output is for a program.
    pub fn new(quiet: bool) -> StatusLine {
        StatusLine {
            shown: false,
            wanted: !quiet && std::io::stderr().is_terminal(),
        }
    }

    /// Shows how it goes, every few cycles.
    pub fn show(&mut self, telemetry: &Telemetry, meter: &Meter) {
        if !self.wanted || !meter.cycles().is_multiple_of(EVERY) {
            return;
        }
        let cycle = meter.round_trip_us();
        let error = telemetry.tip_error_m().map_or_else(
            || "-".to_owned(),
            |error_m| format!("{:.1} mm", error_m * 1e3),
        );
        let waits = match (telemetry.mode(), telemetry.state.drives()) {
            (Some(Mode::Idle | Mode::Fault) | None, _) | (_, Drives::Active) => "",
            (_, Drives::Idle) => " (waiting for Shift-Activate)",
            (_, Drives::Off) => " (waiting for Shift-Idle: emergency stop)",
        };
        // A terminal that cannot be written is no reason to stop an arm.
        remark_part(format!(
            "\r\x1b[K{}{waits}  answer p50 {:.0} p99 {:.0} max {:.0} us  missed {}  bus {:.0} %  tip error {error}",
            telemetry.mode().map_or("unknown", |mode| mode.name()),
            cycle.p50,
            cycle.p99,
            cycle.max,
            meter.plant().missed,
            meter.plant().bus_load * 100.0,
        ));
        self.shown = true;
    }

    /// Leaves the line as it is.
    pub fn end(&self) {
        if self.shown {
            remark_part("\n".to_owned());
        }
    }
}
