//! Further results of a fit: payload, torque scale, weighing and torque ripple.

use crate::arrays;
use crate::errors;
use crate::fit::Fit;
use crate::samples::{LogInput, Samples};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple_core::Body;
use supple_core::math::{Matrix3, Vector3};
use supple_ident::{Motion, RippleSearch};

/// A payload in the last link's frame.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PayloadBody {
    mass_kg: f64,
    com_m: [f64; 3],
    inertia_kg_m2: [[f64; 3]; 3],
}

impl From<PayloadBody> for Body {
    fn from(payload: PayloadBody) -> Body {
        Body {
            mass_kg: payload.mass_kg,
            com_m: Vector3::from(payload.com_m),
            inertia_kg_m2: Matrix3::from_fn(|i, j| payload.inertia_kg_m2[i][j]),
        }
    }
}

fn motions(fit: &Fit, logs: &[LogInput<'_>]) -> PyResult<Vec<Motion>> {
    fit.motions_of(&read(fit, logs)?)
}

fn read(fit: &Fit, logs: &[LogInput<'_>]) -> PyResult<Vec<Samples>> {
    let dof = fit.description().dof();
    logs.iter().map(|log| Samples::read(log, dof)).collect()
}

/// Identifies a payload from the residual of the fit over logs with it; undetermined parameters are regularised
/// towards `guess`.
#[pyfunction]
pub fn payload<'py>(
    py: Python<'py>,
    fit: &Fit,
    logs: Vec<LogInput<'py>>,
    guess: PayloadBody,
) -> PyResult<Bound<'py, PyDict>> {
    let motions = motions(fit, &logs)?;
    let guess = Body::from(guess);
    let found = py.detach(|| fit.model().payload(&motions, &guess));
    let body = found.map_err(errors::identification)?;
    let dict = PyDict::new(py);
    dict.set_item("mass_kg", body.mass_kg)?;
    dict.set_item(
        "com_m",
        arrays::array(py, body.com_m.as_slice().to_vec(), &[3])?,
    )?;
    let inertia = body.inertia_kg_m2.transpose().as_slice().to_vec();
    dict.set_item("inertia_kg_m2", arrays::array(py, inertia, &[3, 3])?)?;
    Ok(dict)
}

/// Returns the ratio of true to logged torque of each moving joint; `None` if the known payload adds too little torque.
#[pyfunction]
pub fn torque_scale(
    py: Python<'_>,
    fit: &Fit,
    logs: Vec<LogInput<'_>>,
    known: PayloadBody,
) -> PyResult<Vec<Option<f64>>> {
    let motions = motions(fit, &logs)?;
    let known = Body::from(known);
    let found = py.detach(|| fit.model().torque_scale(fit.fitted(), &motions, &known));
    found.map_err(errors::identification)
}

/// Estimates torque scales and the place of a weight of known mass.
#[pyfunction]
pub fn weigh<'py>(
    py: Python<'py>,
    fit: &Fit,
    logs: Vec<LogInput<'py>>,
    mass_kg: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let motions = motions(fit, &logs)?;
    let found = py.detach(|| fit.model().weigh(fit.fitted(), &motions, mass_kg));
    let found = found.map_err(errors::identification)?;
    let dict = PyDict::new(py);
    let joints = fit.model().identified_joints().iter();
    let names: Vec<String> = joints
        .map(|joint| fit.description().joint_names()[*joint].clone())
        .collect();
    dict.set_item("warnings", found.warnings(&names))?;
    dict.set_item("torque_scale", found.torque_scale)?;
    dict.set_item("torque_scale_deviation", found.torque_scale_deviation)?;
    for (name, vector) in [
        ("com_m", found.com_m),
        ("com_deviation_m", found.com_deviation_m),
    ] {
        let values = vector.as_slice().to_vec();
        dict.set_item(name, arrays::array(py, values, &[3])?)?;
    }
    Ok(dict)
}

/// Returns harmonic, sine and cosine amplitude of every line of each motor.
#[pyfunction]
pub fn ripple(
    py: Python<'_>,
    fit: &Fit,
    logs: Vec<LogInput<'_>>,
    harmonics: Vec<u32>,
    fast_rad_per_s: f64,
    cutoff_hz: f64,
) -> PyResult<Vec<Vec<(u32, f64, f64)>>> {
    let samples = read(fit, &logs)?;
    let search = RippleSearch {
        harmonics,
        fast_rad_per_s,
    };
    let found = py.detach(|| {
        fit.model()
            .ripple(fit.description(), &samples, &search, cutoff_hz)
    });
    found.map_err(errors::save)
}
