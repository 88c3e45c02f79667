//! Writes a short log of the four-joint arm: `cargo run -p supple-log --example sample_log -- run.mcap`.

#[path = "../tests/common/mod.rs"]
mod common;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("usage: sample_log <file.mcap>");
        return ExitCode::from(2);
    };
    match common::write(&path, common::STEPS) {
        Ok(written) => {
            println!(
                "{}: {} messages in {} chunks, {} bytes",
                written.path.display(),
                written.messages,
                written.chunks,
                written.bytes
            );
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
