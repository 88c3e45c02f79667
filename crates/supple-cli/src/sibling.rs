//! Paths of other programs that are installed in the same folder.

use crate::exit::Failure;
use std::path::{Path, PathBuf};

/// Program that runs the commands that draw figures.
pub const REPORT: &str = "supple-report";

/// Returns the path of a program in the folder of this program.
///
/// # Errors
/// [`Failure::MissingProgram`]; [`Failure::File`] if the path of this program is unknown.
pub fn program_beside(name: &'static str) -> Result<PathBuf, Failure> {
    let this = std::env::current_exe()
        .map_err(|error| Failure::file("find", Path::new("this program"), error))?;
    let program = this.with_file_name(name);
    match program.is_file() {
        true => Ok(program),
        false => Err(Failure::MissingProgram { name, program }),
    }
}

/// Returns the Python interpreter of the environment in which this program is installed, otherwise the one in PATH.
pub fn python() -> PathBuf {
    const NAME: &str = "python3";
    let beside = std::env::current_exe().map(|this| this.with_file_name(NAME));
    let found = beside.ok().filter(|program| program.is_file());
    found.unwrap_or_else(|| PathBuf::from(NAME))
}
