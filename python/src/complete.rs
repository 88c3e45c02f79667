//! The settings of a controller that an arm's files leave out.

use crate::errors;
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use std::ffi::CString;
use std::sync::OnceLock;
use supple_model::unlimited::{UNLIMITED_NM, UNLIMITED_RAD_PER_S};
use supple_model::{Completed, Description, ModelError, with_dof};

/// Returns the description with every setting that a controller needs. A `UserWarning` reports derived settings,
/// unless only the places of the paths are derived.
pub fn completed<'a>(
    py: Python<'_>,
    arm: &Description,
    known: &'a OnceLock<Completed>,
) -> PyResult<&'a Description> {
    let completed = of(py, arm, known)?;
    // Paths elsewhere, where the arm does not reach the paper's, are no estimate of a property of the arm: no warning.
    let of_arm = completed.derived.iter();
    let derived = of_arm
        .filter(|derived| !derived.key.starts_with("[paths]"))
        .count();
    if derived > 0 {
        let estimates = completed.derived.iter();
        let estimates = estimates
            .filter(|derived| derived.key.ends_with("armature_kg_m2"))
            .count();
        let mut text = format!(
            "{}: {derived} settings of the controller are derived from the arm",
            arm.name()
        );
        if estimates > 0 {
            text += &format!("; the rotor inertias of {estimates} joints are estimates");
        }
        text += ": arm.completed() is the arm with them, its toml gives the reasons";
        let text = CString::new(text.replace('\0', " "))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(&completed.description)
}

/// Returns the description with every setting that a controller needs, and the derived settings; `known` caches both.
pub fn of<'a>(
    py: Python<'_>,
    description: &Description,
    known: &'a OnceLock<Completed>,
) -> PyResult<&'a Completed> {
    if let Some(known) = known.get() {
        return Ok(known);
    }
    if let Some(unlimited) = unlimited(description).map_err(errors::model)? {
        return Err(PyValueError::new_err(format!(
            "{}: joint `{unlimited}`: its URDF gives no limit of torque or of speed, which a simulation needs: give \
             <limit effort=\"..\" velocity=\"..\"/> (N m, rad/s) greater than zero",
            description.name()
        )));
    }
    let completed = py.detach(|| description.completed());
    let completed = completed.map_err(errors::model)?;
    Ok(known.get_or_init(|| completed))
}

/// Returns a joint without limits of torque and speed, see [`supple_model::unlimited`].
fn unlimited(description: &Description) -> Result<Option<&String>, ModelError> {
    with_dof!(description.dof(), N => {
        let limits = description.config::<N>()?.limits;
        let joint = (0..N).find(|&joint| {
            limits.joint_torque_nm[joint] == UNLIMITED_NM
                || limits.joint_speed_rad_per_s[joint] == UNLIMITED_RAD_PER_S
        });
        Ok(joint.map(|joint| &description.joint_names()[joint]))
    })?
}
