//! Excitation: its design, and a simulated arm that tracks it.

use crate::arm::Arm;
use crate::arrays;
use crate::errors;
use crate::interrupt::interruptible;
use crate::plant_options::PlantEffects;
use crate::table::Table;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use supple_experiment::calibrate::{Calibration, log_of, plant_of};
use supple_experiment::{ExperimentError, excitation};
use supple_ident::excitation_design::{
    self, Criterion, DesignOptions, ExcitationDesign, Workspace,
};
use supple_ident::{FourierCoefficients, IdentError, Log};
use supple_model::{Description, ModelError, with_dof};

/// Options of the design; the package checks names and fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Request {
    moving: Vec<usize>,
    period_s: f64,
    periods: f64,
    d_optimality: bool,
    workspace: Option<([f64; 3], [f64; 3])>,
    candidates: usize,
    seed: u64,
    rate_hz: f64,
}

/// A Fourier series with a run-time number of joints.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Series {
    centre_rad: Vec<f64>,
    sine_rad: Vec<Vec<f64>>,
    cosine_rad: Vec<Vec<f64>>,
    angular_frequency_rad_per_s: f64,
    duration_s: f64,
    ramp_s: f64,
}

impl From<Series> for FourierCoefficients {
    fn from(series: Series) -> FourierCoefficients {
        FourierCoefficients {
            centre_rad: series.centre_rad,
            sine_rad: series.sine_rad,
            cosine_rad: series.cosine_rad,
            angular_frequency_rad_per_s: series.angular_frequency_rad_per_s,
            duration_s: series.duration_s,
            ramp_s: series.ramp_s,
        }
    }
}

/// Searches for an excitation. `progress` receives the number of candidates and the best value so far, at most
/// a hundred times. An exception in `progress` and a signal's stop the search.
#[pyfunction]
pub fn design_excitation<'py>(
    py: Python<'py>,
    arm: &Arm,
    request: Request,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let description = arm.description();
    let every = (request.candidates / 100).max(1);
    let mut raised: Option<PyErr> = None;
    let mut report_progress = |tried: usize, best: f64| {
        let result = Python::attach(|py| {
            py.check_signals()?;
            match &progress {
                Some(progress) if tried.is_multiple_of(every) => {
                    progress.call1(py, (tried, best)).map(drop)
                }
                _ => Ok(()),
            }
        });
        if let Err(error) = result {
            raised = Some(error);
            // The search has no other way out; its state is dropped.
            resume_unwind(Box::new("stopped"));
        }
    };
    let columns = py.detach(|| {
        let search = || with_dof!(description.dof(), N => searched::<N>(description, &request, &mut report_progress));
        catch_unwind(AssertUnwindSafe(search))
    });
    let columns = match (columns, raised) {
        (_, Some(error)) => return Err(error),
        (Err(panic), None) => resume_unwind(panic),
        (Ok(columns), None) => columns.map_err(Refused::Model).flatten(),
    };
    let found = columns.map_err(|refused| match refused {
        Refused::Model(error) => errors::model(error),
        Refused::Design(error) => errors::identification(error),
    })?;
    let dict = found.table.into_dict(py)?;
    dict.set_item("rank", found.rank)?;
    dict.set_item("condition", found.condition)?;
    let candidates = found.history.len();
    dict.set_item("history", arrays::array(py, found.history, &[candidates])?)?;
    let series = PyDict::new(py);
    series.set_item("centre_rad", found.series.centre_rad)?;
    series.set_item("sine_rad", found.series.sine_rad)?;
    series.set_item("cosine_rad", found.series.cosine_rad)?;
    let omega = found.series.angular_frequency_rad_per_s;
    series.set_item("angular_frequency_rad_per_s", omega)?;
    series.set_item("duration_s", found.series.duration_s)?;
    series.set_item("ramp_s", found.series.ramp_s)?;
    dict.set_item("series", series)?;
    Ok(dict)
}

enum Refused {
    Model(ModelError),
    Design(IdentError),
}

struct Found {
    table: Table,
    series: FourierCoefficients,
    rank: usize,
    condition: f64,
    history: Vec<f64>,
}

fn searched<const N: usize>(
    description: &Description,
    request: &Request,
    report_progress: &mut dyn FnMut(usize, f64),
) -> Result<Found, Refused> {
    let config = description.config::<N>().map_err(Refused::Model)?;
    let home = description.home::<N>().map_err(Refused::Model)?;
    let wanted = DesignOptions {
        excited_joints: request.moving.clone(),
        period_s: request.period_s,
        periods: request.periods,
        criterion: if request.d_optimality {
            Criterion::DOptimality
        } else {
            Criterion::Condition
        },
        workspace: request
            .workspace
            .map(|(lower_m, upper_m)| Workspace { lower_m, upper_m }),
        candidates: request.candidates,
        seed: request.seed,
    };
    let designed = excitation_design::design(&config, &home, &wanted, report_progress)
        .map_err(Refused::Design)?;
    Ok(series_for_python(&designed, request.rate_hz))
}

fn series_for_python<const N: usize>(designed: &ExcitationDesign<N>, rate_hz: f64) -> Found {
    let series = &designed.series;
    let mut table = Table::default();
    for i in 0..=(series.duration_s * rate_hz).floor() as usize {
        let t = i as f64 / rate_hz;
        let at = series.at(t);
        table.number("t", t);
        table.vector("q", at.position_rad.as_slice());
        table.vector("qd", at.velocity_rad_per_s.as_slice());
        table.vector("qdd", at.acceleration_rad_per_s2.as_slice());
        table.end_row();
    }
    Found {
        table,
        series: FourierCoefficients::from(series),
        rank: designed.rank,
        condition: designed.condition,
        history: designed.history.clone(),
    }
}

/// Options of the simulated excitation; the package checks names and fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ExciteOptions {
    encoder_noise_rad: Option<f64>,
    load: bool,
    seed: u64,
    log_dir: Option<PathBuf>,
    plant_options: PlantEffects,
}

/// Simulates an arm that tracks a series and returns its log. `model` is the controller's model of the arm.
#[pyfunction]
pub fn excite<'py>(
    py: Python<'py>,
    arm: &Arm,
    model: &Arm,
    series: Series,
    options: ExciteOptions,
) -> PyResult<Bound<'py, PyDict>> {
    options.plant_options.check()?;
    let (truth, known) = (
        arm.for_controller(py)?.clone(),
        model.for_controller(py)?.clone(),
    );
    let log_dir = options.log_dir.clone();
    let series = FourierCoefficients::from(series);
    let log = interruptible(py, move |_| {
        with_dof!(truth.dof(), N => followed::<N>(&truth, &known, &series, &options))
            .map_err(ExperimentError::from)
            .flatten()
    })?;
    let (log, period_s) = log.map_err(errors::experiment)?;
    let (samples, joints) = log.q_rad.shape();
    let dict = PyDict::new(py);
    let rows = |columns: &supple_ident::DMatrix<f64>| {
        arrays::array(
            py,
            columns.transpose().as_slice().to_vec(),
            &[samples, joints],
        )
    };
    dict.set_item("t", arrays::array(py, log.t_s.clone(), &[samples])?)?;
    dict.set_item("q", rows(&log.q_rad)?)?;
    dict.set_item("tau", rows(&log.tau_nm)?)?;
    dict.set_item("period_s", period_s)?;
    let path = log_dir.map(|folder| folder.join("excitation.mcap"));
    dict.set_item("log", path)?;
    Ok(dict)
}

fn followed<const N: usize>(
    truth: &Description,
    known: &Description,
    series: &FourierCoefficients,
    options: &ExciteOptions,
) -> Result<(Log, f64), ExperimentError> {
    let calibration = Calibration {
        encoder_noise_rad: options.encoder_noise_rad,
        load: options.load,
        plant: options.plant_options.options.clone(),
        ..Calibration::new(options.seed)
    };
    let plant = plant_of::<N>(truth, &calibration)?;
    let (config, home) = (known.config::<N>()?, truth.home::<N>()?);
    let series = series.fourier::<N>()?;
    let sequence = excitation("excitation", &config, &plant, &home, &[series]);
    let recordings = sequence.record_with_notes(
        options.log_dir.as_deref(),
        known,
        options.seed,
        options.plant_options.options.notes(),
    )?;
    Ok((log_of(&recordings[0]), config.period_s))
}
