//! Why a log could not be written or read.

use std::io;

/// Why a log could not be written or read. Every message names the file.
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
    /// The file could not be written to its end; what was written stays under this name.
    #[error(
        "cannot write {file}: {source}; make room and run again, the file is incomplete and `supple log \
         recover` keeps what is whole in it"
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
    /// The file ends before its end, or is damaged.
    #[error(
        "{file} is incomplete ({cause}, after {kept_bytes} whole bytes); `supple log recover` keeps \
         what is whole"
    )]
    Incomplete {
        /// File.
        file: String,
        /// What was wrong where it stopped.
        cause: String,
        /// Bytes up to there.
        kept_bytes: u64,
    },
    /// Not a log that this crate wrote, or one of another version.
    #[error("{file}: {message}; it is not a log of supple, or one of another version")]
    Format {
        /// File.
        file: String,
        /// What is wrong, with the element.
        message: String,
    },
    /// Not a single whole chunk.
    #[error(
        "nothing to recover from {file}: not one chunk of its {bytes} bytes is whole; the run must be \
         repeated"
    )]
    NothingWhole {
        /// File.
        file: String,
        /// Its length.
        bytes: u64,
    },
    /// The recovered file would replace the one that it comes from.
    #[error("{file} cannot be recovered onto itself; give the result another name")]
    SameFile {
        /// File.
        file: String,
    },
    /// The log is of an arm with another number of joints.
    #[error("{file}: expected {expected} joints, the log has {found}")]
    JointCount {
        /// File.
        file: String,
        /// Joints expected.
        expected: usize,
        /// Joints found.
        found: usize,
    },
    /// Steps of the controller are missing.
    #[error(
        "{file}: expected step {expected}, the log goes on with step {found}; what the controller \
         knew after the gap is not in the log, so only a log without gaps is replayed"
    )]
    Gap {
        /// File.
        file: String,
        /// First step that is missing.
        expected: u64,
        /// Step found in its place.
        found: u64,
    },
    /// No such channel.
    #[error("{file} has no channel {channel:?}; it has {known}")]
    UnknownChannel {
        /// File.
        file: String,
        /// Channel asked for.
        channel: String,
        /// Channels there are.
        known: String,
    },
    /// What was exported could not be written on.
    #[error("cannot write the export: {0}")]
    Output(#[source] io::Error),
    /// What the log says of the arm is not sound.
    #[error(transparent)]
    Model(#[from] supple_model::ModelError),
}
