//! Base parameters of an arm: the combinations that any motion can identify.

use crate::arm::Arm;
use crate::arrays;
use crate::errors;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple_core::Vector;
use supple_ident::base_parameters::RANK_TOLERANCE;
use supple_ident::regressor::rows;
use supple_ident::{BaseParameters, Columns, DMatrix, DVector, FrictionColumns, IdentError, model};
use supple_model::{ModelError, with_dof};

/// Computes the base parameters of the regressor stacked over given states.
#[pyfunction]
pub fn base_parameters<'py>(
    py: Python<'py>,
    arm: &Arm,
    states: [Bound<'py, PyAny>; 3],
    rotor: bool,
    moving: Vec<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let description = arm.description();
    let dof = description.dof();
    let mut matrices = Vec::new();
    for (name, value) in ["q", "qd", "qdd"].iter().zip(&states) {
        let array = arrays::numbers(name, value)?;
        let values = array.as_slice()?;
        matrices.push(DMatrix::from_row_slice(values.len() / dof, dof, values));
    }
    let found = py.detach(|| {
        with_dof!(dof, N => {
            let arm = description.arm::<N>()?;
            sized::<N>(&arm, &matrices, rotor, &moving)
        })
    });
    let found: Result<Result<Found, IdentError>, ModelError> = found;
    let (base, columns, values) = found
        .map_err(errors::model)?
        .map_err(errors::identification)?;
    let names = columns.names();
    let dict = PyDict::new(py);
    dict.set_item("names", base.text(&names))?;
    dict.set_item("null_space", base.null_space_text(&names))?;
    dict.set_item("columns", names)?;
    dict.set_item("independent", &base.independent)?;
    dict.set_item("dependent", &base.dependent)?;
    let (rank, others) = base.combination.shape();
    let combination = base.combination.transpose().as_slice().to_vec();
    dict.set_item(
        "combination",
        arrays::array(py, combination, &[rank, others])?,
    )?;
    dict.set_item("condition", base.condition)?;
    let values = base.values(&values).as_slice().to_vec();
    dict.set_item("values", arrays::array(py, values, &[rank])?)?;
    Ok(dict)
}

/// The base parameters, their columns, and the values of all columns.
type Found = (BaseParameters, Columns, DVector<f64>);

fn sized<const N: usize>(
    arm: &supple_core::Arm<N>,
    states: &[DMatrix<f64>],
    rotor: bool,
    moving: &[usize],
) -> Result<Found, IdentError> {
    let columns = Columns::new(N, moving, rotor, FrictionColumns::NONE, &[])?;
    let samples = states[0].nrows();
    let mut stacked = DMatrix::zeros(samples * moving.len(), columns.len());
    for k in 0..samples {
        let [q, qd, qdd] = core::array::from_fn(|a| Vector::<N>::from_fn(|j, _| states[a][(k, j)]));
        let block = rows(arm, &columns, &q, &qd, &qdd);
        stacked
            .rows_mut(k * moving.len(), moving.len())
            .copy_from(&block);
    }
    // The triangular factor has the same column norms and angles and is small.
    let base = BaseParameters::from_regressor(&stacked.qr().r(), RANK_TOLERANCE)?;
    let values = model::prior(arm, &columns);
    Ok((base, columns, values))
}
