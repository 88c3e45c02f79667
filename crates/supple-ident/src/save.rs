//! Conversion of a fit to a description that the controller loads: TOML and URDF.

use crate::error::IdentError;
use crate::fit::Fit;
use std::path::Path;
use supple_core::RippleTable;
use supple_model::{Description, IdentifiedModel, ModelError};

/// Error of saving a fit.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The fit is physically inconsistent.
    #[error(transparent)]
    Fit(#[from] IdentError),
    /// The resulting description is invalid or cannot be written.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl<const N: usize> Fit<N> {
    /// `of` with the identified model: inertias of all links, rotors and friction of the moving joints. All
    /// other text is unchanged. `ripple`, if given, replaces the motors' tables.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn description(
        &self,
        of: &Description,
        ripple: Option<&[RippleTable; N]>,
    ) -> Result<Description, SaveError> {
        let error = 100.0 * self.training_relative;
        let source = format!("identified from logs; {error:.2} % of the torque left unexplained");
        Ok(of.with_model(&IdentifiedModel {
            arm: &self.arm()?,
            friction: &self.friction_with(of.friction()),
            ripple,
            source: &source,
        })?)
    }

    /// Writes [`Fit::description`] as `arm.toml` and `arm.urdf` into `folder`.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn save(&self, of: &Description, folder: &Path) -> Result<(), SaveError> {
        Ok(self.description(of, None)?.save(folder)?)
    }
}
