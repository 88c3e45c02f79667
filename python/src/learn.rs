//! Learning from the prediction error of a repeated motion.

use crate::arm::Arm;
use crate::arrays;
use crate::errors;
use crate::samples::{LogInput, Samples};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use supple_ident::{Learned, Learning, Preparation, SaveError, learn as learned};
use supple_model::{Description, with_dof};

/// Options of the learning; the package fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    moving: Vec<usize>,
    cutoff_hz: f64,
    keep_every: usize,
    torque_delay_s: f64,
    slow_rad_per_s: f64,
    friction_change: f64,
    payload_kg: Option<f64>,
    noise_nm: f64,
}

struct Found {
    description: Description,
    before_nm: Vec<f64>,
    after_nm: Vec<f64>,
    payload: Option<[f64; 4]>,
}

/// Updates friction and payload of an arm from logs of a repeated motion.
#[pyfunction]
pub fn learn<'py>(
    py: Python<'py>,
    arm: &Arm,
    logs: Vec<LogInput<'py>>,
    options: Options,
) -> PyResult<Bound<'py, PyDict>> {
    let description = arm.description();
    let samples = logs.iter().map(|log| Samples::read(log, description.dof()));
    let samples = samples.collect::<PyResult<Vec<_>>>()?;
    let found = py.detach(|| {
        with_dof!(description.dof(), N => sized::<N>(description, &samples, &options))
            .map_err(SaveError::Model)
            .flatten()
    });
    let found = found.map_err(errors::save)?;
    let dict = PyDict::new(py);
    let joints = [found.before_nm.len()];
    dict.set_item("before_nm", arrays::array(py, found.before_nm, &joints)?)?;
    dict.set_item("after_nm", arrays::array(py, found.after_nm, &joints)?)?;
    dict.set_item("payload", found.payload)?;
    dict.set_item("arm", Arm::new(found.description).map_err(errors::model)?)?;
    Ok(dict)
}

fn sized<const N: usize>(
    of: &Description,
    samples: &[Samples],
    options: &Options,
) -> Result<Found, SaveError> {
    let config = of.config::<N>()?;
    let preparation = Preparation {
        rate_hz: None,
        cutoff_hz: Some(options.cutoff_hz),
        decimation_factor: options.keep_every,
        torque_delay_s: options.torque_delay_s,
    };
    let motions = samples
        .iter()
        .map(|log| log.motion(&options.moving, &preparation));
    let motions = motions.collect::<Result<Vec<_>, _>>()?;
    let motions: Vec<_> = motions.into_iter().map(|(motion, _)| motion).collect();
    let learning = Learning {
        slow_rad_per_s: options.slow_rad_per_s,
        friction_change: options.friction_change,
        payload_kg: options.payload_kg,
        noise_nm: options.noise_nm,
    };
    let learnt = learned(&config, &motions, &options.moving, &learning)?;
    let description = learnt.description(of)?;
    let Learned {
        payload,
        before_nm,
        after_nm,
        ..
    } = learnt;
    Ok(Found {
        description,
        before_nm: before_nm.to_vec(),
        after_nm: after_nm.to_vec(),
        payload: payload.map(Into::into),
    })
}
