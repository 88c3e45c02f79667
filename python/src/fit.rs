//! Identification: a fit with any number of joints.

use crate::arm::Arm;
use crate::arrays::{self, Argument, Array, Batch, States};
use crate::errors;
use crate::friction::Friction;
use crate::interrupt::interruptible;
use crate::options::Options;
use crate::samples::{LogInput, Samples};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use supple_core::ripple::{Harmonic, LINES};
use supple_core::{Body, Matrix, RippleTable, Vector};
use supple_ident::payload::{payload, torque_scale};
use supple_ident::weigh::{Weighing, weigh};
use supple_ident::{
    DMatrix, IdentError, Motion, Preparation, Procedure, RippleSearch, SaveError, Validation,
    Warning, fit_ripple, fit_with_stribeck, identify_motions,
};
use supple_model::{Description, ModelError, with_dof};

/// A fit with any number of joints.
pub trait Model: Send + Sync {
    fn identified_joints(&self) -> &[usize];
    fn payload(&self, motions: &[Motion], guess: &Body) -> Result<Body, IdentError>;
    fn torque_scale(
        &self,
        without: &[Motion],
        with: &[Motion],
        known: &Body,
    ) -> Result<Vec<Option<f64>>, IdentError>;
    fn weigh(
        &self,
        without: &[Motion],
        with: &[Motion],
        mass_kg: f64,
    ) -> Result<Weighing, IdentError>;
    fn ripple(
        &self,
        of: &Description,
        logs: &[Samples],
        search: &RippleSearch,
        cutoff_hz: f64,
    ) -> Result<Vec<Vec<Line>>, SaveError>;
    fn motion(&self, samples: &Samples) -> Result<Motion, IdentError>;
    fn predict(&self, states: &[States<'_>], out: &mut [f64]);
    fn predict_motion(&self, motion: &Motion) -> Result<DMatrix<f64>, IdentError>;
    fn validate(&self, samples: &Samples) -> Result<Validation, IdentError>;
    fn description(
        &self,
        of: &Description,
        ripple: Option<&[Vec<Line>]>,
    ) -> Result<Description, SaveError>;
    fn report(&self, known: &[supple_core::Friction]) -> Report;
}

/// Harmonic, sine and cosine amplitude \[N m\].
pub type Line = (u32, f64, f64);

/// Converts the lines of all motors to ripple tables.
fn tables<const N: usize>(ripple: &[Vec<Line>]) -> Result<[RippleTable; N], IdentError> {
    let wrong = |found: String| IdentError::Shape {
        argument: "ripple".to_owned(),
        expected: format!("{N} motors, each with {LINES} lines at most, of harmonics from 1 on"),
        found,
    };
    if ripple.len() != N {
        return Err(wrong(format!("{} motors", ripple.len())));
    }
    let mut tables = [RippleTable::NONE; N];
    for (table, lines) in tables.iter_mut().zip(ripple) {
        let harmonics = lines
            .iter()
            .map(|&(harmonic, sine_nm, cosine_nm)| Harmonic {
                harmonic,
                sine_nm,
                cosine_nm,
                ..Harmonic::default()
            });
        let harmonics: Vec<Harmonic> = harmonics.collect();
        *table = RippleTable::new(&harmonics).ok_or_else(|| wrong(format!("{lines:?}")))?;
    }
    Ok(tables)
}

/// Results of a fit with a run-time number of joints.
pub struct Report {
    columns: Vec<(String, f64)>,
    base_names: Vec<String>,
    null_space: Vec<String>,
    base_parameters: Vec<f64>,
    std: Vec<f64>,
    condition: f64,
    moving: Vec<usize>,
    noise_nm: Vec<f64>,
    training_relative: f64,
    gap: Option<f64>,
    friction: Vec<supple_core::Friction>,
    choices: Vec<(String, String)>,
}

impl<const N: usize> Model for supple_ident::Fit<N> {
    fn identified_joints(&self) -> &[usize] {
        self.columns.identified_joints()
    }

    fn payload(&self, motions: &[Motion], guess: &Body) -> Result<Body, IdentError> {
        payload(self, motions, guess)
    }

    fn torque_scale(
        &self,
        without: &[Motion],
        with: &[Motion],
        known: &Body,
    ) -> Result<Vec<Option<f64>>, IdentError> {
        torque_scale(self, without, with, known)
    }

    fn weigh(
        &self,
        without: &[Motion],
        with: &[Motion],
        mass_kg: f64,
    ) -> Result<Weighing, IdentError> {
        weigh(self, without, with, mass_kg)
    }

    fn ripple(
        &self,
        of: &Description,
        logs: &[Samples],
        search: &RippleSearch,
        cutoff_hz: f64,
    ) -> Result<Vec<Vec<Line>>, SaveError> {
        let preparation = Preparation {
            cutoff_hz: Some(cutoff_hz),
            decimation_factor: 1,
            ..self.preparation
        };
        let motions = logs
            .iter()
            .map(|log| log.motion(self.columns.identified_joints(), &preparation));
        let motions = motions.collect::<Result<Vec<_>, _>>()?;
        let motions: Vec<_> = motions.into_iter().map(|(motion, _)| motion).collect();
        let motors = of.motors();
        let motor_from_joint = Matrix::<N, N>::from_fn(|i, j| motors.motor_from_joint[(i, j)]);
        let tables = fit_ripple(self, &motions, &motor_from_joint, search)?;
        let lines = |table: &RippleTable| {
            let lines = table.harmonics().iter();
            lines
                .map(|line| (line.harmonic, line.sine_nm, line.cosine_nm))
                .collect()
        };
        Ok(tables.iter().map(lines).collect())
    }

    fn motion(&self, samples: &Samples) -> Result<Motion, IdentError> {
        Ok(samples
            .motion(self.columns.identified_joints(), &self.preparation)?
            .0)
    }

    fn predict(&self, states: &[States<'_>], out: &mut [f64]) {
        for (k, out) in out.chunks_exact_mut(N).enumerate() {
            let [q, qd, qdd] =
                core::array::from_fn(|a| Vector::<N>::from_column_slice(states[a].at(k)));
            let tau = supple_ident::Fit::predict(self, &q, &qd, &qdd);
            out.copy_from_slice(tau.as_slice());
        }
    }

    fn predict_motion(&self, motion: &Motion) -> Result<DMatrix<f64>, IdentError> {
        supple_ident::Fit::predict_motion(self, motion)
    }

    fn validate(&self, samples: &Samples) -> Result<Validation, IdentError> {
        self.validate_motion(&self.motion(samples)?)
    }

    fn description(
        &self,
        of: &Description,
        ripple: Option<&[Vec<Line>]>,
    ) -> Result<Description, SaveError> {
        let tables = ripple.map(tables::<N>).transpose()?;
        supple_ident::Fit::description(self, of, tables.as_ref())
    }

    fn report(&self, known: &[supple_core::Friction]) -> Report {
        let names = self.columns.names();
        Report {
            base_names: self.base.text(&names),
            null_space: self.base.null_space_text(&names),
            columns: names.into_iter().zip(self.x.iter().copied()).collect(),
            base_parameters: self.base_parameters().as_slice().to_vec(),
            std: self.base_std.as_slice().to_vec(),
            condition: self.base.condition,
            moving: self.columns.identified_joints().to_vec(),
            noise_nm: self.noise_nm.clone(),
            training_relative: self.training_relative,
            gap: self.optimality_gap,
            friction: self.friction_with(known).to_vec(),
            choices: self
                .choices
                .iter()
                .map(|choice| (choice.subject.to_owned(), choice.table.to_string()))
                .collect(),
        }
    }
}

/// Private class on which `supple.Fit` is built.
#[pyclass(frozen, module = "supple._native")]
pub struct Fit {
    of: Description,
    model: Box<dyn Model>,
    motions: Vec<Motion>,
}

impl Fit {
    /// Returns the description of the nominal arm.
    pub fn description(&self) -> &Description {
        &self.of
    }

    /// Returns the fitted model.
    pub fn model(&self) -> &dyn Model {
        &*self.model
    }

    /// Returns the prepared logs that were fitted.
    pub fn fitted(&self) -> &[Motion] {
        &self.motions
    }

    /// Prepares logs like the fitted ones.
    pub fn motions_of(&self, logs: &[Samples]) -> PyResult<Vec<Motion>> {
        let motions = logs.iter().map(|log| self.model.motion(log));
        motions
            .collect::<Result<_, _>>()
            .map_err(errors::identification)
    }
}

#[pymethods]
impl Fit {
    /// All results by name.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let report = self.model.report(self.of.friction());
        let dict = PyDict::new(py);
        let vector = |values: Vec<f64>| {
            let shape = [values.len()];
            arrays::array(py, values, &shape)
        };
        dict.set_item("columns", report.columns)?;
        dict.set_item("base_names", report.base_names)?;
        dict.set_item("null_space", report.null_space)?;
        dict.set_item("base_parameters", vector(report.base_parameters)?)?;
        dict.set_item("std", vector(report.std)?)?;
        dict.set_item("condition", report.condition)?;
        dict.set_item("moving", report.moving)?;
        dict.set_item("noise_nm", vector(report.noise_nm)?)?;
        dict.set_item("training_relative", report.training_relative)?;
        dict.set_item("gap", report.gap)?;
        let friction = report.friction.into_iter().map(|inner| Friction { inner });
        dict.set_item("friction", friction.collect::<Vec<_>>())?;
        dict.set_item("choices", report.choices)?;
        Ok(dict)
    }

    /// The prepared samples of each fitted log; `predicted` has one column for each moving joint, with dry
    /// friction filtered like the torques.
    fn motions<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let of = |motion: &Motion| {
            let dict = PyDict::new(py);
            let predicted = self.model.predict_motion(motion);
            let predicted = predicted.map_err(errors::identification)?;
            dict.set_item("predicted", matrix(py, &predicted)?)?;
            let times = (0..motion.samples()).map(|i| i as f64 / motion.rate_hz);
            dict.set_item(
                "t",
                arrays::array(py, times.collect(), &[motion.samples()])?,
            )?;
            for (name, columns) in [
                ("q", &motion.q),
                ("qd", &motion.qd),
                ("qdd", &motion.qdd),
                ("tau", &motion.tau),
            ] {
                dict.set_item(name, matrix(py, columns)?)?;
            }
            Ok(dict)
        };
        self.motions.iter().map(of).collect()
    }

    /// The nominal arm.
    fn arm_given(&self) -> PyResult<Arm> {
        Arm::new(self.of.clone()).map_err(errors::model)
    }

    /// The identified arm, as a description that the controller loads.
    #[pyo3(signature = (ripple = None))]
    fn arm(&self, ripple: Option<Vec<Vec<Line>>>) -> PyResult<Arm> {
        let description = self.model.description(&self.of, ripple.as_deref());
        let description = description.map_err(errors::save)?;
        Arm::new(description).map_err(errors::model)
    }

    fn predict<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        qdd: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py>> {
        let arguments: [Argument<'_, 'py>; 3] = [("q", q), ("qd", qd), ("qdd", qdd)];
        let dof = self.of.dof();
        let batch = Batch::read(&arguments, dof)?;
        let shape = [&batch.shape[..], &[dof]].concat();
        let (array, mut writable) = arrays::output(py, None, &shape)?;
        let states = batch.states()?;
        let values = writable.as_slice_mut()?;
        py.detach(|| self.model.predict(&states, values));
        Ok(array)
    }

    fn validate<'py>(&self, py: Python<'py>, log: LogInput<'py>) -> PyResult<Bound<'py, PyDict>> {
        let samples = Samples::read(&log, self.of.dof())?;
        let validation = py.detach(|| self.model.validate(&samples));
        let validation = validation.map_err(errors::identification)?;
        let dict = PyDict::new(py);
        let joints = validation.rms_nm.len();
        dict.set_item("verdict", validation.verdict())?;
        dict.set_item("rms", arrays::array(py, validation.rms_nm, &[joints])?)?;
        dict.set_item(
            "relative",
            arrays::array(py, validation.relative, &[joints])?,
        )?;
        dict.set_item("total_relative", validation.total_relative)?;
        dict.set_item("positive_definite", validation.positive_definite)?;
        Ok(dict)
    }
}

fn matrix<'py>(py: Python<'py>, columns: &DMatrix<f64>) -> PyResult<Array<'py>> {
    let (rows, width) = columns.shape();
    arrays::array(py, columns.transpose().as_slice().to_vec(), &[rows, width])
}

/// Identifies `arm` from logs; returns the fit and its warnings.
#[pyfunction]
pub fn identify(
    py: Python<'_>,
    arm: &Arm,
    logs: Vec<LogInput<'_>>,
    options: Options,
) -> PyResult<(Fit, Vec<String>)> {
    let of = arm.description().clone();
    let logs = logs.iter().map(|log| Samples::read(log, of.dof()));
    let logs = logs.collect::<PyResult<Vec<_>>>()?;
    let find_stribeck = options.find_stribeck;
    let mut procedure = options.procedure(&of)?;
    let whole = of.clone();
    let found = interruptible(py, move |cancelled| -> Result<_, Refused> {
        procedure.cancellation = Arc::clone(cancelled).into();
        with_dof!(whole.dof(), N => sized::<N>(&whole, &logs, &procedure, find_stribeck))?
    })?;
    let (model, motions, warnings) = found.map_err(|refused| match refused {
        Refused::Model(error) => errors::model(error),
        Refused::Identification(error) => errors::identification(error),
    })?;
    let warnings = warnings.iter().map(Warning::to_string).collect();
    Ok((Fit { of, model, motions }, warnings))
}

enum Refused {
    Model(ModelError),
    Identification(IdentError),
}

impl From<ModelError> for Refused {
    fn from(error: ModelError) -> Self {
        Refused::Model(error)
    }
}

impl From<IdentError> for Refused {
    fn from(error: IdentError) -> Self {
        Refused::Identification(error)
    }
}

type Found = (Box<dyn Model>, Vec<Motion>, Vec<Warning>);

fn sized<const N: usize>(
    of: &Description,
    logs: &[Samples],
    procedure: &Procedure,
    find_stribeck: bool,
) -> Result<Found, Refused> {
    let arm = of.arm::<N>()?;
    let moving = procedure.identified_joints(N)?;
    let (mut motions, mut warnings) = (Vec::new(), Vec::new());
    for log in logs {
        let (motion, result_warnings) = log.checked_motion(&arm, &moving, procedure)?;
        motions.push(motion);
        warnings.extend(result_warnings);
    }
    let fit = if find_stribeck {
        fit_with_stribeck(&arm, &motions, &moving, procedure)?
    } else {
        identify_motions(&arm, &motions, &moving, procedure)?
    };
    warnings.extend(fit.warnings.iter().cloned());
    Ok((Box::new(fit), motions, warnings))
}
