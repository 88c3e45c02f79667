//! The main result of the demo: a calibrated and learning controller on the plant `realistic`, cold and warmed up.

use crate::effects::{FreeMotion, calibrated, free_motion, free_motion_at, result_or_error};
use crate::error::ExperimentError;
use crate::run::FaultEnd;
use crate::setup::Setup;
use serde::Serialize;
use supple_model::Description;
use supple_plant::PlantOptions;

/// Approximate simulated time of one seed, for the display of progress \[s\].
pub(crate) const REALISTIC_S: f64 = 580.0;
/// The paper's lowest stiffness \[N/m\].
const SOFT_N_PER_M: f64 = 0.5;
/// Time of work after which the arm counts as warm \[s\].
const WARM_S: f64 = 1200.0;

/// Free motion at 5 N/m on the realistic plant, by seed, calibrated and learning: errors are measured after
/// [`crate::effects::LEARNING_S`] of motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RealisticRuns {
    /// Root mean square tip error on the sinusoid, cold, by seed \[m\].
    pub sinusoid_rms_m: Vec<f64>,
    /// Root mean square tip error on the arc, cold, by seed \[m\].
    pub arc_rms_m: Vec<f64>,
    /// Root mean square tip error on the sinusoid after 20 minutes of warm-up, by seed, with the model calibrated cold
    /// \[m\].
    pub warm_rms_m: Vec<f64>,
    /// Root mean square tip error on the sinusoid at 0.5 N/m, cold, by seed \[m\].
    pub soft_rms_m: Vec<f64>,
    /// False reports of contact in all of these runs while learning.
    pub false_latches: usize,
    /// Calibrated alone: root mean square tip error on the sinusoid, cold, by seed \[m\].
    pub calibrated_sinusoid_rms_m: Vec<f64>,
    /// Calibrated alone: root mean square tip error on the arc, cold, by seed \[m\].
    pub calibrated_arc_rms_m: Vec<f64>,
    /// Calibrated alone: root mean square tip error on the sinusoid after 20 minutes of warm-up, by seed \[m\].
    pub calibrated_warm_rms_m: Vec<f64>,
    /// Faults that ended runs early.
    pub ended: Vec<SeedFault>,
    /// Seeds without a result, with the reason: a calibration or a start that failed.
    pub failed: Vec<SeedFailure>,
}

/// Seed without a result, and the reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedFailure {
    /// The seed, counted from that of the demo.
    pub seed: u64,
    /// The reason.
    pub reason: String,
}

/// A fault that ended a run of one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedFault {
    /// The seed, counted from that of the demo.
    pub seed: u64,
    /// The fault.
    #[serde(flatten)]
    pub fault: FaultEnd,
}

/// Result of one seed.
pub(crate) struct RealisticSeed {
    learning: ColdAndWarm,
    soft: FreeMotion,
    calibrated: ColdAndWarm,
}

struct ColdAndWarm {
    cold: FreeMotion,
    warm: FreeMotion,
}

impl RealisticSeed {
    fn motions(&self) -> [&FreeMotion; 5] {
        let (learning, calibrated) = (&self.learning, &self.calibrated);
        [
            &learning.cold,
            &learning.warm,
            &self.soft,
            &calibrated.cold,
            &calibrated.warm,
        ]
    }
}

/// Calibrates on the arm with `options` and tracks, cold and warm. With a `model`, uses that model instead of a calibration. An
/// arm that cannot be calibrated is a result.
pub(crate) fn realistic_seed<const N: usize>(
    description: &Description,
    model: Option<&Description>,
    options: &PlantOptions,
    seed: u64,
) -> Result<Result<RealisticSeed, String>, ExperimentError> {
    result_or_error(tracked::<N>(description, model, options, seed))
}

fn tracked<const N: usize>(
    description: &Description,
    model: Option<&Description>,
    options: &PlantOptions,
    seed: u64,
) -> Result<RealisticSeed, ExperimentError> {
    let found = match model {
        Some(model) => model.clone(),
        None => calibrated::<N>(description, options, seed)?,
    };
    let setup = Setup::<N>::with_model(description, &found, seed)?;
    let track = |options: &PlantOptions, learning: bool| {
        free_motion(&setup.clone().with_plant_options(options)?, learning)
    };
    let warms = options
        .warm_up_dry_fraction
        .or(options.warm_up_viscous_fraction);
    let warm = PlantOptions {
        warmed_s: warms.map(|_| options.warmed_s.unwrap_or(0.0) + WARM_S),
        ..options.clone()
    };
    let both = |learning: bool| {
        Ok::<_, ExperimentError>(ColdAndWarm {
            cold: track(options, learning)?,
            warm: track(&warm, learning)?,
        })
    };
    Ok(RealisticSeed {
        learning: both(true)?,
        soft: free_motion_at(
            &setup.clone().with_plant_options(options)?,
            SOFT_N_PER_M,
            true,
        )?,
        calibrated: both(false)?,
    })
}

impl RealisticRuns {
    pub(crate) fn of(seeds: &[Result<RealisticSeed, String>]) -> RealisticRuns {
        let done = || seeds.iter().filter_map(|seed| seed.as_ref().ok());
        let motions =
            done().flat_map(|seed| [&seed.learning.cold, &seed.learning.warm, &seed.soft]);
        let (mut ended, mut failed) = (Vec::new(), Vec::new());
        for (seed, found) in (0..).zip(seeds) {
            match found {
                Err(reason) => failed.push(SeedFailure {
                    seed,
                    reason: reason.clone(),
                }),
                Ok(found) => {
                    let faults = found.motions().map(|motion| motion.ended.clone());
                    let faults = faults.into_iter().flatten();
                    ended.extend(faults.map(|fault| SeedFault { seed, fault }));
                }
            }
        }
        let of = |error: fn(&RealisticSeed) -> f64| done().map(error).collect();
        RealisticRuns {
            sinusoid_rms_m: of(|seed| seed.learning.cold.sinusoid_rms_m),
            arc_rms_m: of(|seed| seed.learning.cold.arc_rms_m),
            warm_rms_m: of(|seed| seed.learning.warm.sinusoid_rms_m),
            soft_rms_m: of(|seed| seed.soft.sinusoid_rms_m),
            calibrated_sinusoid_rms_m: of(|seed| seed.calibrated.cold.sinusoid_rms_m),
            calibrated_arc_rms_m: of(|seed| seed.calibrated.cold.arc_rms_m),
            calibrated_warm_rms_m: of(|seed| seed.calibrated.warm.sinusoid_rms_m),
            false_latches: motions.map(|motion| motion.false_latches).sum(),
            ended,
            failed,
        }
    }
}
