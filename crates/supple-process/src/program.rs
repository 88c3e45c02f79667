//! The way from the arguments of a program to its exit code.

use crate::failure::Failure;
use crate::options::{ProcessOptions, RateOption};
use clap::Parser;
use std::process::ExitCode;
use supple_model::Description;
use supple_realtime::{Stop, diagnostics, die_with_parent};

/// A periodic program, by its options.
pub trait Program: Parser {
    /// Its name, which begins its messages.
    const NAME: &'static str;

    /// The options that all periodic programs have.
    fn process(&self) -> &ProcessOptions;

    /// The rate that was requested.
    fn rate(&self) -> RateOption {
        RateOption::default()
    }

    /// Runs until a shutdown is requested; returns a summary for standard error, if there is one.
    ///
    /// # Errors
    /// Whatever ends the run early, with the exit code.
    fn run(&self, description: &Description, stop: &Stop) -> Result<Option<String>, Failure>;
}

/// Runs a program: parses its arguments, loads the arm, runs, and returns the exit code.
pub fn main<P: Program>() -> ExitCode {
    let program = P::parse();
    diagnostics::start();
    let code = match start(&program) {
        Ok(None) => 0,
        Ok(Some(summary)) => {
            diagnostics::post(format_args!("{}: {summary}", P::NAME));
            0
        }
        Err(failure) => {
            diagnostics::post(format_args!("{}: error: {failure}", P::NAME));
            failure.code
        }
    };
    diagnostics::flush();
    ExitCode::from(code)
}

fn start<P: Program>(program: &P) -> Result<Option<String>, Failure> {
    let stop = Stop::on_signals()?;
    let supervised = program.process().supervised();
    if supervised {
        die_with_parent();
    }
    let description = program.process().description(program.rate())?;
    // The supervising process has already printed the warnings.
    for warning in description.warnings().iter().filter(|_| !supervised) {
        diagnostics::post(format_args!("{}: warning: {warning}", P::NAME));
    }
    program.run(&description, &stop)
}
