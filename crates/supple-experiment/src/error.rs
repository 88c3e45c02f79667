//! Errors of experiments.

use supple_core::ArmError;
use supple_core::controller::ConfigError;
use supple_plant::PlantError;

/// Error of an experiment. A fault of the controller *during* a run is a result, not an error.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The description is invalid, or has another number of joints.
    #[error(transparent)]
    Model(#[from] supple_model::ModelError),
    /// The controller's model is physically inconsistent.
    #[error("the controller's model: {0}")]
    Arm(#[from] ArmError),
    /// The controller rejects its configuration.
    #[error("the controller's configuration: {0}")]
    Config(#[from] ConfigError),
    /// The plant rejects its configuration.
    #[error("the plant: {0}")]
    Plant(#[from] PlantError),
    /// The simulated arm cannot have an injected fault.
    #[error("the injected fault: {0}")]
    Injection(#[from] supple_plant::InjectionError),
    /// The identification failed.
    #[error(transparent)]
    Ident(#[from] supple_ident::IdentError),
    /// The model cannot be converted to a description or saved.
    #[error(transparent)]
    Save(#[from] supple_ident::SaveError),
    /// A log cannot be written.
    #[error(transparent)]
    Log(#[from] supple_log::LogError),
    /// The arm cannot reach a point of the trajectory.
    #[error(
        "the arm cannot reach ({:.3}, {:.3}, {:.3}) m, needed at {time_s:.2} s of the {experiment}: \
         it stays {distance_m:.4} m away; choose an arm with more reach or a trajectory nearer to it",
        point_m[0], point_m[1], point_m[2]
    )]
    BeyondJointStop {
        /// Name of the experiment.
        experiment: String,
        /// Time into the trajectory \[s\].
        time_s: f64,
        /// Point, base axes \[m\].
        point_m: [f64; 3],
        /// Minimum distance found \[m\].
        distance_m: f64,
    },
    /// The controller refused a request of the experiment.
    #[error("{experiment}: {reason}")]
    Refused {
        /// Name of the experiment.
        experiment: String,
        /// The refusal in words, with the names of joints.
        reason: String,
    },
    /// A fault during an experiment that must not fault.
    #[error("{experiment}: fault at {time_s:.2} s: {fault}")]
    Fault {
        /// Name of the experiment.
        experiment: String,
        /// Time since the start of the experiment \[s\].
        time_s: f64,
        /// The fault in words, with the names of joints.
        fault: String,
    },
    /// The caller ended a run before its end.
    #[error("interrupted")]
    Interrupted,
    /// A joint did not break away.
    #[error(
        "{joint} did not move at {torque_nm} N m: check its brake and its stops, or choose \
         another pose"
    )]
    Stuck {
        /// Label of the joint.
        joint: String,
        /// Maximum torque applied \[N m\].
        torque_nm: f64,
    },
    /// A fault during the move to the start pose.
    #[error("{experiment}: fault during the move to the start: {fault}")]
    FaultAtStart {
        /// Name of the experiment.
        experiment: String,
        /// The fault in words, with the names of joints.
        fault: String,
    },
}
