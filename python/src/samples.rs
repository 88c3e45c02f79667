//! Conversion of NumPy logs for identification.
//!
//! A log with velocities and accelerations is a list of states: nothing is differentiated, and its rows are used
//! unchanged unless a filter, a rate or a decimation is given.

use crate::arrays;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use supple_core::Arm;
use supple_ident::filter::LowPass;
use supple_ident::{DMatrix, IdentError, Log, Motion, Preparation, Procedure, Warning, resample};

/// The columns of one log as Python passes them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct LogInput<'py> {
    t: Bound<'py, PyAny>,
    q: Bound<'py, PyAny>,
    tau: Bound<'py, PyAny>,
    qd: Option<Bound<'py, PyAny>>,
    qdd: Option<Bound<'py, PyAny>>,
}

/// A log, with accelerations if they were given.
pub struct Samples {
    log: Log,
    qdd_rad_per_s2: Option<DMatrix<f64>>,
}

impl Samples {
    /// Reads the columns: `(samples, dof)` each, `t` `(samples,)`.
    pub fn read(given: &LogInput<'_>, dof: usize) -> PyResult<Self> {
        let t = arrays::numbers("t", &given.t)?;
        if t.ndim() != 1 {
            return Err(arrays::wrong_shape("t", "(samples,)", t.shape()));
        }
        let samples = t.len();
        let matrix = |name: &str, value: &Bound<'_, PyAny>| -> PyResult<DMatrix<f64>> {
            let array: PyReadonlyArrayDyn<'_, f64> = arrays::numbers(name, value)?;
            if array.shape() != [samples, dof] {
                let expected = format!("({samples}, {dof}), a row for each of t");
                return Err(arrays::wrong_shape(name, &expected, array.shape()));
            }
            Ok(DMatrix::from_row_slice(samples, dof, array.as_slice()?))
        };
        let optional = |name: &str, value: &Option<Bound<'_, PyAny>>| {
            value.as_ref().map(|value| matrix(name, value)).transpose()
        };
        Ok(Samples {
            log: Log {
                q_rad: matrix("q", &given.q)?,
                qd_rad_per_s: optional("qd", &given.qd)?,
                tau_nm: matrix("tau", &given.tau)?,
                t_s: t.as_slice()?.to_vec(),
            },
            qdd_rad_per_s2: optional("qdd", &given.qdd)?,
        })
    }

    /// Prepares the log like [`Samples::motion`], checks it against the given arm and estimates the delay of its torques,
    /// unless rows are used unchanged.
    pub fn checked_motion<const N: usize>(
        &self,
        arm: &Arm<N>,
        moving: &[usize],
        procedure: &Procedure,
    ) -> Result<(Motion, Vec<Warning>), IdentError> {
        if self.qdd_rad_per_s2.is_some() {
            return self.motion(moving, &procedure.preparation);
        }
        procedure.prepare(arm, &self.log, moving)
    }

    pub fn motion(
        &self,
        moving: &[usize],
        preparation: &Preparation,
    ) -> Result<(Motion, Vec<Warning>), IdentError> {
        let dof = self.log.q_rad.ncols();
        let (Some(qdd), Some(qd)) = (&self.qdd_rad_per_s2, &self.log.qd_rad_per_s) else {
            return Motion::prepare(&self.log, dof, moving, preparation);
        };
        check_finite("qdd", qdd)?;
        let as_given = preparation.cutoff_hz.is_none()
            && preparation.rate_hz.is_none()
            && preparation.decimation_factor == 1
            && preparation.torque_delay_s == 0.0;
        if !as_given {
            let (motion, warnings) = Motion::prepare(&self.log, dof, moving, preparation)?;
            let rate_hz = motion.rate_hz * preparation.decimation_factor as f64;
            let mut grid = resample(&self.log.t_s, qdd, rate_hz, 0.0);
            if let Some(cutoff_hz) = preparation.cutoff_hz {
                grid = LowPass::butterworth4(cutoff_hz, rate_hz)?.zero_phase_columns(&grid)?;
            }
            let rows = preparation.kept(rate_hz, grid.nrows())?;
            let qdd = grid.select_rows(&rows);
            return Ok((Motion { qdd, ..motion }, warnings));
        }
        check_finite("qd", qd)?;
        // The velocities of unordered rows cannot be compared with slopes of the angles.
        let unordered = Log {
            qd_rad_per_s: None,
            ..self.log.clone()
        };
        let warnings = unordered.check(dof, moving)?;
        let t = &self.log.t_s;
        let motion = Motion {
            rate_hz: (t.len() - 1) as f64 / (t[t.len() - 1] - t[0]),
            q: self.log.q_rad.clone(),
            qd: qd.clone(),
            qdd: qdd.clone(),
            tau: self.log.tau_nm.clone(),
            independent_fraction: 1.0,
            cutoff_hz: None,
            start_s: t[0],
            torque_delay_s: 0.0,
            excluded_intervals: Vec::new(),
        };
        Ok((motion, warnings))
    }
}

fn check_finite(name: &str, columns: &DMatrix<f64>) -> Result<(), IdentError> {
    for (joint, column) in columns.column_iter().enumerate() {
        if let Some(i) = column.iter().position(|x| !x.is_finite()) {
            return Err(IdentError::Log {
                column: format!("{name}[{joint}]"),
                problem: format!("{} at sample {i}", column[i]),
                remedy: "remove these rows, or interpolate the missing samples",
            });
        }
    }
    Ok(())
}
