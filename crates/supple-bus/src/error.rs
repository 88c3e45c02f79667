//! Why a bus cannot be opened or used.

use std::io;
use std::path::PathBuf;

/// The bus itself is not there, or not usable. What goes wrong on it is a [`crate::BusFault`].
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// No room for another frame.
    #[error("the transmit queue is full: the bus carries less than is sent, or nothing leaves")]
    Full,
    /// A CAN interface that cannot be opened.
    #[error("CAN interface `{interface}`: {source}; {remedy}")]
    Interface {
        /// Name asked for.
        interface: String,
        /// What the kernel says.
        source: io::Error,
        /// What to do.
        remedy: &'static str,
    },
    /// A folder or socket that is not the owner's alone.
    #[error("{} {problem}; {remedy}", path.display())]
    Folder {
        /// The folder or socket.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Another process is this node already.
    #[error("{} belongs to a process that is running: end it, or choose another folder", path.display())]
    Taken {
        /// The socket.
        path: PathBuf,
    },
    /// The other side of a bus in virtual time does not answer.
    #[error("{} does not answer: start the emulator in virtual time first, or it has ended", path.display())]
    NoPeer {
        /// The socket.
        path: PathBuf,
    },
    /// The kernel refuses a call on an open bus.
    #[error("{action} failed: {source}")]
    Io {
        /// What was attempted.
        action: &'static str,
        /// What the kernel says.
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
