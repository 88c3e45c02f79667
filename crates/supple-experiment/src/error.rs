//! Why an experiment could not be run.

use supple_core::ArmError;
use supple_core::controller::{ConfigError, Fault, Refusal};
use supple_plant::PlantError;

/// Why an experiment could not be run. A fault of the controller *during* a run is a result, not an
/// error.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The description is not sound, or of another size.
    #[error(transparent)]
    Model(#[from] supple_model::ModelError),
    /// The controller's model is not an arm.
    #[error("the controller's model: {0}")]
    Arm(#[from] ArmError),
    /// The controller refuses its configuration.
    #[error("the controller's configuration: {0}")]
    Config(#[from] ConfigError),
    /// The plant refuses its configuration.
    #[error("the plant: {0}")]
    Plant(#[from] PlantError),
    /// The logs do not give a model.
    #[error(transparent)]
    Ident(#[from] supple_ident::IdentError),
    /// The model cannot be described or saved.
    #[error(transparent)]
    Save(#[from] supple_ident::SaveError),
    /// A log cannot be written.
    #[error(transparent)]
    Log(#[from] supple_log::LogError),
    /// The arm cannot follow a trajectory.
    #[error(
        "the arm cannot reach ({:.3}, {:.3}, {:.3}) m, needed at {time_s:.2} s of the {experiment}: \
         it stays {distance_m:.4} m away; choose an arm with more reach or a trajectory nearer to it",
        point_m[0], point_m[1], point_m[2]
    )]
    Unreachable {
        /// Name of the experiment.
        experiment: String,
        /// Time into the trajectory \[s\].
        time_s: f64,
        /// Point, base axes \[m\].
        point_m: [f64; 3],
        /// Least distance found \[m\].
        distance_m: f64,
    },
    /// The controller refused a request of the experiment.
    #[error("{experiment}: {refusal}")]
    Refused {
        /// Name of the experiment.
        experiment: String,
        /// Why.
        refusal: Refusal,
    },
    /// A fault where none may be.
    #[error("{experiment}: fault at {time_s:.2} s: {fault}")]
    Fault {
        /// Name of the experiment.
        experiment: String,
        /// Time since it began \[s\].
        time_s: f64,
        /// Which.
        fault: Fault,
    },
    /// A joint that no ramp moved.
    #[error(
        "joint {joint} did not move at {torque_nm} N m: check its brake and its stops, or choose \
         another pose"
    )]
    Stuck {
        /// Joint index.
        joint: usize,
        /// Greatest torque tried \[N m\].
        torque_nm: f64,
    },
    /// A fault before the experiment proper began.
    #[error("{experiment}: fault on the way to the start: {fault}")]
    FaultAtStart {
        /// Name of the experiment.
        experiment: String,
        /// Which.
        fault: Fault,
    },
}
