//! Errors of the communication between processes.

use crate::message::MessageError;
use std::path::PathBuf;

/// Error of setting up or using shared memory.
#[derive(Debug, thiserror::Error)]
pub enum IpcError {
    /// The prefix cannot be part of a file name.
    #[error(
        "the prefix `{found}` cannot be used: give 1 to 32 of a-z, 0-9, `-` and `_` with --prefix or \
         SUPPLE_PREFIX"
    )]
    Prefix {
        /// Prefix that was given.
        found: String,
    },
    /// The folder for sockets and service files, or an object in it, cannot be used.
    #[error("the folder {} cannot be used: {cause}; {remedy}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Cause.
        cause: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Another process is already the writer of this service.
    #[error(
        "another process already writes {service} under the prefix `{prefix}`: end that process, or choose another \
         --prefix"
    )]
    SecondWriter {
        /// Name of the service.
        service: String,
        /// The prefix.
        prefix: String,
    },
    /// The maximum number of readers is connected.
    #[error(
        "{service} has the maximum number of readers: end one of them, such as a `supple status`"
    )]
    TooManyReaders {
        /// Name of the service.
        service: String,
    },
    /// All slots of one kind of client are in use.
    #[error(
        "all {slots} slots for {kind} are in use by processes {holders}: end one of them (a stopped process \
         holds its slot too)"
    )]
    NoFreeSlot {
        /// Kind of client.
        kind: &'static str,
        /// Number of slots.
        slots: usize,
        /// Ids of the processes that hold them.
        holders: String,
    },
    /// Another process uses another version of the message type.
    #[error(
        "{service} was created by another version of this software (this version expects the type {expected}); \
         end all processes under the prefix `{prefix}` and start them from one build"
    )]
    Version {
        /// Name of the service.
        service: String,
        /// Message type of this process.
        expected: &'static str,
        /// The prefix.
        prefix: String,
    },
    /// The free shared memory is not enough for the ports of a process.
    #[error(
        "/dev/shm has {} MB free, {} MB are needed: delete unused files there, or enlarge it \
         (mount -o remount,size=256M /dev/shm; for a container --shm-size=256m)",
        free_bytes / 1_000_000, needed_bytes.div_ceil(1_000_000)
    )]
    SharedMemoryFull {
        /// Memory that the process allocates at its start \[bytes\].
        needed_bytes: u64,
        /// Free memory \[bytes\].
        free_bytes: u64,
    },
    /// A shared-memory object with this system's prefix in its name belongs to another user.
    #[error(
        "{} belongs to user {owner} but has the name of an object of the system `{prefix}`: ask that user to \
         remove it, or choose another --prefix", object.display()
    )]
    Foreign {
        /// The object.
        object: PathBuf,
        /// User id.
        owner: u32,
        /// The prefix.
        prefix: String,
    },
    /// Any other error of iceoryx2.
    #[error(
        "{service}: {cause}; `ls /dev/shm` lists the shared-memory objects, a reboot removes them"
    )]
    Service {
        /// Name of the service or the operation.
        service: String,
        /// Error of iceoryx2.
        cause: String,
    },
    /// A message is for another arm, or is invalid.
    #[error(transparent)]
    Message(#[from] MessageError),
}

/// Creates the error of a service from an error of iceoryx2 or of the operating system.
pub(crate) fn failed(service: &str, cause: &dyn core::fmt::Display) -> IpcError {
    IpcError::Service {
        service: service.to_owned(),
        cause: cause.to_string(),
    }
}
