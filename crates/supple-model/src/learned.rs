//! The learned terms of a description: read from its TOML, and written into it.

use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::settings::{LearnedSettings, MapSettings};
use serde::Serialize;
use supple_core::Vector;
use supple_core::learned::{JointMap, LearnedParameters, LearnedTerms, MAP_KNOTS};
use supple_core::math::Vector3;

/// The section of the TOML.
#[derive(Serialize)]
struct Section {
    learned: LearnedSettings,
}

/// A list of the TOML with a wrong number of values.
struct WrongCount {
    key: &'static str,
    found: usize,
    expected: usize,
}

impl LearnedSettings {
    /// Returns the settings of the TOML for these terms.
    pub fn new<const N: usize>(learned: &LearnedTerms<N>) -> LearnedSettings {
        let LearnedTerms { parameters, map } = learned;
        LearnedSettings {
            source: None,
            viscous_nm_s_per_rad: parameters.viscous_nm_s_per_rad.as_slice().to_vec(),
            coulomb_nm: parameters.coulomb_nm.as_slice().to_vec(),
            offset_nm: parameters.offset_nm.as_slice().to_vec(),
            torque_scale: parameters.torque_scale.as_slice().to_vec(),
            payload_kg: parameters.payload_kg,
            payload_moment_kg_m: parameters.payload_moment_kg_m.into(),
            tilt_rad: parameters.tilt_rad.into(),
            map: map
                .iter()
                .map(|map| MapSettings {
                    torque_nm: map.torque_nm.to_vec(),
                    dry_nm: map.dry_nm.to_vec(),
                })
                .collect(),
        }
    }

    /// Returns the terms; missing lists are zero.
    ///
    /// # Errors
    /// A list that does not have one entry per joint, or a map without 16 coefficients, as a message.
    pub fn terms<const N: usize>(&self) -> Result<LearnedTerms<N>, String> {
        self.checked().map_err(|wrong| {
            let WrongCount {
                key,
                found,
                expected,
            } = wrong;
            format!("{key} has {found} entries, expected {expected}")
        })
    }

    fn checked<const N: usize>(&self) -> Result<LearnedTerms<N>, WrongCount> {
        let joints = |key, given: &[f64]| match given.len() {
            0 => Ok(Vector::<N>::zeros()),
            found if found == N => Ok(Vector::from_column_slice(given)),
            found => Err(WrongCount {
                key,
                found,
                expected: N,
            }),
        };
        let coefficients = |key, given: &[f64]| {
            <[f64; MAP_KNOTS]>::try_from(given).map_err(|_| WrongCount {
                key,
                found: given.len(),
                expected: MAP_KNOTS,
            })
        };
        let mut map = [JointMap::ZERO; N];
        if !self.map.is_empty() {
            if self.map.len() != N {
                return Err(WrongCount {
                    key: "map",
                    found: self.map.len(),
                    expected: N,
                });
            }
            for (to, from) in map.iter_mut().zip(&self.map) {
                *to = JointMap {
                    torque_nm: coefficients("torque_nm of a map", &from.torque_nm)?,
                    dry_nm: coefficients("dry_nm of a map", &from.dry_nm)?,
                };
            }
        }
        Ok(LearnedTerms {
            parameters: LearnedParameters {
                viscous_nm_s_per_rad: joints("viscous_nm_s_per_rad", &self.viscous_nm_s_per_rad)?,
                coulomb_nm: joints("coulomb_nm", &self.coulomb_nm)?,
                offset_nm: joints("offset_nm", &self.offset_nm)?,
                torque_scale: joints("torque_scale", &self.torque_scale)?,
                payload_kg: self.payload_kg,
                payload_moment_kg_m: Vector3::from(self.payload_moment_kg_m),
                tilt_rad: Vector3::from(self.tilt_rad),
            },
            map,
        })
    }
}

impl Description {
    /// Returns the initial learned terms; zero if the TOML has none.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a list of the wrong length.
    pub(crate) fn learned<const N: usize>(&self) -> Result<LearnedTerms<N>, ModelError> {
        let Some(given) = &self.settings.learned else {
            return Ok(LearnedTerms::zero());
        };
        let report = Reporter {
            file: &self.toml_file,
        };
        given.checked().map_err(|wrong| {
            report.invalid(
                format!("[learned] {}", wrong.key),
                format!("must have {} entries", wrong.expected),
                format!("{} entries", wrong.found),
                "remove [learned], or save it again from a running system",
            )
        })
    }

    /// Returns the same arm with these learned terms as `[learned]` in its TOML, whose other text is kept; `source`
    /// is the origin of the terms.
    ///
    /// # Errors
    /// [`ModelError::JointCount`]; any [`ModelError`] of the edited text.
    pub fn with_learned<const N: usize>(
        &self,
        learned: &LearnedTerms<N>,
        source: &str,
    ) -> Result<Description, ModelError> {
        self.expect_dof(N)?;
        let settings = LearnedSettings {
            source: Some(source.to_owned()),
            ..LearnedSettings::new(learned)
        };
        let syntax = |message: String| ModelError::Syntax {
            file: self.toml_file.clone(),
            message,
            remedy: "correct the text",
        };
        let section = Section { learned: settings };
        let section = toml::to_string(&section).map_err(|error| syntax(error.to_string()))?;
        let document = self.without_learned()?;
        Description::from_text(&format!("{}\n{section}", document.toml()), self.urdf())
    }

    /// Returns the same arm without `[learned]`; the other text of its TOML is kept.
    ///
    /// # Errors
    /// Any [`ModelError`] of the edited text.
    fn without_learned(&self) -> Result<Description, ModelError> {
        if self.settings.learned.is_none() {
            return Ok(self.clone());
        }
        let mut document = self.document()?;
        document.remove("learned");
        Description::from_text(&document.to_string(), self.urdf())
    }
}
