//! Refusals of the crates as Python's exceptions, their messages unchanged.

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

/// `FileNotFoundError` and `OSError` for what cannot be read, `ValueError` for what makes no sense.
pub fn model(error: ModelError) -> PyErr {
    match &error {
        ModelError::Read { error: cause, .. } | ModelError::Write { error: cause, .. } => {
            system(cause, error.to_string())
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// What a URDF holds and is not read, as a `UserWarning` each; an error where the interpreter makes one of it.
pub fn warn(py: Python<'_>, description: &Description) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    description.warnings().iter().try_for_each(|warning| {
        // No text of an XML document has a zero byte.
        let text = CString::new(warning.to_string().replace('\0', " "))?;
        PyErr::warn(py, &category, &text, 1)
    })
}

/// What the system refused.
pub fn system(cause: &io::Error, message: String) -> PyErr {
    match cause.kind() {
        io::ErrorKind::NotFound => PyFileNotFoundError::new_err(message),
        _ => PyOSError::new_err(message),
    }
}

/// Logs that cannot be read, or are not whole.
pub fn log(error: LogError) -> PyErr {
    match error {
        LogError::Model(error) => model(error),
        LogError::Create { ref source, .. }
        | LogError::Write { ref source, .. }
        | LogError::Read { ref source, .. } => system(source, error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Experiments that cannot be run.
pub fn experiment(error: ExperimentError) -> PyErr {
    match error {
        ExperimentError::Model(error) => model(error),
        ExperimentError::Log(error) => log(error),
        ExperimentError::FaultAtStart { .. } => PyRuntimeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Logs and options that identification refuses.
pub fn identification(error: IdentError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Fits that are no arm.
pub fn save(error: SaveError) -> PyErr {
    match error {
        SaveError::Fit(error) => identification(error),
        SaveError::Model(error) => model(error),
    }
}
