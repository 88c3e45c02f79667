//! Conversion of the crates' errors to Python exceptions with unchanged messages.

use pyo3::PyErr;
use pyo3::exceptions::{
    PyFileNotFoundError, PyOSError, PyRuntimeError, PyUserWarning, PyValueError,
};
use pyo3::prelude::*;
use std::ffi::CString;
use std::io;
use supple_experiment::ExperimentError;
use supple_ident::{IdentError, SaveError};
use supple_log::LogError;
use supple_model::{Description, ModelError};

/// Converts an error: `FileNotFoundError` and `OSError` for files that cannot be read, `ValueError` for invalid content.
pub fn model(error: ModelError) -> PyErr {
    match &error {
        ModelError::Read { error: cause, .. } | ModelError::Write { error: cause, .. } => {
            system(cause, error.to_string())
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Raises a `UserWarning` for each URDF element that is not read; an error if the interpreter turns warnings into
/// errors.
pub fn warn(py: Python<'_>, description: &Description) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    description.warnings().iter().try_for_each(|warning| {
        // XML text contains no zero byte.
        let text = CString::new(warning.to_string().replace('\0', " "))?;
        PyErr::warn(py, &category, &text, 1)
    })
}

/// Errors of the operating system.
pub fn system(cause: &io::Error, message: String) -> PyErr {
    match cause.kind() {
        io::ErrorKind::NotFound => PyFileNotFoundError::new_err(message),
        _ => PyOSError::new_err(message),
    }
}

/// Errors of reading logs.
pub fn log(error: LogError) -> PyErr {
    match error {
        LogError::Model(error) => model(error),
        LogError::Create { ref source, .. }
        | LogError::Write { ref source, .. }
        | LogError::Read { ref source, .. } => system(source, error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Errors of experiments.
pub fn experiment(error: ExperimentError) -> PyErr {
    match error {
        ExperimentError::Model(error) => model(error),
        ExperimentError::Log(error) => log(error),
        ExperimentError::FaultAtStart { .. } => PyRuntimeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Errors of identification.
pub fn identification(error: IdentError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Errors of converting or saving a fit.
pub fn save(error: SaveError) -> PyErr {
    match error {
        SaveError::Fit(error) => identification(error),
        SaveError::Model(error) => model(error),
    }
}
