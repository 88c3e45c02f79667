//! A fit as a description that the controller loads: TOML and URDF.

use crate::error::IdentError;
use crate::fit::Fit;
use std::path::Path;
use supple_core::RippleTable;
use supple_model::{Description, ModelError, Replacement};

/// Why a fit is not saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The fit is no arm.
    #[error(transparent)]
    Fit(#[from] IdentError),
    /// The description it would become is not sound, or cannot be written.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl<const N: usize> Fit<N> {
    /// `of` with the model found: inertias of all links, rotors and friction of the moving joints. The
    /// text stays as it is otherwise. `ripple` replaces the motors' tables, if given.
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
        Ok(of.with_model(&Replacement {
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
