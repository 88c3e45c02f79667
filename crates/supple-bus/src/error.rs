//! Errors of opening and using a bus.

use std::io;
use std::path::PathBuf;

/// Error in opening or using a bus. Conditions that a CAN controller reports are [`crate::BusFault`]s instead.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The transmit queue is full.
    #[error(
        "the transmit queue is full: frames are queued faster than the bus sends them, or the bus sends nothing"
    )]
    Full,
    /// A CAN FD frame cannot be sent on an interface that carries classic frames only.
    #[error(
        "CAN interface `{interface}` carries classic frames only, but a CAN FD frame was to be sent: set it to \
         CAN FD (ip link set {interface} type can bitrate 1000000 dbitrate 5000000 fd on), or set the arm's motors and \
         its TOML to classic CAN"
    )]
    ClassicOnly {
        /// Name of the interface.
        interface: String,
    },
    /// A CAN interface cannot be opened.
    #[error("CAN interface `{interface}`: {source}; {remedy}")]
    Interface {
        /// Requested name.
        interface: String,
        /// Error of the kernel.
        source: io::Error,
        /// Remedy.
        remedy: &'static str,
    },
    /// A folder or socket cannot be created or used, or other users can access it.
    #[error("{} {problem}; {remedy}", path.display())]
    Folder {
        /// The folder or socket.
        path: PathBuf,
        /// The problem.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Another process already has this socket open.
    #[error("{} is in use by a running process: end that process, or choose another folder", path.display())]
    SocketInUse {
        /// The socket.
        path: PathBuf,
    },
    /// The other side of an emulated bus does not answer.
    #[error(
        "{} does not answer: start the emulator first (with --virtual-time if the host runs with it), or check \
         whether it has ended",
        path.display()
    )]
    NoPeer {
        /// The socket.
        path: PathBuf,
    },
    /// A system call on an open bus failed.
    #[error("{action} failed: {source}")]
    Io {
        /// Attempted action.
        action: &'static str,
        /// Error of the kernel.
        source: io::Error,
    },
}

impl BusError {
    pub(crate) fn io(action: &'static str) -> impl Fn(rustix::io::Errno) -> BusError {
        move |errno| BusError::Io {
            action,
            source: errno.into(),
        }
    }
}
