//! Recovers a log: `cargo run -p supple-log --example recover_log -- truncated.mcap recovered.mcap`.

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(from), Some(to)) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: recover_log <cut.mcap> <whole.mcap>");
        return ExitCode::from(2);
    };
    match supple_log::recover(&from, &to) {
        Ok(recovery) => {
            println!("{recovery}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
