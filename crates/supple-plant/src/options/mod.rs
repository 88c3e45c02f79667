//! Effects of a real arm that a description does not contain: options of the plant, all off by default.
//!
//! A TOML file sets them; its keys are those of [`PlantOptions`], all optional:
//!
//! ```toml
//! cable_stiffness_nm_per_rad = 3000.0
//! base_tilt_rad = 0.0035
//! ```
//!
//! A table `[hand]` puts a hand on the tip, see [`Hand`](crate::Hand):
//!
//! ```toml
//! [hand]
//! path = [[1.0, 0.0, 0.0, 0.0], [3.0, 0.1, 0.0, 0.05], [5.0, 0.0, 0.0, 0.0]]
//! ```
//!
//! Sizes are seen at each joint unless the option states otherwise. Where an effect has a sign, a direction or a phase, each
//! joint or motor draws its own from the seed; one effect draws the same whether or not others are on. Unknown keys
//! and values out of range are rejected. [`PlantOptions::realistic`] is the named set that the demo uses.

mod apply;
mod list;

pub use list::{OPTIONS, PlantOption, PlantOptions};

use std::collections::BTreeMap;
use std::path::Path;
use supple_model::Description;

/// TOML of the set `realistic`.
pub const REALISTIC: &str = include_str!("../../../../assets/plants/realistic.toml");

/// TOML of the set `openarm-realistic`.
pub const OPENARM_REALISTIC: &str =
    include_str!("../../../../assets/plants/openarm-realistic.toml");

/// TOML of the set `urdf-realistic`.
pub const URDF_REALISTIC: &str = include_str!("../../../../assets/plants/urdf-realistic.toml");

/// Name of the set `realistic`, and of its file in messages.
const REALISTIC_NAME: &str = "assets/plants/realistic.toml";

/// Longest file that is read.
const MAX_BYTES: u64 = 1 << 16;

/// Names of the built-in sets.
pub const SETS: [&str; 3] = ["realistic", "openarm-realistic", "urdf-realistic"];

/// Error of a file of plant options.
#[derive(Debug, thiserror::Error)]
pub enum PlantOptionsError {
    /// The file cannot be read.
    #[error("{file}: {source}; give a file of plant options, see `supple plant list`")]
    File {
        /// The file.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The text is not TOML, or has unknown keys or wrong types.
    #[error("{file}: {message}; `supple plant list` shows all options")]
    Toml {
        /// The file.
        file: String,
        /// Position, key and expected value.
        message: String,
    },
    /// A value out of its range.
    #[error(
        "{file}: {option} is {value}: it must be {must}; leave it out to switch the effect off"
    )]
    Value {
        /// The file.
        file: String,
        /// The option.
        option: &'static str,
        /// Value found.
        value: f64,
        /// Requirement on the value.
        must: String,
    },
    /// An option is set without another option that it needs.
    #[error("{file}: {option} has no effect without {needs}: add {needs}, or leave {option} out")]
    Needs {
        /// The file.
        file: String,
        /// The option.
        option: &'static str,
        /// The option that is missing.
        needs: &'static str,
    },
    /// No built-in set of this name.
    #[error(
        "no set of plant options is named {name:?}: use one of {known}, or --plant-options FILE"
    )]
    UnknownSet {
        /// The name.
        name: String,
        /// Known names.
        known: String,
    },
}

impl PlantOptions {
    /// Reads and checks options; `file` names the text in errors.
    ///
    /// # Errors
    /// [`PlantOptionsError`] with file, option, value and remedy.
    pub fn from_toml(text: &str, file: &str) -> Result<PlantOptions, PlantOptionsError> {
        let options: PlantOptions =
            toml::from_str(text).map_err(|error| PlantOptionsError::Toml {
                file: file.to_owned(),
                message: error.to_string().trim_end().to_owned(),
            })?;
        options.validate(file)?;
        Ok(options)
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`PlantOptionsError`].
    pub fn from_file(path: &Path) -> Result<PlantOptions, PlantOptionsError> {
        let file = path.display().to_string();
        let text =
            supple_files::read_text(path, MAX_BYTES).map_err(|source| PlantOptionsError::File {
                file: file.clone(),
                source,
            })?;
        Self::from_toml(&text, &file)
    }

    /// Returns the set `realistic`: modest sizes of all effects together. They are assumptions, not measurements of an arm.
    pub fn realistic() -> PlantOptions {
        Self::from_toml(REALISTIC, REALISTIC_NAME).expect("the built-in set is valid")
    }

    /// Returns the name of the realistic set of an arm: `openarm-realistic` for geared motors on a bus (`[bus]`), `realistic` for
    /// motors that the TOML describes (`[motors]`), else `urdf-realistic`.
    pub fn realistic_name_of(arm: &Description) -> &'static str {
        match (arm.bus(), arm.describes_motors()) {
            (Some(_), _) => SETS[1],
            (None, true) => SETS[0],
            (None, false) => SETS[2],
        }
    }

    /// Returns the set that [`PlantOptions::realistic_name_of`] names.
    pub fn realistic_of(arm: &Description) -> PlantOptions {
        let name = Self::realistic_name_of(arm);
        let read = Self::set(name).and_then(|toml| Self::from_toml(toml, name));
        read.expect("the built-in sets are valid")
    }

    /// Returns the default noise of the arm's encoders, that of [`PlantOptions::realistic_of`]: standard deviation at
    /// the motor \[rad\].
    pub fn default_encoder_noise_rad(arm: &Description) -> f64 {
        let noise_rad = Self::realistic_of(arm).encoder_noise_rad;
        noise_rad.expect("each built-in set has it")
    }

    /// Returns the TOML of a built-in set.
    ///
    /// # Errors
    /// [`PlantOptionsError::UnknownSet`].
    pub fn set(name: &str) -> Result<&'static str, PlantOptionsError> {
        match name {
            "realistic" => Ok(REALISTIC),
            "openarm-realistic" => Ok(OPENARM_REALISTIC),
            "urdf-realistic" => Ok(URDF_REALISTIC),
            _ => Err(PlantOptionsError::UnknownSet {
                name: name.to_owned(),
                known: SETS.join(", "),
            }),
        }
    }

    /// Returns the options of a command line for `arm`: a file or a built-in set by its name, the realistic set of the arm
    /// ([`PlantOptions::realistic_of`]), or none. A name takes precedence; write `./realistic` for a file.
    ///
    /// # Errors
    /// As [`PlantOptions::from_file`].
    pub fn chosen(
        arm: &Description,
        file: Option<&Path>,
        realistic: bool,
    ) -> Result<PlantOptions, PlantOptionsError> {
        let named = file
            .and_then(Path::to_str)
            .filter(|name| SETS.contains(name));
        if let Some(name) = named {
            return Self::from_toml(Self::set(name)?, name);
        }
        match (file, realistic) {
            (Some(file), _) => Self::from_file(file),
            (None, true) => Ok(Self::realistic_of(arm)),
            (None, false) => Ok(Self::default()),
        }
    }

    /// Returns whether all effects are off.
    pub fn is_none(&self) -> bool {
        self.hand.is_none() && self.values().all(|(_, value)| value.is_none())
    }

    /// Returns the options in force as one line, `name = value` separated by commas; empty without any.
    pub fn line(&self) -> String {
        let set = self
            .values()
            .filter_map(|(option, value)| Some(format!("{} = {}", option.name, value?)));
        let hand = self.hand.as_ref().map(|hand| {
            let rows = hand.path.len() + hand.force.len();
            format!("hand = {rows} rows")
        });
        set.chain(hand).collect::<Vec<_>>().join(", ")
    }

    /// Returns the options in force as a note of a log, by the name `plant`; empty without any.
    pub fn notes(&self) -> BTreeMap<String, String> {
        let line = self.line();
        let note = (!line.is_empty()).then(|| ("plant".to_owned(), line));
        note.into_iter().collect()
    }

    fn validate(&self, file: &str) -> Result<(), PlantOptionsError> {
        if let Some(hand) = &self.hand {
            hand.validate()
                .map_err(|(option, value, must)| PlantOptionsError::Value {
                    file: file.to_owned(),
                    option,
                    value,
                    must,
                })?;
        }
        for (option, value) in self.values() {
            let Some(value) = value else { continue };
            let whole = !option.whole || value.fract() == 0.0;
            if !((option.min..=option.max).contains(&value) && whole) {
                return Err(PlantOptionsError::Value {
                    file: file.to_owned(),
                    option: option.name,
                    value,
                    must: option.range(),
                });
            }
        }
        let dependent = [
            ("cable_damping_ratio", self.cable_damping_ratio),
            ("backlash_rad", self.backlash_rad),
        ];
        for (option, value) in dependent {
            if value.is_some_and(|x| x != 0.0) && self.cable_stiffness_nm_per_rad.is_none() {
                return Err(PlantOptionsError::Needs {
                    file: file.to_owned(),
                    option,
                    needs: "cable_stiffness_nm_per_rad",
                });
            }
        }
        let warms = self.warm_up_dry_fraction.or(self.warm_up_viscous_fraction);
        for (option, value) in [("warm_up_s", self.warm_up_s), ("warmed_s", self.warmed_s)] {
            if value.is_some() && warms.is_none() {
                return Err(PlantOptionsError::Needs {
                    file: file.to_owned(),
                    option,
                    needs: "warm_up_dry_fraction",
                });
            }
        }
        Ok(())
    }
}
