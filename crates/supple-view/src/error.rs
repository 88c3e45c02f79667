//! Errors of serving the page.

use std::io;
use supple_ipc::IpcError;
use supple_log::LogError;
use supple_model::ModelError;

/// Error: the page cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The arm's description is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system cannot be joined.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The port cannot be opened, or the kernel provides no random numbers or thread for the server.
    #[error(
        "cannot listen on 127.0.0.1:{port}: {error}; give another port with --port, or omit --port for a free one"
    )]
    Listen {
        /// The port; 0 for a free one.
        port: u16,
        /// Error of the operating system.
        error: io::Error,
    },
    /// A snapshot cannot be represented as JSON; this is a bug.
    #[error("a snapshot cannot be encoded: {0}")]
    Encode(#[from] serde_json::Error),
}
