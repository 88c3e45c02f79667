//! `supple doctor`: whether this machine can run the arm in real time, and what to do where it cannot.
//!
//! It only looks: nothing is changed, opened for writing or sent.

mod checks;
mod machine;

use crate::console::{say, say_json};
use crate::exit::Failure;
use checks::{Check, Verdict};
use machine::Machine;
use serde::Serialize;
use std::path::Path;

/// What was found.
#[derive(Debug, Serialize)]
struct Report {
    /// No check failed.
    ready: bool,
    checks: Vec<Check>,
}

/// Looks at this machine and says what it found.
///
/// # Errors
/// [`Failure::NotReady`] where a check failed; warnings are no failure.
pub fn run(as_json: bool) -> Result<(), Failure> {
    let checks = checks::all(&Machine::new(Path::new("/")));
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
        say_json(&report)?;
    } else {
        for check in &report.checks {
            say(&check.to_string())?;
        }
    }
    match report.ready {
        true => Ok(()),
        false => Err(Failure::NotReady { failed }),
    }
}
