//! Identification commands: design an excitation, measure breakaway, identify from logs, learn from repeated motion,
//! or do all of it on the simulated arm.

mod breakaway;
mod calibrate;
mod excite;
mod follow;
mod identify;
mod learn;
mod paper;
mod report;

use supple_cli::arguments::{ExciteCommand, IdentificationCommand};
use supple_cli::exit::Failure;
use supple_ident::IdentError;

/// Runs an identification command.
///
/// # Errors
/// [`Failure`].
pub fn run(command: &IdentificationCommand) -> Result<(), Failure> {
    match command {
        IdentificationCommand::Identify(args) => identify::run(args),
        IdentificationCommand::Excite(ExciteCommand::Design(args)) => excite::run(args),
        IdentificationCommand::Excite(ExciteCommand::Run(args)) => follow::run(args),
        IdentificationCommand::Breakaway(args) => breakaway::run(args),
        IdentificationCommand::Calibrate(args) => calibrate::run(args),
        IdentificationCommand::CalibratePaper(args) => paper::run(args),
        IdentificationCommand::Learn(args) => learn::run(args),
    }
}

/// The requested joints, or all joints below `dof`.
fn joints(requested: &[usize], dof: usize) -> Result<Vec<usize>, Failure> {
    if requested.is_empty() {
        return Ok((0..dof).collect());
    }
    let increasing = requested.windows(2).all(|w| w[0] < w[1]);
    if increasing && requested.iter().all(|joint| *joint < dof) {
        return Ok(requested.to_vec());
    }
    Err(Failure::Ident(IdentError::Shape {
        argument: "joints".to_owned(),
        expected: format!("numbers below {dof}, increasing"),
        found: format!("{requested:?}"),
    }))
}
