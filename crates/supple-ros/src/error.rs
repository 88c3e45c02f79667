//! Reasons why the bridge ends.

use supple_ipc::IpcError;
use supple_log::LogError;
use supple_model::ModelError;

/// Error of the bridge.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// The arm's description is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A message cannot be encoded.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system cannot be joined.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The definition of a message type cannot be read; this is a bug.
    #[error("definition of {name}: {reason}")]
    Definition {
        /// Message type.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// Zenoh refuses an endpoint, or a key that it does not accept.
    #[error("zenoh, {doing}: {error}; endpoints have the form tcp/127.0.0.1:7447")]
    Zenoh {
        /// What failed.
        doing: String,
        /// Zenoh's error.
        error: zenoh::Error,
    },
}

impl RosError {
    /// Returns the conversion of Zenoh's errors while doing something.
    pub(crate) fn zenoh(doing: impl Into<String>) -> impl FnOnce(zenoh::Error) -> RosError {
        let doing = doing.into();
        move |error| RosError::Zenoh { doing, error }
    }
}
