//! The backend of a type of drives, as the registry lists it.

use crate::options::Options;
use supple_drive::Counters;
use supple_model::Description;
use supple_process::Failure;
use supple_realtime::Stop;

/// The backend of a type of drives.
#[derive(Clone, Copy, Debug)]
pub struct DriveBackend {
    /// Its name, as in `[bus] kind` of an arm's TOML.
    pub name: &'static str,
    /// Whether an arm has these drives.
    pub supports: fn(&Description) -> bool,
    /// Runs an arm until the end of the program and returns the counters of the run; `None` if only the budget of the bus was
    /// requested, or a shutdown before start-up was complete.
    pub run: fn(&Description, &Options, &Stop) -> Result<Option<Counters>, Failure>,
}
