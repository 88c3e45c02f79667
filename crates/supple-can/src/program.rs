//! The process: its options, the backend of the arm's drives, and its exit code.

use crate::backend::RunError;
use crate::options::Options;
use crate::registry::BACKENDS;
use clap::Parser;
use std::process::ExitCode;
use supple_drive::Counters;
use supple_realtime::{Stop, diagnostics, die_with_parent};

/// The whole program, from its arguments to its exit code.
pub fn main() -> ExitCode {
    let options = Options::parse();
    diagnostics::start();
    match start(&options) {
        Ok(None) => ExitCode::SUCCESS,
        Ok(Some(counters)) => {
            diagnostics::post(format_args!(
                "supple-can: {} cycles, {} answers missed, {} answers unusable, {} periods skipped, {} frames lost, \
                 {} replies lost, {} receive overruns",
                counters.cycles,
                counters.missed,
                counters.unusable,
                counters.skipped,
                counters.tx_lost,
                counters.replies_lost,
                counters.overruns
            ));
            diagnostics::flush();
            ExitCode::SUCCESS
        }
        Err(RunError::Stopped) => ExitCode::SUCCESS,
        Err(RunError::Failed { code, source }) => {
            diagnostics::post(format_args!("supple-can: error: {source}"));
            diagnostics::flush();
            ExitCode::from(code)
        }
    }
}

/// Runs the process and returns the counters of the run; `None` if only the budget of the bus was requested.
fn start(options: &Options) -> Result<Option<Counters>, RunError> {
    let stop = Stop::on_signals().map_err(|error| RunError::new(10, error))?;
    if options.supervised() {
        die_with_parent();
    }
    let description = options.description();
    let description = description.map_err(|error| RunError::new(3, error))?;
    // The supervising process has already printed the warnings.
    for warning in description
        .warnings()
        .iter()
        .filter(|_| !options.supervised())
    {
        diagnostics::post(format_args!("supple-can: warning: {warning}"));
    }
    let mut backends = BACKENDS.iter();
    match backends.find(|backend| (backend.supports)(&description)) {
        Some(backend) => (backend.run)(&description, options, &stop),
        None => Err(RunError::new(
            3,
            format!(
                "arm `{}`: [bus] kind names no type of drives that this program supports",
                description.name()
            ),
        )),
    }
}
