//! Errors that end the plant loop.

use supple_bus::BusError;

/// Error: the plant loop cannot continue. A fault on the bus or of a motor is not such an error: the guard handles it.
#[derive(Debug, thiserror::Error)]
pub enum LoopError {
    /// The bus itself failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The link to the controller failed.
    #[error("shared memory: {0}")]
    Link(Box<dyn std::error::Error + Send + Sync>),
    /// The drives failed for a reason that only their type has.
    #[error(transparent)]
    Drive(Box<dyn std::error::Error + Send + Sync>),
}
