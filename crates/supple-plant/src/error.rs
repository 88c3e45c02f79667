//! What a plant cannot be built from.

use crate::scene::SceneError;

/// Why a plant was not built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// An entry of the configuration is not sound.
    #[error("{entry} is {value}: it must be {must}")]
    Entry {
        /// Name of the entry, with its joint where it has one.
        entry: String,
        /// Value found.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// The motor-to-joint matrix has no inverse.
    #[error(
        "joint_from_motor is singular or not finite: give the invertible matrix that takes motor \
         angles to joint angles"
    )]
    Transmission,
    /// The tip is put deep inside something.
    #[error(
        "the tip starts {depth_m:.6} m inside {object:?}: move the object or choose another start pose"
    )]
    Buried {
        /// Name of the object.
        object: String,
        /// Penetration of the tip's ball \[m\].
        depth_m: f64,
    },
    /// The scene is not sound.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// `Ok` when `sound` holds, the entry's error otherwise.
pub(crate) fn entry(
    sound: bool,
    name: impl Into<String>,
    value: f64,
    must: &'static str,
) -> Result<(), PlantError> {
    if sound {
        return Ok(());
    }
    Err(PlantError::Entry {
        entry: name.into(),
        value,
        must,
    })
}
