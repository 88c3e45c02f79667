//! Errors that end a procedure early. Each message states a remedy.

use crate::error::ExperimentError;
use std::path::PathBuf;

/// Error of the procedure.
#[derive(Debug, thiserror::Error)]
pub enum ProcedureError {
    /// Design, model or simulated arm.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The motors, encoders and joints do not belong together as the description states.
    #[error("{problem}: {remedy}; then start again (a calibration continues with --resume)")]
    Wiring {
        /// Finding, with the joint.
        problem: String,
        /// Remedy.
        remedy: String,
    },
    /// The operator did not confirm the space that the arm sweeps.
    #[error(
        "the motion was not confirmed: look at {}, clear that space, and start again with --yes (a calibration with --resume --yes)",
        drawing.display()
    )]
    NotConfirmed {
        /// Drawing of the space.
        drawing: PathBuf,
    },
    /// A fault stopped a motion, and repeating the motion is not safe or did not help.
    #[error(
        "{motion}: stopped by a fault: {fault}; {remedy}, then start again (a calibration continues with --resume)"
    )]
    Stopped {
        /// Name of the motion.
        motion: String,
        /// The fault.
        fault: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The file of finished steps cannot be used.
    #[error("{}: {problem}; start again without --resume, or with another --out", file.display())]
    Resume {
        /// The file.
        file: PathBuf,
        /// Problem.
        problem: String,
    },
    /// A log of the procedure cannot be read.
    #[error("cannot read {}: {problem}; start again without --resume, or with another --out", file.display())]
    ReadLog {
        /// The file.
        file: PathBuf,
        /// Problem.
        problem: String,
    },
    /// The weight needs more torque than the joint has.
    #[error(
        "a weight of {weight_kg} kg needs {torque_nm:.1} N m at {joint} in the motion with it, of {limit_nm} N m: give a lighter one \
         with --weight-kg"
    )]
    HeavyWeight {
        /// The weight \[kg\].
        weight_kg: f64,
        /// Name of the joint.
        joint: String,
        /// Torque that the joint needs \[N m\].
        torque_nm: f64,
        /// Its torque limit \[N m\].
        limit_nm: f64,
    },
    /// Nobody attached the weight.
    #[error("no weight was attached: continue with --resume and --weight-kg when it is at hand")]
    NoWeight,
    /// A result cannot be written.
    #[error("cannot write {}: {error}; choose a writable folder with --out", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
}

impl From<supple_ident::IdentError> for ProcedureError {
    fn from(error: supple_ident::IdentError) -> Self {
        ExperimentError::from(error).into()
    }
}

impl From<supple_ident::SaveError> for ProcedureError {
    fn from(error: supple_ident::SaveError) -> Self {
        ExperimentError::from(error).into()
    }
}

impl From<supple_model::ModelError> for ProcedureError {
    fn from(error: supple_model::ModelError) -> Self {
        ExperimentError::from(error).into()
    }
}

impl From<supple_core::ArmError> for ProcedureError {
    fn from(error: supple_core::ArmError) -> Self {
        ExperimentError::from(error).into()
    }
}

impl From<supple_core::controller::ConfigError> for ProcedureError {
    fn from(error: supple_core::controller::ConfigError) -> Self {
        ExperimentError::from(error).into()
    }
}

impl From<supple_log::LogError> for ProcedureError {
    fn from(error: supple_log::LogError) -> Self {
        ExperimentError::from(error).into()
    }
}
