//! Errors of the plant configuration.

use crate::scene::SceneError;

/// Error of building a plant or of changing its state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// An entry of the configuration is invalid.
    #[error("{entry} is {value}: it must be {must}")]
    Entry {
        /// Name of the entry, with its joint if it has one.
        entry: String,
        /// Value found.
        value: f64,
        /// Requirement on the value.
        must: &'static str,
    },
    /// The motor-to-joint matrix has no inverse.
    #[error(
        "joint_from_motor is singular or not finite: give the invertible matrix that maps motor \
         angles to joint angles"
    )]
    Transmission,
    /// The tip starts deep inside an object.
    #[error(
        "the tip starts {depth_m:.6} m inside {object:?}: move the object or choose another start pose"
    )]
    TipInsideObject {
        /// Name of the object.
        object: String,
        /// Penetration of the spherical tip \[m\].
        depth_m: f64,
    },
    /// The scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Returns `Ok` if `valid` holds, the entry's error otherwise.
pub(crate) fn entry(
    valid: bool,
    name: impl Into<String>,
    value: f64,
    must: &'static str,
) -> Result<(), PlantError> {
    if valid {
        return Ok(());
    }
    Err(PlantError::Entry {
        entry: name.into(),
        value,
        must,
    })
}
