//! Measures which effects of a real arm prevent tracking at low stiffness: tracking at 5 N/m with each effect alone and with all
//! effects together.
//!
//! The plant has the effect; the controller's model comes from one of the [`ModelSource`]s, and the controller has no other
//! information about the effect. Single effects are larger than in `realistic`; all sizes are assumptions, see
//! `supple plant list`.

use crate::calibrate::{Calibration, calibrate};
use crate::error::ExperimentError;
use crate::metrics::Rms;
use crate::run::{FaultEnd, GainChange, Plan, run};
use crate::scenario;
use crate::setup::{Setup, Variant};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};
use supple_core::Trajectory;
use supple_model::{Description, with_dof};
use supple_plant::{PlantOptions, Scene};

/// Time of motion after which the error of a learning controller is measured: three periods of the sinusoid \[s\].
pub const LEARNING_S: f64 = 24.0;
/// Duration of the change to a lower stiffness \[s\].
const CHANGE_S: f64 = 2.0;

/// An effect with its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Name in the table.
    pub name: &'static str,
    /// Options of the plant.
    pub options: PlantOptions,
}

/// Source of the controller's model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelSource {
    /// The description, without the effect: a model identified without it.
    Nominal,
    /// A calibration on the arm with the effect, as by `supple calibrate`, with ripple runs if a motor has torque ripple.
    Calibrated,
    /// The calibrated model, which the learner refines while the arm moves. Errors are measured after [`LEARNING_S`] of motion.
    Learning,
}

impl ModelSource {
    /// All sources, in the order of the table.
    pub const ALL: [ModelSource; 3] = [
        ModelSource::Nominal,
        ModelSource::Calibrated,
        ModelSource::Learning,
    ];

    /// Returns the header of the table's column.
    pub fn name(self) -> &'static str {
        match self {
            ModelSource::Nominal => "not calibrated",
            ModelSource::Calibrated => "calibrated",
            ModelSource::Learning => "learning",
        }
    }
}

/// Free motion at 5 N/m with one effect, one model and one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FreeMotion {
    /// Root mean square tip error on the sinusoid \[m\].
    pub sinusoid_rms_m: f64,
    /// Root mean square tip error on the arc \[m\].
    pub arc_rms_m: f64,
    /// Number of contacts that the contact latch reported; all are false, because the space is empty.
    pub false_latches: usize,
    /// The first fault that ended a run early; the errors of that run are measured before the fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended: Option<FaultEnd>,
}

/// Result of one effect, one model and one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectRun {
    /// The effect.
    pub effect: &'static str,
    /// Source of the model.
    pub model: ModelSource,
    /// Seed of the calibration, the noise, and the signs and phases of the effect.
    pub seed: u64,
    /// The motion; `None` if calibration or motion failed.
    pub motion: Option<FreeMotion>,
    /// Reason of the failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
}

fn effect(name: &'static str, set: impl FnOnce(&mut PlantOptions)) -> Effect {
    let mut options = PlantOptions::default();
    set(&mut options);
    Effect { name, options }
}

/// Returns the rows of the table: no effect, each effect alone, all effects at modest size.
pub fn effects(arm: &Description) -> Vec<Effect> {
    vec![
        effect("none", |_| {}),
        effect("cables of 3000 N m/rad", |o| {
            o.cable_stiffness_nm_per_rad = Some(3000.0);
            o.cable_damping_ratio = Some(0.05);
        }),
        effect("cables of 1000 N m/rad", |o| {
            o.cable_stiffness_nm_per_rad = Some(1000.0);
            o.cable_damping_ratio = Some(0.05);
        }),
        effect("gears of 3000 N m/rad with 1 mrad of backlash", |o| {
            o.cable_stiffness_nm_per_rad = Some(3000.0);
            o.cable_damping_ratio = Some(0.05);
            o.backlash_rad = Some(0.001);
        }),
        effect("cogging of 0.3 N m", |o| o.ripple_nm = Some(0.3)),
        effect("torque ripple of 3 %", |o| {
            o.torque_ripple_fraction = Some(0.03)
        }),
        effect("dry friction 20 % up", |o| {
            o.dry_friction_change = Some(0.2)
        }),
        effect("cold: dry friction 30 %, viscous 50 % up", |o| {
            o.warm_up_dry_fraction = Some(0.3);
            o.warm_up_viscous_fraction = Some(0.5);
        }),
        effect("friction 10 % with load", |o| {
            o.friction_load_fraction = Some(0.1)
        }),
        effect("friction 5 % with direction", |o| {
            o.friction_direction_fraction = Some(0.05);
        }),
        effect("friction 10 % with angle", |o| {
            o.friction_angle_fraction = Some(0.1)
        }),
        effect("all friction possible at the motors", |o| {
            o.motor_friction_share = Some(1.0)
        }),
        effect("bristles a tenth as stiff", |o| {
            o.bristle_stiffness_factor = Some(0.1)
        }),
        effect("dead zone of 2 mN m", |o| o.dead_zone_nm = Some(2e-3)),
        effect("amplifier offset of 1 mN m", |o| {
            o.amplifier_offset_nm = Some(1e-3)
        }),
        effect("torque constants 2 % off", |o| {
            o.torque_constant_fraction = Some(0.02)
        }),
        effect("base tilted by 0.5 degrees", |o| {
            o.base_tilt_rad = Some(0.5_f64.to_radians());
        }),
        effect("encoder bias of 3 mrad", |o| {
            o.encoder_bias_rad = Some(3e-3)
        }),
        effect("hose of 0.3 N m/rad", |o| {
            o.hose_stiffness_nm_per_rad = Some(0.3)
        }),
        effect("tool 50 g too heavy", |o| o.tool_extra_kg = Some(0.05)),
        effect("one more cycle of delay", |o| {
            o.extra_delay_cycles = Some(1.0)
        }),
        effect("cycle jitter of 10 %", |o| {
            o.cycle_jitter_fraction = Some(0.1)
        }),
        Effect {
            name: "realistic: all, of modest size",
            options: PlantOptions::realistic_of(arm),
        },
    ]
}

/// Runs every effect with every model and seed, on all cores. `progress` receives the number of completed pairs of effect and
/// seed, and their total number. The results are in the order of effects, seeds and models.
///
/// # Errors
/// [`ExperimentError`] if the arm cannot do the motions. A calibration that fails is a result.
pub fn run_effects(
    description: &Description,
    effects: &[Effect],
    models: &[ModelSource],
    seeds: u64,
    progress: &(dyn Fn(usize, usize, &str) + Sync),
) -> Result<Vec<EffectRun>, ExperimentError> {
    let jobs: Vec<(&Effect, u64)> = effects
        .iter()
        .flat_map(|effect| (0..seeds).map(move |seed| (effect, seed)))
        .collect();
    let done = AtomicUsize::new(0);
    let each = jobs.par_iter().map(|(effect, seed)| {
        let runs =
            with_dof!(description.dof(), N => run_effect::<N>(description, effect, models, *seed))
                .map_err(ExperimentError::from)
                .flatten();
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(done, jobs.len(), effect.name);
        runs
    });
    let each: Result<Vec<_>, _> = each.collect();
    Ok(each?.into_iter().flatten().collect())
}

fn run_effect<const N: usize>(
    description: &Description,
    effect: &Effect,
    models: &[ModelSource],
    seed: u64,
) -> Result<Vec<EffectRun>, ExperimentError> {
    let nominal = models.iter().all(|model| *model == ModelSource::Nominal);
    let found = match nominal {
        true => Err("no calibration was asked for".to_owned()),
        false => result_or_error(calibrated::<N>(description, &effect.options, seed))?,
    };
    let track = |setup: Setup<N>, learning| {
        let setup = setup.with_plant_options(&effect.options)?;
        free_motion(&setup, learning)
    };
    let run = |model: &ModelSource| {
        let found = match (model, &found) {
            (ModelSource::Nominal, _) => {
                result_or_error(track(Setup::new(description, seed)?, false))?
            }
            (_, Err(reason)) => Err(reason.clone()),
            (model, Ok(found)) => {
                let setup = Setup::with_model(description, found, seed)?;
                result_or_error(track(setup, *model == ModelSource::Learning))?
            }
        };
        Ok(EffectRun {
            effect: effect.name,
            model: *model,
            seed,
            motion: found.as_ref().ok().cloned(),
            failed: found.err(),
        })
    };
    models.iter().map(run).collect()
}

/// Converts errors that mean that the arm cannot perform the experiment to a result: a fault outside of the trajectory, a
/// refused request, a joint that sticks, a fit that is refused. Returns other errors.
pub(crate) fn result_or_error<T>(
    done: Result<T, ExperimentError>,
) -> Result<Result<T, String>, ExperimentError> {
    match done {
        Ok(done) => Ok(Ok(done)),
        Err(
            error @ (ExperimentError::Fault { .. }
            | ExperimentError::FaultAtStart { .. }
            | ExperimentError::Refused { .. }
            | ExperimentError::Stuck { .. }
            | ExperimentError::Ident(_)),
        ) => Ok(Err(error.to_string())),
        Err(error) => Err(error),
    }
}

/// Returns the model of a calibration on the arm with these options.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrated<const N: usize>(
    description: &Description,
    options: &PlantOptions,
    seed: u64,
) -> Result<Description, ExperimentError> {
    let calibration = Calibration {
        plant: options.clone(),
        ..Calibration::new(seed)
    };
    Ok(calibrate::<N>(description, &calibration, &mut |_| {})?.description)
}

/// Tracks the sinusoid and the arc at 5 N/m in empty space. With `learning`, the error is measured after [`LEARNING_S`] of each
/// motion.
///
/// # Errors
/// [`ExperimentError`]; a fault is a result.
pub fn free_motion<const N: usize>(
    setup: &Setup<N>,
    learning: bool,
) -> Result<FreeMotion, ExperimentError> {
    free_motion_at(setup, scenario::STIFFNESS_N_PER_M, learning)
}

/// Does the same as [`free_motion`] at another stiffness.
///
/// # Errors
/// As [`free_motion`].
pub fn free_motion_at<const N: usize>(
    setup: &Setup<N>,
    stiffness_n_per_m: f64,
    learning: bool,
) -> Result<FreeMotion, ExperimentError> {
    let measured_from_s = if learning { LEARNING_S } else { 0.0 };
    let tracking = Tracking {
        stiffness_n_per_m,
        learning,
        change: None,
        measured_from_s,
    };
    tracking.run(setup)
}

/// Tracks the sinusoid and the arc at 5 N/m for [`LEARNING_S`] while learning, then changes to another stiffness, and measures the
/// error after that change.
///
/// # Errors
/// As [`free_motion`].
pub fn soft_motion<const N: usize>(
    setup: &Setup<N>,
    stiffness_n_per_m: f64,
) -> Result<FreeMotion, ExperimentError> {
    let tracking = Tracking {
        stiffness_n_per_m: scenario::STIFFNESS_N_PER_M,
        learning: true,
        change: Some(stiffness_n_per_m),
        measured_from_s: LEARNING_S + CHANGE_S,
    };
    tracking.run(setup)
}

struct Tracking {
    stiffness_n_per_m: f64,
    learning: bool,
    /// Stiffness after [`LEARNING_S`] \[N/m\].
    change: Option<f64>,
    measured_from_s: f64,
}

impl Tracking {
    fn run<const N: usize>(&self, setup: &Setup<N>) -> Result<FreeMotion, ExperimentError> {
        let mut false_latches = 0;
        let mut track = |name: &str, (trajectory, duration_s): (Trajectory, f64)| {
            let mut config = setup.config(&Variant::EXACT)?;
            let law = config.law.gains;
            config.law.gains = scenario::gains_like(&law, self.stiffness_n_per_m);
            let plan = Plan {
                name: name.to_owned(),
                config,
                plant: setup.plant(&Variant::EXACT, Scene::default()),
                trajectory,
                duration_s: self.measured_from_s + duration_s,
                learning: self.learning,
                gain_change: self.change.map(|stiffness_n_per_m| GainChange {
                    time_s: LEARNING_S,
                    gains: scenario::gains_like(&law, stiffness_n_per_m),
                    ramp_s: CHANGE_S,
                }),
            };
            let mut latched = false;
            let mut error = Rms::default();
            let run = run(&plan, &mut |cycle, time_s| {
                if let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference)
                    && time_s >= self.measured_from_s
                {
                    error.add((reference.position - cycle.truth.tip_position_m).norm());
                }
                let now = time_s.is_some() && cycle.output.in_contact;
                false_latches += usize::from(now && !latched);
                latched = now;
                Ok(())
            })?;
            // After a fault while learning, the error before the fault is the result.
            let rms_m = if error.is_empty() {
                run.rms_error_m
            } else {
                error.rms()
            };
            Ok::<_, ExperimentError>((rms_m, run.ended))
        };
        let (sinusoid_rms_m, sinusoid_ended) = track("sinusoid", setup.paths().sinusoid(1.0))?;
        let (arc_rms_m, arc_ended) = track("arc", setup.paths().arc(1.0))?;
        Ok(FreeMotion {
            sinusoid_rms_m,
            arc_rms_m,
            false_latches,
            ended: sinusoid_ended.or(arc_ended),
        })
    }
}
