//! Runs an experiment of `supple-experiment` and returns it as columns.

use crate::arm::Arm;
use crate::errors;
use crate::interrupt::interruptible;
use crate::plant_options::PlantEffects;
use crate::table::Table;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use supple_core::Trajectory;
use supple_experiment::probing::{ContactAccumulator, Stroke};
use supple_experiment::{
    Cycle, ExperimentError, Mismatch, Plan, Recorder, Run, Setup, Variant, run, scenario,
};
use supple_model::{Description, with_dof};
use supple_plant::Scene;

/// Options of an experiment; the package checks names and fills in defaults.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    experiment: String,
    duration_s: Option<f64>,
    stiffness_n_per_m: f64,
    speed: f64,
    gravity_error: f64,
    friction_error: f64,
    stribeck: bool,
    load: bool,
    fade: bool,
    learning: bool,
    seed: u64,
    log_dir: Option<PathBuf>,
    plant_options: PlantEffects,
}

/// The plant and the controller's model of it.
struct Arms<'a> {
    plant: &'a Description,
    model: Option<&'a Description>,
}

struct Outcome {
    run: Run,
    cycles: Table,
    strokes: Vec<Stroke>,
}

/// Runs an experiment in virtual time. `model` is the controller's model of the arm; without it, the controller
/// uses the arm itself with the given errors.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    arm: &Arm,
    model: Option<&Arm>,
    options: Options,
) -> PyResult<Bound<'py, PyDict>> {
    options.plant_options.check()?;
    let plant = arm.for_controller(py)?.clone();
    let model = model
        .map(|model| model.for_controller(py))
        .transpose()?
        .cloned();
    let log_dir = options.log_dir.clone();
    let outcome = interruptible(py, move |cancelled| {
        let arms = Arms {
            plant: &plant,
            model: model.as_ref(),
        };
        with_dof!(plant.dof(), N => sized::<N>(&arms, &options, cancelled))
            .map_err(ExperimentError::from)
            .flatten()
    })?;
    let outcome = outcome.map_err(errors::experiment)?;
    let dict = PyDict::new(py);
    let log = log_dir.map(|folder| folder.join(format!("{}.mcap", outcome.run.name)));
    dict.set_item("log", log)?;
    dict.set_item("rms_error_m", outcome.run.rms_error_m)?;
    dict.set_item("max_error_m", outcome.run.max_error_m)?;
    let ended = outcome.run.ended.map(|ended| (ended.ended_s, ended.fault));
    dict.set_item("ended", ended)?;
    dict.set_item("cycles", outcome.cycles.into_dict(py)?)?;
    dict.set_item("strokes", strokes(&outcome.strokes).into_dict(py)?)?;
    Ok(dict)
}

fn sized<const N: usize>(
    arms: &Arms<'_>,
    options: &Options,
    cancelled: &AtomicBool,
) -> Result<Outcome, ExperimentError> {
    let plan = plan::<N>(arms, options)?;
    let description = arms.model.unwrap_or(arms.plant);
    let mut recorder = match &options.log_dir {
        Some(folder) => Some(Recorder::create(
            folder,
            description,
            &plan,
            options.seed,
            options.plant_options.options.notes(),
        )?),
        None => None,
    };
    let mut meter = match plan.trajectory {
        Trajectory::Probe(probe) => Some(ContactAccumulator::new(probe)),
        _ => None,
    };
    let mut cycles = Table::default();
    let run = run(&plan, &mut |cycle, time_s| {
        if cancelled.load(Ordering::Relaxed) {
            return Err(ExperimentError::Interrupted);
        }
        if let Some(recorder) = &mut recorder {
            recorder.write_cycle(cycle)?;
        }
        if let Some(time_s) = time_s {
            row(&mut cycles, time_s, cycle);
            if let Some(meter) = &mut meter {
                meter.add_cycle(time_s, &cycle.truth, cycle.steps, &cycle.output);
            }
        }
        Ok(())
    })?;
    if let Some(recorder) = recorder {
        recorder.finish()?;
    }
    Ok(Outcome {
        run,
        cycles,
        strokes: meter.map_or_else(Vec::new, ContactAccumulator::finish),
    })
}

fn plan<const N: usize>(arms: &Arms<'_>, options: &Options) -> Result<Plan<N>, ExperimentError> {
    let setup = match arms.model {
        Some(model) => Setup::<N>::with_model(arms.plant, model, options.seed)?,
        None => Setup::<N>::new(arms.plant, options.seed)?,
    };
    let setup = setup.with_plant_options(&options.plant_options.options)?;
    let wrong = options.gravity_error != 0.0 || options.friction_error != 0.0;
    let variant = Variant {
        mismatch: wrong.then_some(Mismatch {
            gravity: options.gravity_error,
            friction: options.friction_error,
            seed: options.seed,
        }),
        stribeck: options.stribeck,
        load: options.load,
        fade: options.fade,
        ..Variant::EXACT
    };
    let mut config = setup.config(&variant)?;
    config.law.gains = scenario::gains_like(&config.law.gains, options.stiffness_n_per_m);
    let mut scene = Scene::default();
    let paths = setup.paths();
    let (trajectory, whole_s) = match &options.experiment[..] {
        "arc" => paths.arc(options.speed),
        "quadrant" => {
            let speed = options.speed * scenario::QUADRANT_SPEED_M_PER_S;
            let (quadrant, duration_s) = paths.quadrant(speed);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
        "probing" => {
            scene = scenario::block_at(&paths);
            let (probe, duration_s) = paths.probe(setup.tip_radius_m());
            (Trajectory::Probe(probe), duration_s)
        }
        _ => paths.sinusoid(options.speed),
    };
    Ok(Plan {
        name: options.experiment.clone(),
        config,
        plant: setup.plant(&variant, scene),
        trajectory,
        duration_s: options.duration_s.unwrap_or(whole_s),
        learning: options.learning,
        gain_change: None,
    })
}

fn row<const N: usize>(table: &mut Table, t: f64, cycle: &Cycle<'_, N>) {
    let (output, truth) = (&cycle.output, &cycle.truth);
    let reference = output
        .reference
        .map_or(truth.tip_position_m, |r| r.position);
    table.number("t", t);
    table.vector("q", output.position_rad.as_slice());
    table.vector("qd", output.velocity_rad_per_s.as_slice());
    table.vector("tau", output.torque_nm.as_slice());
    table.vector("reference_position_m", reference.as_slice());
    table.vector("tip_position_m", truth.tip_position_m.as_slice());
    table.vector("tip_force_n", cycle.measurement.force_n.as_slice());
    table.number("in_contact", f64::from(u8::from(output.in_contact)));
    table.end_row();
}

fn strokes(strokes: &[Stroke]) -> Table {
    let mut table = Table::default();
    for stroke in strokes {
        table.number("approach_m_per_s", stroke.approach_m_per_s);
        table.number("peak_filtered_n", stroke.peak_filtered_n);
        table.number("contact_s", stroke.contact_s);
        table.number("impulse_newton_s", stroke.impulse_newton_s);
        table.number("rest_force_n", stroke.rest_force_n);
        table.number("pressing_force_n", stroke.pressing_force_n);
        table.number("spring_force_n", stroke.spring_force_n);
        table.end_row();
    }
    table
}
