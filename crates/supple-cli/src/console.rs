//! Terminal output: results go to standard output, everything else to standard error.

use crate::exit::Failure;
use serde::Serialize;
use std::io::{BufRead, ErrorKind, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use supple_realtime::diagnostics;

/// Writes a line to standard output. A closed pipe is not an error.
///
/// # Errors
/// [`Failure::File`] if standard output cannot be written, for example because the disk is full.
pub fn print_line(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{text}").and_then(|()| out.flush());
    match written {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::standard_output(error)),
        _ => Ok(()),
    }
}

/// Writes a value as JSON to standard output.
///
/// # Errors
/// The same as those of [`print_line`].
pub fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    print_line(&json(value)?)
}

/// Converts a value to JSON.
///
/// # Errors
/// [`Failure::ReportGeneration`] if the value cannot be represented as JSON.
pub fn json(value: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map_err(|error| Failure::ReportGeneration(error.to_string()))
}

/// Whether a background thread writes standard error.
static IN_BACKGROUND: AtomicBool = AtomicBool::new(false);

/// Makes a background thread write all further output to standard error, so that a process that supervises an arm never
/// blocks on it.
pub fn write_stderr_in_background() {
    diagnostics::start();
    IN_BACKGROUND.store(true, Ordering::Relaxed);
}

/// Waits briefly until pending output to standard error is written.
fn flush() {
    if IN_BACKGROUND.load(Ordering::Relaxed) {
        diagnostics::flush();
    }
}

/// Writes a line to standard error. Errors are ignored: they cannot be reported anywhere else.
pub fn print_status(text: &str) {
    print_status_part(format!("{text}\n"));
}

/// Asks a question on the terminal; returns false without a terminal, or for any answer except `y` and `yes`.
pub fn confirm(question: &str) -> bool {
    if !std::io::stdin().is_terminal() {
        return false;
    }
    print_status_part(format!("{question} [y/N] "));
    let mut answer = String::new();
    let read = std::io::stdin().lock().read_line(&mut answer);
    read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes")
}

/// Writes text that is not a complete line to standard error; otherwise as [`print_status`].
pub fn print_status_part(text: String) {
    match IN_BACKGROUND.load(Ordering::Relaxed) {
        true => diagnostics::post_part(text),
        false => {
            let _ = std::io::stderr().lock().write_all(text.as_bytes());
        }
    }
}

/// A failure in the form that `--json` prints.
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

/// Maximum length of a message; of a longer message the beginning and the end are kept \[characters\].
const MESSAGE_CHARACTERS: usize = 4000;
const KEPT_CHARACTERS: (usize, usize) = (2000, 500);

/// Shortens a long message, for example one that quotes a file, to its beginning and its end.
fn shortened(message: String) -> String {
    let characters = message.chars().count();
    if characters <= MESSAGE_CHARACTERS {
        return message;
    }
    let (head, tail) = KEPT_CHARACTERS;
    let at = |character: usize| {
        let found = message.char_indices().nth(character);
        found.map_or(message.len(), |(byte, _)| byte)
    };
    let (begin, end) = (&message[..at(head)], &message[at(characters - tail)..]);
    format!("{begin} ... ({characters} characters) ... {end}")
}

/// Reports a failure: one line on standard error and, in JSON mode, an object on standard output.
fn report_error(failure: &Failure, as_json: bool) {
    let message = shortened(failure.to_string());
    print_status(&format!("error: {message}"));
    if as_json && !failure.comes_with_results() {
        let error = JsonError {
            kind: failure.kind(),
            exit_code: failure.code(),
            message,
        };
        let _ = print_json(&JsonFailure { error });
    }
}

/// Reports the result of a command, waits for pending output and returns the exit code.
pub fn exit_code(result: Result<(), Failure>, as_json: bool) -> ExitCode {
    let code = match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            report_error(&failure, as_json);
            ExitCode::from(&failure)
        }
    };
    flush();
    code
}

#[cfg(test)]
mod tests {
    use super::shortened;

    #[test]
    fn a_long_message_keeps_its_beginning_its_end_and_its_length() {
        let short = "ä".repeat(4000);
        assert_eq!(shortened(short.clone()), short);
        let long = format!("cannot read {}: correct it", "ä".repeat(50_000_000));
        let message = shortened(long);
        assert!(message.chars().count() < 2600, "{} bytes", message.len());
        for part in ["cannot read ä", "(50000024 characters)", "ä: correct it"] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
