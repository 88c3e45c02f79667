//! Runs the program of the crate that is tested, `supple` or `supple-report`.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program.
pub const PROGRAM: &str = match option_env!("CARGO_BIN_EXE_supple") {
    Some(operator) => operator,
    None => match option_env!("CARGO_BIN_EXE_supple-report") {
        Some(report) => report,
        None => panic!("neither supple nor supple-report is built"),
    },
};

/// Returns the command with these arguments, not yet started.
pub fn program(args: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(args);
    command
}

/// Exit code and output of a run.
pub struct Answer {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for Answer {
    fn from(output: Output) -> Answer {
        Answer {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("standard output is text"),
            stderr: String::from_utf8(output.stderr).expect("standard error is text"),
        }
    }
}

/// Runs the program until it exits.
pub fn run(args: &[&str]) -> Answer {
    program(args).output().expect("the binary starts").into()
}

/// A path as an argument.
pub fn arg(path: &Path) -> &str {
    path.to_str().expect("a path of the tests is text")
}

/// Lists all files below a folder, relative to it, including hidden files.
pub fn tree(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).expect("the folder exists") {
            let path = entry.expect("the entry can be read").path();
            found.push(path.strip_prefix(folder).expect("below it").to_owned());
            if path.is_dir() {
                open.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Asserts that there is one line that begins with `error:`, without panic and backtrace, and that it contains all
/// `words`.
pub fn assert_one_clear_line(answer: &Answer, words: &[&str]) {
    let lines: Vec<_> = answer.stderr.lines().collect();
    let errors: Vec<_> = lines
        .iter()
        .filter(|line| line.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "one error: {}", answer.stderr);
    for gone in ["panicked", "backtrace", "RUST_BACKTRACE"] {
        assert!(!answer.stderr.contains(gone), "{}", answer.stderr);
    }
    for word in words {
        assert!(errors[0].contains(word), "{word} in {}", errors[0]);
    }
}

/// Runs the program in a folder.
pub fn run_in(folder: &Path, args: &[&str]) -> Answer {
    let output = program(args)
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .output();
    output.expect("it starts").into()
}

/// Creates a FIFO.
#[cfg(unix)]
pub fn fifo(path: &Path) {
    let made = std::process::Command::new("mkfifo").arg(path).status();
    assert!(made.expect("mkfifo exists").success());
}
