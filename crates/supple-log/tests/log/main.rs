//! Logs: writing, reading, recovery, tables, replay.

#[path = "../common/mod.rs"]
mod common;

mod codes;
mod export;
mod hostile;
mod incomplete_files;
mod python_readers;
mod recover;
mod replay;
mod round_trip;
mod terms;
