//! The backend of a type of drives, as the registry lists it.

use crate::options::Options;
use supple_drive::Counters;
use supple_model::Description;
use supple_realtime::Stop;

/// The backend of a type of drives.
#[derive(Clone, Copy, Debug)]
pub struct DriveBackend {
    /// Its name, as in `[bus] kind` of an arm's TOML.
    pub name: &'static str,
    /// Whether an arm has these drives.
    pub supports: fn(&Description) -> bool,
    /// Runs an arm until the end of the program and returns the counters of the run; `None` if only the budget of the bus was requested.
    pub run: fn(&Description, &Options, &Stop) -> Result<Option<Counters>, RunError>,
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A shutdown was requested before start-up was complete.
    #[error("stopped before start-up was complete")]
    Stopped,
    /// An error, with the exit code of the program.
    #[error("{source}")]
    Failed {
        /// Exit code, as for the command line.
        code: u8,
        /// The error.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl RunError {
    /// An error with the exit code of the program.
    pub fn new(code: u8, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> RunError {
        RunError::Failed {
            code,
            source: source.into(),
        }
    }
}
