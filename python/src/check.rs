//! Arguments of the native classes, checked by the package's module `_check`: the errors of both have one form.

use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::PathBuf;

/// An argument before its check. Empty if the caller leaves it out, which a given `None` is not.
pub struct Unchecked<'py>(Option<Bound<'py, PyAny>>);

impl<'py> Unchecked<'py> {
    /// The argument that the caller leaves out.
    pub const LEFT_OUT: Self = Self(None);

    /// The checked argument, or its default.
    pub fn or<T>(
        &self,
        default: T,
        check: impl FnOnce(&Bound<'py, PyAny>) -> PyResult<T>,
    ) -> PyResult<T> {
        self.0.as_ref().map_or(Ok(default), check)
    }
}

impl<'py> FromPyObject<'_, 'py> for Unchecked<'py> {
    type Error = Infallible;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> Result<Self, Infallible> {
        Ok(Self(Some(given.to_owned())))
    }
}

/// The value that a function of `_check` returns for the argument `name`.
fn checked<'py>(
    function: &str,
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let module = value.py().import("supple._check")?;
    module.getattr(function)?.call1((name, value))
}

/// A path, or a `TypeError`.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    checked("path", name, value)?.extract()
}

/// Text, or a `TypeError`.
pub fn text(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    checked("text", name, value)?.extract()
}

/// True or False, or a `TypeError`.
pub fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    checked("flag", name, value)?.extract()
}

/// A finite number, zero or more; a `TypeError` for another type, a `ValueError` for another number.
pub fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    checked("number", name, value)?.extract()
}

/// Finite numbers by name, of either sign; errors as of [`number`].
pub fn named_numbers(name: &str, value: &Bound<'_, PyAny>) -> PyResult<BTreeMap<String, f64>> {
    checked("named_numbers", name, value)?.extract()
}
