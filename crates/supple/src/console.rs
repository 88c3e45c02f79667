//! What is said on the terminal: results on standard output, everything else on standard error.

use crate::exit::Failure;
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use supple_realtime::diagnostics;

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

/// Standard error is written by a thread of its own.
static IN_BACKGROUND: AtomicBool = AtomicBool::new(false);

/// From now on nothing that is written to standard error is waited for: this process looks after an arm.
pub fn wait_for_no_reader() {
    diagnostics::start();
    IN_BACKGROUND.store(true, Ordering::Relaxed);
}

/// Waits a moment for what is still to be written to standard error.
pub fn flush() {
    if IN_BACKGROUND.load(Ordering::Relaxed) {
        diagnostics::flush();
    }
}

/// Writes a line to standard error; there is nobody to tell where that fails.
pub fn remark(text: &str) {
    remark_part(format!("{text}\n"));
}

/// As [`remark`], of text that is no whole line.
pub fn remark_part(text: String) {
    match IN_BACKGROUND.load(Ordering::Relaxed) {
        true => diagnostics::post_part(text),
        false => {
            let _ = std::io::stderr().lock().write_all(text.as_bytes());
        }
    }
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
