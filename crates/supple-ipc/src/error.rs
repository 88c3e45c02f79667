//! Why two processes cannot talk.

use crate::message::MessageError;
use std::path::PathBuf;

/// Why shared memory cannot be set up or used.
#[derive(Debug, thiserror::Error)]
pub enum IpcError {
    /// A prefix that cannot be part of a file name.
    #[error(
        "the prefix `{found}` cannot be used: give 1 to 32 of a-z, 0-9, `-` and `_` with --prefix or \
         SUPPLE_PREFIX"
    )]
    Prefix {
        /// What was given.
        found: String,
    },
    /// The folder for sockets and service files.
    #[error("the folder {} cannot be used: {cause}; {remedy}", folder.display())]
    Folder {
        /// Which.
        folder: PathBuf,
        /// Why.
        cause: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// Another process writes already.
    #[error(
        "{service} has its writer already, under the prefix `{prefix}`: end the other process, or choose \
         another --prefix"
    )]
    SecondWriter {
        /// Name of the service.
        service: String,
        /// The prefix.
        prefix: String,
    },
    /// As many readers as there may be.
    #[error("{service} has all the readers that it may have: end one, such as a `supple status`")]
    TooManyReaders {
        /// Name of the service.
        service: String,
    },
    /// As many of one kind as there may be.
    #[error(
        "all {places} places of {kind} are taken, by processes {holders}: end one, also one that is stopped"
    )]
    NoPlace {
        /// Who takes such places.
        kind: &'static str,
        /// How many there are.
        places: usize,
        /// Numbers of the processes that hold them.
        holders: String,
    },
    /// The other side is of another version.
    #[error(
        "{service} was set up by another version of this software: it carries {expected} here; end all \
         processes under the prefix `{prefix}` and start them from one build"
    )]
    Version {
        /// Name of the service.
        service: String,
        /// Type that this process knows.
        expected: &'static str,
        /// The prefix.
        prefix: String,
    },
    /// No memory for the ports of a process.
    #[error(
        "/dev/shm has {} MB free, {} MB are wanted: remove what is not needed there, or make it larger \
         (mount -o remount,size=256M /dev/shm; for a container --shm-size=256m)",
        free_bytes / 1_000_000, wanted_bytes.div_ceil(1_000_000)
    )]
    NoRoom {
        /// What the process reserves at its start \[bytes\].
        wanted_bytes: u64,
        /// What is there \[bytes\].
        free_bytes: u64,
    },
    /// Somebody else's object under a name of this system.
    #[error(
        "{} belongs to user {owner} and is named as an object of the system `{prefix}`: have it removed, or choose \
         another --prefix", object.display()
    )]
    Foreign {
        /// Which.
        object: PathBuf,
        /// Number of the user.
        owner: u32,
        /// The prefix.
        prefix: String,
    },
    /// What the library reports besides.
    #[error("{service}: {cause}; `ls /dev/shm` shows what is there, a reboot clears it")]
    Service {
        /// Name of the service, or what was tried.
        service: String,
        /// What the library says.
        cause: String,
    },
    /// A message that does not fit.
    #[error(transparent)]
    Message(#[from] MessageError),
}
