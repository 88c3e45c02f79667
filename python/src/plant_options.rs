//! Options of the simulated arm beyond its description.

use crate::arm::Arm;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use supple_plant::PlantOptions;

/// Name of options that were given as a dictionary, in errors.
const DICTIONARY: &str = "plant_options";

/// Plant options from Python: `None`, a path, or a dictionary of numbers. An error in them is kept until they are
/// used: as an error of the conversion it would become a TypeError of all options.
pub struct PlantEffects {
    /// The options; the default if they are invalid.
    pub options: PlantOptions,
    error: Option<String>,
}

impl PlantEffects {
    /// Returns a ValueError if the options are invalid.
    pub fn check(&self) -> PyResult<()> {
        match &self.error {
            None => Ok(()),
            Some(message) => Err(PyValueError::new_err(message.clone())),
        }
    }

    fn valid(options: PlantOptions) -> PlantEffects {
        PlantEffects {
            options,
            error: None,
        }
    }
}

impl<'py> FromPyObject<'_, 'py> for PlantEffects {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<PlantEffects> {
        if given.is_none() {
            return Ok(PlantEffects::valid(PlantOptions::default()));
        }
        let found = match given.cast::<PyDict>() {
            Err(_) => PlantOptions::from_file(&given.extract::<PathBuf>()?),
            Ok(values) => {
                let mut text = String::new();
                for (name, value) in values.iter() {
                    let (name, value): (String, f64) = (name.extract()?, value.extract()?);
                    // A whole number is also the form of the seed.
                    text.push_str(&format!("{name:?} = {value}\n"));
                }
                PlantOptions::from_toml(&text, DICTIONARY)
            }
        };
        Ok(match found {
            Ok(options) => PlantEffects::valid(options),
            Err(error) => PlantEffects {
                options: PlantOptions::default(),
                error: Some(error.to_string()),
            },
        })
    }
}

/// Returns the name of the realistic set of `arm`.
#[pyfunction]
pub fn realistic_set(arm: PyRef<'_, Arm>) -> &'static str {
    PlantOptions::realistic_name_of(arm.description())
}

/// Returns the set of options `name` as a dictionary.
#[pyfunction]
pub fn plant_options<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
    let error = |error: supple_plant::PlantOptionsError| PyValueError::new_err(error.to_string());
    let text = PlantOptions::set(name).map_err(error)?;
    let options = PlantOptions::from_toml(text, name).map_err(error)?;
    let dict = PyDict::new(py);
    for (option, value) in options.values() {
        if let Some(value) = value {
            dict.set_item(option.name, value)?;
        }
    }
    Ok(dict)
}
