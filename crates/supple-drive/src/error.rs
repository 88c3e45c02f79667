//! Errors that end the plant loop.

use supple_bus::BusError;

/// The loop cannot continue. What happens on a bus, or to a motor, is no error: the guard handles it.
#[derive(Debug, thiserror::Error)]
pub enum LoopError {
    /// The bus itself.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The link to the controller.
    #[error("shared memory: {0}")]
    Link(Box<dyn std::error::Error + Send + Sync>),
    /// The drives, for a reason of their own.
    #[error(transparent)]
    Drive(Box<dyn std::error::Error + Send + Sync>),
}
