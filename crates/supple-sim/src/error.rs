//! Errors of the simulation process.

use supple_drive::{LoopError, Overload};
use supple_ipc::IpcError;
use supple_model::ModelError;
use supple_plant::{InjectionError, PlantError, SimulationArgsError, TraceError};
use supple_process::Failure;

/// Why the process cannot start or continue.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The plant.
    #[error("the plant: {0}")]
    Plant(#[from] PlantError),
    /// Invalid options of the plant.
    #[error(transparent)]
    Options(#[from] SimulationArgsError),
    /// An invalid fault injection.
    #[error("--inject: {0}")]
    Injection(#[from] InjectionError),
    /// The trace file.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// Shared memory.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// The plant loop cannot continue.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// The period is too short.
    #[error(transparent)]
    Rate(#[from] Box<Overload>),
}

impl SimError {
    /// Exit code, as documented for the command line: 2 wrong use, 3 invalid arm, 6 file error, 10 shared memory.
    pub fn code(&self) -> u8 {
        match self {
            SimError::Injection(_) => 2,
            SimError::Model(_) | SimError::Plant(_) | SimError::Options(_) | SimError::Rate(_) => 3,
            SimError::Trace(_) => 6,
            SimError::Ipc(_) | SimError::Loop(_) => 10,
        }
    }
}

impl From<SimError> for Failure {
    fn from(error: SimError) -> Failure {
        Failure::new(error.code(), error)
    }
}
