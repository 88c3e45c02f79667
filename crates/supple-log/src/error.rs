//! Errors of writing and reading logs.

use std::io;

/// Error of writing or reading a log. Every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file could not be created.
    #[error(
        "cannot create {file}: {source}; choose a folder that exists and can be written, and the name of a regular file"
    )]
    Create {
        /// File.
        file: String,
        /// Cause.
        source: io::Error,
    },
    /// Another process writes a log of this name.
    #[error("{file} is being written by another process; choose another name or wait for it")]
    Busy {
        /// File.
        file: String,
    },
    /// The file could not be written completely; the written part stays under this name.
    #[error(
        "cannot write {file}: {source}; free disk space and run again; the file is incomplete, `supple log \
         recover` keeps its complete part"
    )]
    Write {
        /// File.
        file: String,
        /// Cause.
        source: io::Error,
    },
    /// The file could not be read.
    #[error("cannot read {file}: {source}")]
    Read {
        /// File.
        file: String,
        /// Cause.
        source: io::Error,
    },
    /// The file is truncated or damaged.
    #[error(
        "{file} is incomplete ({cause}, after {kept_bytes} valid bytes); `supple log recover` keeps \
         the complete part"
    )]
    Incomplete {
        /// File.
        file: String,
        /// Problem at which reading stopped.
        cause: String,
        /// Valid bytes before it.
        kept_bytes: u64,
    },
    /// The file has no bytes.
    #[error("{file} is empty: no log was written to it; give another file, or repeat the run")]
    Empty {
        /// File.
        file: String,
    },
    /// Not a log of this crate, or a log of another version.
    #[error("{file}: {message}; it is not a log of supple, or one of another version")]
    Format {
        /// File.
        file: String,
        /// Problem, with the element.
        message: String,
    },
    /// The file contains no complete chunk.
    #[error(
        "nothing to recover from {file}: its {bytes} bytes contain no complete chunk; the run must be \
         repeated"
    )]
    NoCompleteChunk {
        /// File.
        file: String,
        /// Length of the file.
        bytes: u64,
    },
    /// The output would replace the log from which it is made.
    #[error("the output would replace its own input {file}; give the output another name")]
    SameFile {
        /// File.
        file: String,
    },
    /// The log is of an arm with another number of joints.
    #[error("{file}: expected {expected} joints, the log has {found}")]
    JointCount {
        /// File.
        file: String,
        /// Expected number of joints.
        expected: usize,
        /// Number of joints in the log.
        found: usize,
    },
    /// Steps of the controller are missing.
    #[error(
        "{file}: expected step {expected}, the log continues with step {found}; the controller state \
         after the gap is unknown, so only logs without gaps can be replayed"
    )]
    Gap {
        /// File.
        file: String,
        /// First missing step.
        expected: u64,
        /// Step found instead.
        found: u64,
    },
    /// Unknown channel.
    #[error("{file} has no channel {channel:?}; it has {known}")]
    UnknownChannel {
        /// File.
        file: String,
        /// Requested channel.
        channel: String,
        /// Existing channels.
        known: String,
    },
    /// The export could not be written.
    #[error("cannot write the export: {0}")]
    Output(#[source] io::Error),
    /// The description of the arm in the log is invalid.
    #[error(transparent)]
    Model(#[from] supple_model::ModelError),
}
