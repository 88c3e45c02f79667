//! `supple doctor`: checks whether this machine can run the arm in real time, and prints a remedy for each check
//! that did not pass.
//!
//! The command changes no setting, writes no file and sends no data. To find the Python package, it runs the interpreter.

mod checks;
mod machine;
mod python;

use checks::{Check, Verdict};
use machine::Machine;
use serde::Serialize;
use std::path::Path;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_cli::sibling::python;

/// Results of all checks.
#[derive(Debug, Serialize)]
struct Report {
    /// Whether no check failed.
    ready: bool,
    checks: Vec<Check>,
}

/// Runs all checks and prints the report.
///
/// # Errors
/// [`Failure::NotReady`] if a check failed; warnings do not count.
pub fn run(as_json: bool) -> Result<(), Failure> {
    let mut checks = checks::all(&Machine::new(Path::new("/")));
    checks.push(python::check(&python().display().to_string()));
    let failed: Vec<_> = checks
        .iter()
        .filter(|check| check.verdict == Verdict::Fail)
        .map(|check| check.name)
        .collect();
    let failed = failed.join(", ");
    let report = Report {
        ready: failed.is_empty(),
        checks,
    };
    if as_json {
        print_json(&report)?;
    } else {
        for check in &report.checks {
            print_line(&check.to_string())?;
        }
    }
    match report.ready {
        true => Ok(()),
        false => Err(Failure::NotReady { failed }),
    }
}
