//! Checks of arguments of the native classes by the package's module `_check`, so that all errors have the same form.

use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::PathBuf;

/// An argument before its check. Empty if the caller omits it; a given `None` is not empty.
pub struct Unchecked<'py>(Option<Bound<'py, PyAny>>);

impl<'py> Unchecked<'py> {
    /// An omitted argument.
    pub const LEFT_OUT: Self = Self(None);

    /// Returns the checked argument, or its default.
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

/// Returns the result of a function of `_check` for the argument `name`.
fn checked<'py>(
    function: &str,
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let module = value.py().import("supple._check")?;
    module.getattr(function)?.call1((name, value))
}

/// Returns a path, or a `TypeError`.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    checked("path", name, value)?.extract()
}

/// Returns a text, or a `TypeError`.
pub fn text(name: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    checked("text", name, value)?.extract()
}

/// Returns a bool, or a `TypeError`.
pub fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    checked("flag", name, value)?.extract()
}

/// Returns a finite number, zero or more; a `TypeError` for another type, a `ValueError` for another number.
pub fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    checked("number", name, value)?.extract()
}

/// Returns finite numbers of either sign by name; errors like [`number`].
pub fn named_numbers(name: &str, value: &Bound<'_, PyAny>) -> PyResult<BTreeMap<String, f64>> {
    checked("named_numbers", name, value)?.extract()
}
