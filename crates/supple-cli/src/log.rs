//! `supple log`: info, export, replay, recover.

use crate::arguments::LogDataCommand;
use crate::console::{print_json, print_line};
use crate::exit::Failure;
use serde::Serialize;
use std::fs;
use std::io::{BufWriter, ErrorKind, Write};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use supple_files::{check_output, create_output, with_suffix};
use supple_log::{LogError, export_csv, info, recover, refuse_overwriting, replay};

/// File extension of a log that is being written, or whose writer was killed.
const PART: &str = "part";
/// [`PART`] with the dot.
const PART_SUFFIX: &str = ".part";

/// Output of `log export --json`.
#[derive(Serialize)]
struct ExportResult<'a> {
    file: &'a Path,
    channel: &'a str,
    rows: u64,
}

/// Runs `supple log`.
///
/// # Errors
/// [`Failure`].
pub fn run(command: &LogDataCommand) -> Result<(), Failure> {
    match command {
        LogDataCommand::Info { file, json: false } => {
            print_line(read(file, info)?.to_string().trim_end())
        }
        LogDataCommand::Info { file, json: true } => print_json(&read(file, info)?),
        LogDataCommand::Export {
            file,
            channel,
            every,
            out: None,
            ..
        } => export_to_stdout(file, channel, *every),
        LogDataCommand::Export {
            file,
            channel,
            every,
            out: Some(out),
            json,
        } => {
            let rows = export_to_file(file, channel, *every, out)?;
            match json {
                true => print_json(&ExportResult {
                    file: out,
                    channel,
                    rows,
                }),
                false => print_line(&format!("{}: {rows} rows", out.display())),
            }
        }
        LogDataCommand::Replay { file, json } => {
            let replay = read(file, replay)?;
            match json {
                true => print_json(&replay)?,
                false => print_line(&replay.to_string())?,
            }
            match replay.different_steps {
                0 => Ok(()),
                different => Err(Failure::ReplayMismatch {
                    path: file.clone(),
                    different,
                    steps: replay.steps,
                }),
            }
        }
        LogDataCommand::Recover {
            from,
            to,
            force,
            json,
        } => {
            let to = to.clone().unwrap_or_else(|| recovered_name(from));
            if to.exists() && !force {
                return Err(Failure::Exists { path: to });
            }
            let recovery = recover(from, &to)?;
            match json {
                true => print_json(&recovery),
                false => print_line(&recovery.to_string()),
            }
        }
    }
}

fn read<T>(file: &Path, reader: impl Fn(&Path) -> Result<T, LogError>) -> Result<T, Failure> {
    reader(file).map_err(|error| failure(file, error))
}

/// Converts the error of a log. If the log is missing but its incomplete file exists, the error names that file.
fn failure(file: &Path, error: LogError) -> Failure {
    let part = with_suffix(file, PART_SUFFIX);
    if file.exists() || !part.exists() {
        return error.into();
    }
    Failure::UnfinishedLog {
        log: file.to_owned(),
        part,
    }
}

fn export_to_stdout(file: &Path, channel: &str, every: NonZeroU64) -> Result<(), Failure> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    match export_csv(file, channel, every, &mut out) {
        // A closed pipe is not an error.
        Err(LogError::Output(error)) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(failure(file, error)),
        Ok(_) => Ok(()),
    }
}

/// Writes the table to a temporary file and renames it when it is complete. Returns the number of rows.
fn export_to_file(
    file: &Path,
    channel: &str,
    every: NonZeroU64,
    out: &Path,
) -> Result<u64, Failure> {
    refuse_overwriting(file, out, PART_SUFFIX).map_err(|error| failure(file, error))?;
    let part = with_suffix(out, PART_SUFFIX);
    let failed = |action, error| Failure::file(action, out, error);
    let created = check_output(out).and_then(|()| create_output(&part));
    let mut table = BufWriter::new(created.map_err(|error| failed("create", error))?);
    let written = export_csv(file, channel, every, &mut table)
        .map_err(|error| match error {
            LogError::Output(error) => failed("write", error),
            error => failure(file, error),
        })
        .and_then(|rows| {
            let whole = table
                .flush()
                .and_then(|()| table.get_ref().sync_all())
                .and_then(|()| fs::rename(&part, out));
            whole.map(|()| rows).map_err(|error| failed("write", error))
        });
    written.inspect_err(|_| {
        let _ = fs::remove_file(&part);
    })
}

/// Returns the name of the recovered log: `run.mcap` and `run.mcap.part` become `run.recovered.mcap`.
fn recovered_name(from: &Path) -> PathBuf {
    let named = match from.extension() {
        Some(ending) if ending == PART => from.with_extension(""),
        _ => from.to_owned(),
    };
    named.with_extension("recovered.mcap")
}

#[cfg(test)]
mod tests {
    use super::recovered_name;
    use std::path::Path;

    #[test]
    fn a_recovered_log_gets_another_name() {
        for from in ["a/run.mcap", "a/run.mcap.part"] {
            let to = recovered_name(Path::new(from));
            assert_eq!(to, Path::new("a/run.recovered.mcap"));
        }
    }
}
