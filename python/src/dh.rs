//! An arm from a Denavit-Hartenberg table.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use supple_model::{DhConvention, DhRow, urdf_of_dh};

/// Returns the text of a URDF; rows of `a`, `alpha`, `d`, `theta`.
#[pyfunction]
pub fn dh_to_urdf(
    name: &str,
    standard: bool,
    rows: Vec<[f64; 4]>,
    masses_kg: Option<Vec<f64>>,
) -> PyResult<String> {
    let row = |(i, [a_m, alpha_rad, d_m, theta_rad]): (usize, [f64; 4])| DhRow {
        a_m,
        alpha_rad,
        d_m,
        theta_rad,
        mass_kg: masses_kg.as_ref().and_then(|masses| masses.get(i).copied()),
    };
    let rows: Vec<DhRow> = rows.into_iter().enumerate().map(row).collect();
    let convention = match standard {
        true => DhConvention::Standard,
        false => DhConvention::Modified,
    };
    urdf_of_dh(name, convention, &rows)
        .map_err(|error| PyValueError::new_err(format!("table: {error}")))
}
