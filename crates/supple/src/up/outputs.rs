//! Checks the files that a run will write, before any process or file is created.
//!
//! A log is written as `NAME.part` and renamed at the end; it would overwrite a trace with either name without a message.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_files::{check_output, open_output, with_suffix};

/// The log of a run that names none.
pub const DEFAULT_LOG: &str = "out/up.mcap";
/// The log of the run before that.
const PREVIOUS_LOG: &str = "out/up.previous.mcap";
/// Suffix of a log that is being written.
const PART: &str = ".part";

/// Keeps the default log of the run before under another name.
pub fn keep_previous_log() {
    let log = Path::new(DEFAULT_LOG);
    if !log.is_file() {
        return;
    }
    print_status(&match std::fs::rename(log, PREVIOUS_LOG) {
        Ok(()) => format!("the log of the run before is {PREVIOUS_LOG}"),
        Err(error) => format!(
            "warning: {DEFAULT_LOG} will be replaced, since it cannot become {PREVIOUS_LOG}: {error}"
        ),
    });
}

/// Checks that both files can be written and that no log replaces the trace.
///
/// # Errors
/// [`Failure::File`], [`Failure::SameOutput`], [`Failure::OutputInUse`].
pub fn check(log: Option<&Path>, trace: Option<&Path>) -> Result<(), Failure> {
    if let Some(log) = log {
        check_output(log).map_err(|error| Failure::file("write", log, error))?;
    }
    let Some(trace) = trace else {
        return Ok(());
    };
    check_output(trace).map_err(|error| Failure::file("write", trace, error))?;
    if let Some(log) = log
        && [log.to_owned(), with_suffix(log, PART)]
            .iter()
            .any(|name| is_same(name, trace))
    {
        return Err(Failure::SameOutput {
            trace: trace.to_owned(),
            log: log.to_owned(),
        });
    }
    for name in [trace.to_owned(), with_suffix(trace, PART)] {
        if is_being_written(&name) {
            return Err(Failure::OutputInUse {
                trace: trace.to_owned(),
                log: name,
            });
        }
    }
    check_writable(trace).map_err(|error| Failure::File {
        action: "create",
        path: trace.to_owned(),
        error,
        remedy: "give --trace a file in a folder that exists and can be written",
    })
}

/// Whether both paths name the same file, which may not exist.
fn is_same(one: &Path, other: &Path) -> bool {
    match (resolved(one), resolved(other)) {
        (Some(one), Some(other)) => one == other,
        _ => false,
    }
}

/// Returns the path without symbolic links and `.`; `None` if its folder does not exist.
fn resolved(path: &Path) -> Option<PathBuf> {
    if let Ok(path) = path.canonicalize() {
        return Some(path);
    }
    let folder = match path.parent()? {
        folder if folder.as_os_str().is_empty() => Path::new("."),
        folder => folder,
    };
    Some(folder.canonicalize().ok()?.join(path.file_name()?))
}

/// Whether a writer of logs holds its lock on the file.
fn is_being_written(path: &Path) -> bool {
    check_output(path).is_ok()
        && File::open(path)
            .is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Opens the file as its writer will; removes it if it did not exist.
fn check_writable(path: &Path) -> io::Result<()> {
    let exists = path.symlink_metadata().is_ok();
    open_output(path)?;
    match exists {
        true => Ok(()),
        false => std::fs::remove_file(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    fn message(log: Option<&Path>, trace: &Path) -> String {
        let failure = check(log, Some(trace)).expect_err("refused");
        assert_eq!(failure.code(), 6, "{failure}");
        failure.to_string()
    }

    #[test]
    fn a_trace_in_the_place_of_the_log_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).expect("made");
        symlink(folder.path(), at("link")).expect("made");
        let log = at("run.mcap");
        for exists in [false, true] {
            for trace in [
                "run.mcap",
                "./run.mcap",
                "sub/../run.mcap",
                "link/run.mcap",
                "run.mcap.part",
            ] {
                let words = message(Some(&log), &at(trace));
                for part in ["--trace", "--log", "different names"] {
                    assert!(words.contains(part), "{words}");
                }
            }
            check(Some(&log), Some(&at("trace.csv"))).expect("two files");
            assert!(!at("trace.csv").exists(), "no file is left");
            if !exists {
                std::fs::write(&log, "an older log").expect("written");
            }
        }
        symlink(&log, at("to_log")).expect("made");
        message(Some(&log), &at("to_log"));
        assert_eq!(std::fs::read(&log).expect("there"), b"an older log");
    }

    #[test]
    fn a_trace_in_the_place_of_a_log_that_is_being_written_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let part = File::create(at("run.mcap.part")).expect("created");
        // A file that a crashed writer left is not locked.
        check(None, Some(&at("run.mcap"))).expect("no writer");
        part.lock().expect("locked");
        for trace in ["run.mcap", "run.mcap.part"] {
            let words = message(None, &at(trace));
            assert!(words.contains("run.mcap.part"), "{words}");
        }
    }

    #[test]
    fn a_trace_that_cannot_be_written_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let trace = folder.path().join("none/trace.csv");
        let words = message(None, &trace);
        for part in ["none/trace.csv", "a folder that exists"] {
            assert!(words.contains(part), "{words}");
        }
        assert!(!trace.parent().expect("a folder").exists());
    }
}
