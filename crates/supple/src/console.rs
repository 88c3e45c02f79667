//! What is said on the terminal: results on standard output, everything else on standard error.

use crate::exit::Failure;
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Writes a line to standard output. A reader that has gone is no failure.
///
/// # Errors
/// [`Failure::File`] where standard output cannot be written, such as a full disk behind it.
pub fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{text}").and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::file("write", Path::new("standard output"), error))
        }
        _ => Ok(()),
    }
}

/// Writes a value as JSON to standard output.
///
/// # Errors
/// As [`say`].
pub fn say_json(value: &impl Serialize) -> Result<(), Failure> {
    say(&json(value)?)
}

/// A value as JSON.
///
/// # Errors
/// [`Failure::Compose`] where the value has no JSON.
pub fn json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| Failure::Compose(error.to_string()))
}

/// Writes a line to standard error; there is nobody to tell where that fails.
pub fn remark(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// A failure as `--json` gives it.
#[derive(Serialize)]
struct JsonFailure {
    error: JsonError,
}

#[derive(Serialize)]
struct JsonError {
    kind: &'static str,
    exit_code: u8,
    message: String,
}

/// Says why it failed: one line on standard error, and an object on standard output where JSON is
/// expected there.
pub fn complain(failure: &Failure, as_json: bool) {
    remark(&format!("error: {failure}"));
    if as_json && !failure.comes_with_results() {
        let error = JsonError {
            kind: failure.kind(),
            exit_code: failure.code(),
            message: failure.to_string(),
        };
        let _ = say_json(&JsonFailure { error });
    }
}
