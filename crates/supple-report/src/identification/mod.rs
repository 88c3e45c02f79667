//! Identification commands: design an excitation, measure breakaway, identify from logs, learn from repeated motion,
//! or run all steps on the simulated arm.

mod breakaway;
mod calibrate;
mod excitation_design;
mod excitation_run;
mod identify;
mod learn;
mod paper;
mod report;
mod requested_joints;

use supple_cli::arguments::{ExciteCommand, IdentificationCommand};
use supple_cli::exit::Failure;

/// Runs an identification command.
///
/// # Errors
/// [`Failure`].
pub fn run(command: &IdentificationCommand) -> Result<(), Failure> {
    match command {
        IdentificationCommand::Identify(args) => identify::run(args),
        IdentificationCommand::Excite(ExciteCommand::Design(args)) => excitation_design::run(args),
        IdentificationCommand::Excite(ExciteCommand::Run(args)) => excitation_run::run(args),
        IdentificationCommand::Breakaway(args) => breakaway::run(args),
        IdentificationCommand::Calibrate(args) => calibrate::run(args),
        IdentificationCommand::CalibratePaper(args) => paper::run(args),
        IdentificationCommand::Learn(args) => learn::run(args),
    }
}
