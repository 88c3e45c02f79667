//! Why a program ends early.

use core::fmt::{self, Display, Formatter};
use supple_model::ModelError;
use supple_realtime::StopError;

/// Exit code for an invalid arm.
const INVALID_ARM: u8 = 3;
/// Exit code for an error of the operating system.
const SYSTEM: u8 = 1;

/// Why a program ends early, with its exit code.
#[derive(Debug)]
pub struct Failure {
    /// Exit code, as documented for the command line.
    pub code: u8,
    message: String,
}

impl Failure {
    /// An error with the exit code of the program.
    pub fn new(code: u8, error: impl Display) -> Failure {
        Failure {
            code,
            message: error.to_string(),
        }
    }
}

impl Display for Failure {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        out.write_str(&self.message)
    }
}

impl From<ModelError> for Failure {
    fn from(error: ModelError) -> Failure {
        Failure::new(INVALID_ARM, error)
    }
}

impl From<StopError> for Failure {
    fn from(error: StopError) -> Failure {
        Failure::new(SYSTEM, error)
    }
}
