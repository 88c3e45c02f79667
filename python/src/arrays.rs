//! Conversion of NumPy arrays: shapes, batches, memory.
//!
//! Every argument of a state has shape `(..., width)`, or `(..., rows, columns)` for a matrix: the last axes are one
//! state, the leading axes are the batch. All arguments of one call have the same batch axes or none; a single state is used for the whole
//! batch. Float64 arrays in C order are read without a copy; others are copied first.

use numpy::{
    IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::IntoPyDict;
use supple_core::Vector;

/// An array of float64.
pub type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// An argument: its name and its value.
pub type Argument<'a, 'py> = (&'static str, &'a Bound<'py, PyAny>);

/// Values of one argument: `width` for each state, or `width` for all states together.
#[derive(Clone, Copy)]
pub struct States<'a> {
    values: &'a [f64],
    stride: usize,
    width: usize,
}

impl<'a> States<'a> {
    /// Creates values that are the same for all states.
    pub fn constant(values: &'a [f64]) -> Self {
        States {
            values,
            stride: 0,
            width: values.len(),
        }
    }

    /// Returns the values of state `k` as a vector, filled with zeros if there are fewer.
    #[inline(always)]
    pub fn vector<const R: usize>(&self, k: usize) -> Vector<R> {
        self.at(k)
            .first_chunk::<R>()
            .map_or_else(Vector::zeros, |values| Vector::from(*values))
    }

    /// Returns the values of state `k`.
    #[inline]
    pub fn at(&self, k: usize) -> &'a [f64] {
        &self.values[k * self.stride..][..self.width]
    }
}

/// An argument and the shape of its value for one state.
pub type Shaped<'a, 'py> = (Argument<'a, 'py>, &'a [usize]);

/// The borrowed arguments of one call and their batch.
pub struct Batch<'py> {
    /// Each argument with the number of values for one state.
    arguments: Vec<(PyReadonlyArrayDyn<'py, f64>, usize, bool)>,
    /// Leading axes, empty for a single state.
    pub shape: Vec<usize>,
}

impl<'py> Batch<'py> {
    /// Reads arguments of `width` numbers for each state.
    ///
    /// # Errors
    /// `TypeError` if an argument is not numeric, `ValueError` if the shapes do not agree.
    pub fn read(arguments: &[Argument<'_, 'py>], width: usize) -> PyResult<Self> {
        let shape = [width];
        let shaped: Vec<Shaped<'_, 'py>> = arguments.iter().map(|a| (*a, &shape[..])).collect();
        Self::read_shaped(&shaped)
    }

    /// Reads arguments of different shapes, like [`Batch::read`].
    ///
    /// # Errors
    /// The same as those of [`Batch::read`].
    pub fn read_shaped(arguments: &[Shaped<'_, 'py>]) -> PyResult<Self> {
        let mut arrays = Vec::with_capacity(arguments.len());
        let mut batch: Option<(&'static str, Vec<usize>)> = None;
        for ((name, value), state) in arguments {
            let array = numbers(name, value)?;
            let Some(leading) = array.shape().strip_suffix(*state) else {
                return Err(wrong_shape(name, &expected(state), array.shape()));
            };
            match &batch {
                _ if leading.is_empty() => {}
                None => batch = Some((name, leading.to_vec())),
                Some((_, shape)) if shape == leading => {}
                Some((first, shape)) => {
                    let wanted = format!(
                        "{}, the batch of {first}, or {}",
                        shape_text(&[&shape[..], state].concat()),
                        shape_text(state)
                    );
                    return Err(wrong_shape(name, &wanted, array.shape()));
                }
            }
            let single = leading.is_empty();
            arrays.push((array, state.iter().product(), single));
        }
        Ok(Self {
            arguments: arrays,
            shape: batch.map_or_else(Vec::new, |(_, shape)| shape),
        })
    }

    /// Returns the values of each argument.
    pub fn states(&self) -> PyResult<Vec<States<'_>>> {
        let arguments = self.arguments.iter();
        let states = arguments.map(|(array, width, single)| {
            Ok(States {
                values: slice(array)?,
                stride: if *single { 0 } else { *width },
                width: *width,
            })
        });
        states.collect()
    }
}

fn expected(state: &[usize]) -> String {
    let axes: Vec<String> = state.iter().map(usize::to_string).collect();
    format!("{} or (..., {})", shape_text(state), axes.join(", "))
}

fn slice<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    Ok(array.as_slice()?)
}

/// Returns an argument as a float64 array in C order, without a copy if it already is one.
///
/// # Errors
/// `TypeError` if it is not numeric; `ValueError` for ragged lists and borrowed arrays.
pub fn numbers<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let array = match value.cast::<PyArrayDyn<f64>>() {
        Ok(array) if array.is_c_contiguous() && array.is_aligned() => array.clone(),
        _ => converted(name, value)?,
    };
    let borrowed = array.try_readonly();
    borrowed.map_err(|error| PyValueError::new_err(format!("{name}: {error}; pass a copy")))
}

fn converted<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    static ARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    static REQUIRE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let py = value.py();
    // In C order and aligned.
    let keywords = [("dtype", "float64"), ("requirements", "CA")].into_py_dict(py)?;
    let array = ARRAY.import(py, "numpy", "asarray")?.call1((value,));
    let array = array.and_then(|array| {
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        // NumPy would read numbers from text.
        if ["U", "S", "T"].contains(&kind.as_str()) {
            return Err(PyValueError::new_err("an array of text"));
        }
        let require = REQUIRE.import(py, "numpy", "require")?;
        require.call((array,), Some(&keywords))
    });
    let array = array.map_err(|cause| {
        let message = format!("{name}: expected numbers, got {}", type_name(value));
        let error = if cause.is_instance_of::<PyTypeError>(py) {
            PyTypeError::new_err(message)
        } else {
            PyValueError::new_err(message)
        };
        error.set_cause(py, Some(cause));
        error
    })?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

fn type_name(value: &Bound<'_, PyAny>) -> String {
    let name = value.get_type().name();
    name.map_or_else(|_| "another object".to_owned(), |name| name.to_string())
}

/// Returns an argument as an array of exactly this shape.
///
/// # Errors
/// The same as those of [`numbers`]; `ValueError` if the shape differs.
pub fn fixed<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let array = numbers(name, value)?;
    if array.shape() == shape {
        return Ok(array);
    }
    Err(wrong_shape(name, &shape_text(shape), array.shape()))
}

/// Returns the array for the results: `out`, or a new array.
///
/// # Errors
/// `TypeError` and `ValueError` if `out` is not a writable float64 array in C order of this shape.
pub fn output<'py>(
    py: Python<'py>,
    out: Option<&Bound<'py, PyAny>>,
    shape: &[usize],
) -> PyResult<(Array<'py>, PyReadwriteArrayDyn<'py, f64>)> {
    let Some(out) = out else {
        let array = PyArrayDyn::zeros(py, shape, false);
        let writable = array.readwrite();
        return Ok((array, writable));
    };
    let wanted = format!(
        "a writable float64 array in C order of shape {}",
        shape_text(shape)
    );
    let refuse = |found: String| format!("out: expected {wanted}, got {found}");
    let Ok(array) = out.cast::<PyArrayDyn<f64>>() else {
        return Err(PyTypeError::new_err(refuse(type_name(out))));
    };
    if array.shape() != shape {
        return Err(PyValueError::new_err(refuse(format!(
            "shape {}",
            shape_text(array.shape())
        ))));
    }
    if !(array.is_c_contiguous() && array.is_aligned()) {
        return Err(PyValueError::new_err(refuse("another order".to_owned())));
    }
    let writable = array.try_readwrite().map_err(|error| {
        PyValueError::new_err(refuse(format!(
            "a read-only or borrowed array: {error}; it must not share memory with an argument"
        )))
    })?;
    Ok((array.clone(), writable))
}

/// Creates an array of `shape` that takes ownership of `values`.
pub fn array<'py>(py: Python<'py>, values: Vec<f64>, shape: &[usize]) -> PyResult<Array<'py>> {
    values.into_pyarray(py).reshape(shape.to_vec())
}

/// Creates the `ValueError` for an argument of unexpected shape.
pub fn wrong_shape(name: &str, expected: &str, found: &[usize]) -> PyErr {
    PyValueError::new_err(format!(
        "{name}: expected shape {expected}, got {}",
        shape_text(found)
    ))
}

/// Returns a shape as Python prints a tuple.
pub fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => {
            let axes: Vec<String> = shape.iter().map(usize::to_string).collect();
            format!("({})", axes.join(", "))
        }
    }
}
