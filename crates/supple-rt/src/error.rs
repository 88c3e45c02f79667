//! Errors of the controller's process.

use supple_core::controller::ConfigError;
use supple_ipc::IpcError;
use supple_ipc::message::MessageError;
use supple_model::ModelError;
use supple_process::Failure;
use supple_realtime::NotifyError;

/// Why the process cannot start or continue.
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
    /// The arm state is of another arm.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The service manager.
    #[error(transparent)]
    Notify(#[from] NotifyError),
    /// A thread could not be started.
    #[error("the thread cannot be started: {0}; raise the user's limit of processes")]
    Thread(std::io::Error),
    /// The helper thread panicked.
    #[error("the helper thread panicked: please report this bug")]
    Helper,
}

impl RtError {
    /// Exit code, as documented for the command line: 3 invalid arm, 10 shared memory, 1 a bug or a system error.
    pub fn code(&self) -> u8 {
        match self {
            RtError::Model(_) | RtError::Config(_) => 3,
            RtError::Ipc(_) | RtError::Message(_) => 10,
            RtError::Notify(_) | RtError::Thread(_) | RtError::Helper => 1,
        }
    }
}

impl From<RtError> for Failure {
    fn from(error: RtError) -> Failure {
        Failure::new(error.code(), error)
    }
}
