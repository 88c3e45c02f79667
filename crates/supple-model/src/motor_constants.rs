//! What the registers of an arm's motors state about their torque, in a file from the program on the bus to a calibration.

use crate::error::ModelError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Maximum size of the file.
const MAX_BYTES: u64 = 64 * 1024;

/// Registers 1, 16, 19 and 20 of the motor of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorConstants {
    /// Name of the joint.
    pub joint: String,
    /// Type of the motor in the arm's TOML.
    pub model: String,
    /// Register 1: torque over current; zero if it follows from the others \[N m/A\].
    pub kt_nm_per_a: f64,
    /// Register 16.
    pub pole_pairs: u32,
    /// Register 19 \[Wb\].
    pub flux_wb: f64,
    /// Register 20.
    pub gear_ratio: f64,
    /// Torque of the shaft over current by these registers \[N m/A\].
    pub torque_constant_nm_per_a: f64,
}

#[derive(Serialize, Deserialize)]
struct File {
    motors: Vec<MotorConstants>,
}

impl MotorConstants {
    /// Writes the motors of an arm, from the base to the tip.
    ///
    /// # Errors
    /// [`ModelError::Write`].
    pub fn write(path: &Path, motors: Vec<MotorConstants>) -> Result<(), ModelError> {
        let text = toml::to_string(&File { motors }).map_err(|error| ModelError::Syntax {
            file: path.display().to_string(),
            message: error.to_string(),
            remedy: "report this error",
        })?;
        supple_files::write_atomic(path, text.as_bytes()).map_err(|error| ModelError::Write {
            file: path.display().to_string(),
            error,
        })
    }

    /// Reads the motors that [`MotorConstants::write`] wrote.
    ///
    /// # Errors
    /// If there is no such file, or it is not one of these.
    pub fn read(path: &Path) -> Result<Vec<MotorConstants>, ModelError> {
        let text = supple_files::read_text(path, MAX_BYTES).map_err(|error| ModelError::Read {
            file: path.display().to_string(),
            error,
            remedy: "start the system, which writes it",
        })?;
        let file: File = toml::from_str(&text).map_err(|error| ModelError::Syntax {
            file: path.display().to_string(),
            message: error.to_string(),
            remedy: "restart the system, which writes it",
        })?;
        Ok(file.motors)
    }
}
