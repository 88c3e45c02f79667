//! Options of an identification, as the package passes them.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use supple_ident::{
    Cancellation, Effects, FrictionChoice, FrictionColumns, LoadTorque, Method, Preparation,
    Procedure,
};
use supple_model::Description;

/// Options of an identification; the package checks names and fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    moving: Option<Vec<usize>>,
    couplings: Vec<(usize, usize)>,
    rate_hz: Option<f64>,
    cutoff_hz: Option<f64>,
    keep_every: usize,
    torque_delay_s: Option<f64>,
    accept_wrong_logs: bool,
    method: String,
    friction: Option<Shape>,
    effects: bool,
    /// Whether to fit a Stribeck effect, its speed included.
    pub find_stribeck: bool,
    rotor: bool,
    slow_rad_per_s: f64,
    prior_weight: Option<f64>,
    joint_noise_nm: Option<Vec<f64>>,
}

#[derive(FromPyObject)]
struct Shape {
    viscous: bool,
    coulomb: bool,
    offset: bool,
    asymmetry: bool,
    load: Option<String>,
    stribeck_rad_per_s: Option<f64>,
    band_rad_per_s: f64,
}

impl Shape {
    fn columns(self) -> PyResult<FrictionColumns> {
        let load = match self.load.as_deref() {
            None => None,
            Some("joint") => Some(LoadTorque::Joint),
            Some("motor") => Some(LoadTorque::Motor),
            Some(other) => {
                return Err(PyValueError::new_err(format!(
                    "FrictionColumns.load: expected \"joint\", \"motor\" or None, got {other:?}"
                )));
            }
        };
        Ok(FrictionColumns {
            viscous: self.viscous,
            coulomb: self.coulomb,
            offset: self.offset,
            asymmetry: self.asymmetry,
            load,
            stribeck_rad_per_s: self.stribeck_rad_per_s,
            band_rad_per_s: self.band_rad_per_s,
        })
    }
}

impl Options {
    /// Converts the options to those of the crate, for this arm.
    pub fn procedure(self, arm: &Description) -> PyResult<Procedure> {
        let method = match &self.method[..] {
            "ols" => Method::Ols,
            "wls" => Method::Wls,
            "irls" => Method::Irls,
            "consistent" => Method::Consistent,
            other => {
                return Err(PyValueError::new_err(format!(
                    "method: expected one of ols, wls, irls, consistent, got {other:?}"
                )));
            }
        };
        let friction = match self.friction {
            Some(shape) => FrictionChoice::Columns(shape.columns()?),
            None => FrictionChoice::Auto,
        };
        Ok(Procedure {
            effects: match self.effects {
                true => Effects::all(arm.motors().motor_from_joint.clone()),
                false => Effects::default(),
            },
            identified_joints: self.moving,
            couplings: self.couplings,
            preparation: Preparation {
                rate_hz: self.rate_hz,
                cutoff_hz: self.cutoff_hz,
                decimation_factor: self.keep_every,
                torque_delay_s: self.torque_delay_s.unwrap_or(0.0),
            },
            method,
            friction,
            rotor: self.rotor,
            rotor_deviation: None,
            slow_rad_per_s: self.slow_rad_per_s,
            prior_weight: self.prior_weight,
            joint_noise_nm: self.joint_noise_nm,
            estimate_delay: self.torque_delay_s.is_none(),
            accept_wrong_logs: self.accept_wrong_logs,
            cancellation: Cancellation::default(),
        })
    }
}
