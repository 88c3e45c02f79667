//! Why the controller's process ends.

use supple_core::controller::ConfigError;
use supple_ipc::IpcError;
use supple_ipc::message::MessageError;
use supple_model::ModelError;
use supple_realtime::{NotifyError, StopError};

/// Why the process cannot start, or cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RtError {
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The configuration.
    #[error("the controller's configuration: {0}")]
    Config(#[from] ConfigError),
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// An arm state of another arm.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// Signals.
    #[error(transparent)]
    Stop(#[from] StopError),
    /// The service manager.
    #[error(transparent)]
    Notify(#[from] NotifyError),
    /// The helper's thread.
    #[error("no second thread can be started: {0}; raise the user's limit of processes")]
    Thread(std::io::Error),
    /// The helper ended by a defect.
    #[error("the helper's thread ended by a defect: please report it")]
    Helper,
}

impl RtError {
    /// Exit code, as the command line has them: 3 a wrong arm, 10 shared memory, 1 a defect or the system.
    pub fn code(&self) -> u8 {
        match self {
            RtError::Model(_) | RtError::Config(_) => 3,
            RtError::Ipc(_) | RtError::Message(_) => 10,
            RtError::Stop(_) | RtError::Notify(_) | RtError::Thread(_) | RtError::Helper => 1,
        }
    }
}
