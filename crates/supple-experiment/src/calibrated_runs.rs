//! The main results of the demo: a controller that was calibrated on its arm and learns, in free motion and in contact.

use crate::effects::{FreeMotion, LEARNING_S, free_motion, result_or_error, soft_motion};
use crate::error::ExperimentError;
use crate::probing::{median_stroke, probe};
use crate::run::{FaultEnd, Plan};
use crate::scenario;
use crate::setup::{Setup, Variant};
use serde::Serialize;
use supple_core::Trajectory;
use supple_model::Description;
use supple_plant::PlantOptions;

/// Approximate simulated time of one seed, for the display of progress \[s\].
pub(crate) const SEED_S: f64 = 740.0;
/// The paper's lowest stiffness \[N/m\].
const SOFT_N_PER_M: f64 = 0.5;
/// Time of work after which the arm counts as warm \[s\].
const WARM_S: f64 = 1200.0;
/// Strokes that count in a probing run, after those while learning.
const STROKES: u32 = 3;

/// Free motion and probing by seed, with a model that was calibrated on the arm. Where the controller learns, values are measured
/// after [`crate::effects::LEARNING_S`] of motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibratedRuns {
    /// Learning: root mean square tip error on the sinusoid at 5 N/m, cold, by seed \[m\].
    pub sinusoid_rms_m: Vec<f64>,
    /// The same on the arc \[m\].
    pub arc_rms_m: Vec<f64>,
    /// The same on the sinusoid after 20 minutes of warm-up, with the model calibrated cold \[m\]; empty if the plant does not
    /// warm up.
    pub warm_rms_m: Vec<f64>,
    /// The same on the sinusoid, cold, at 0.5 N/m after learning at 5 N/m \[m\].
    pub soft_rms_m: Vec<f64>,
    /// False reports of contact in all of these runs.
    pub false_latches: usize,
    /// Learning: forces while pressing on a block.
    pub pressing: Vec<PressingForces>,
    /// Calibrated alone: root mean square tip error on the sinusoid at 5 N/m, cold, by seed \[m\].
    pub calibrated_sinusoid_rms_m: Vec<f64>,
    /// The same on the arc \[m\].
    pub calibrated_arc_rms_m: Vec<f64>,
    /// The same on the sinusoid after 20 minutes of warm-up \[m\]; empty if the plant does not warm up.
    pub calibrated_warm_rms_m: Vec<f64>,
    /// Faults that ended runs early.
    pub ended: Vec<SeedFault>,
    /// Seeds without a result, with the reason: a calibration or a start that failed; or without probing at one stiffness.
    pub failed: Vec<SeedFailure>,
}

/// Forces while pressing at one stiffness, see [`crate::probing::Stroke`]; medians over the strokes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PressingForces {
    /// Stiffness \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Force on the block by seed \[N\].
    pub pressing_force_n: Vec<f64>,
    /// Force of the spring by seed, `K (X - Xo)` \[N\].
    pub spring_force_n: Vec<f64>,
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
pub(crate) struct CalibratedSeed {
    learning: ColdAndWarm,
    soft: FreeMotion,
    calibrated: ColdAndWarm,
    pressing: [Result<Pressing, String>; 2],
}

struct ColdAndWarm {
    cold: FreeMotion,
    warm: Option<FreeMotion>,
}

/// Force on the block and force of the spring \[N\], or the fault that ended the probing.
type Pressing = Result<(f64, f64), FaultEnd>;

impl CalibratedSeed {
    fn while_learning(&self) -> impl Iterator<Item = &FreeMotion> {
        let learning = &self.learning;
        [&learning.cold, &self.soft]
            .into_iter()
            .chain(&learning.warm)
    }

    fn faults(&self) -> impl Iterator<Item = FaultEnd> {
        let calibrated = &self.calibrated;
        let motions = self
            .while_learning()
            .chain([&calibrated.cold])
            .chain(&calibrated.warm);
        let ended = motions.filter_map(|motion| motion.ended.clone());
        let pressing = self.pressing.iter().flatten();
        ended.chain(pressing.filter_map(|pressing| pressing.clone().err()))
    }
}

/// Tracks and probes on the arm with `options` and the model that was calibrated on it. An arm that cannot do it is a result.
pub(crate) fn calibrated_seed<const N: usize>(
    description: &Description,
    model: &Description,
    options: &PlantOptions,
    seed: u64,
) -> Result<Result<CalibratedSeed, String>, ExperimentError> {
    let of_seed = || {
        let setup = Setup::<N>::with_model(description, model, seed)?;
        let cold = setup.clone().with_plant_options(options)?;
        let warms = options
            .warm_up_dry_fraction
            .or(options.warm_up_viscous_fraction);
        let warm = match warms {
            None => None,
            Some(_) => Some(setup.with_plant_options(&PlantOptions {
                warmed_s: Some(options.warmed_s.unwrap_or(0.0) + WARM_S),
                ..options.clone()
            })?),
        };
        let both = |learning: bool| {
            let warm = warm.as_ref().map(|warm| free_motion(warm, learning));
            Ok::<_, ExperimentError>(ColdAndWarm {
                cold: free_motion(&cold, learning)?,
                warm: warm.transpose()?,
            })
        };
        let press = |stiffness_n_per_m| result_or_error(pressing(&cold, stiffness_n_per_m));
        let [low, high] = scenario::PAPER_STIFFNESS_N_PER_M;
        Ok(CalibratedSeed {
            learning: both(true)?,
            soft: soft_motion(&cold, SOFT_N_PER_M)?,
            calibrated: both(false)?,
            pressing: [press(low)?, press(high)?],
        })
    };
    result_or_error(of_seed())
}

/// Probes while learning; returns the forces of the last strokes.
fn pressing<const N: usize>(
    setup: &Setup<N>,
    stiffness_n_per_m: f64,
) -> Result<Pressing, ExperimentError> {
    let paths = setup.paths();
    let (probe_path, _) = paths.probe(setup.tip_radius_m());
    let learning = (LEARNING_S / probe_path.cycle_s()).ceil() as u32;
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains_like(&config.law.gains, stiffness_n_per_m);
    let plan = Plan {
        name: format!("probing_{stiffness_n_per_m}_n_per_m_learning"),
        config,
        plant: setup.plant(&Variant::EXACT, scenario::block_at(&paths)),
        trajectory: Trajectory::Probe(probe_path),
        duration_s: probe_path.cycle_s() * f64::from(learning + STROKES),
        learning: true,
        gain_change: None,
    };
    let found = probe(&plan)?;
    if let Some(fault) = found.ended {
        return Ok(Err(fault));
    }
    let counted = median_stroke(&found.strokes[learning as usize..]);
    Ok(Ok((counted.pressing_force_n, counted.spring_force_n)))
}

impl CalibratedRuns {
    pub(crate) fn of(seeds: &[Result<CalibratedSeed, String>]) -> CalibratedRuns {
        let done = || seeds.iter().filter_map(|seed| seed.as_ref().ok());
        let (mut ended, mut failed) = (Vec::new(), Vec::new());
        for (seed, found) in (0..).zip(seeds) {
            let mut fail = |reason: String| failed.push(SeedFailure { seed, reason });
            match found {
                Err(reason) => fail(reason.clone()),
                Ok(found) => {
                    ended.extend(found.faults().map(|fault| SeedFault { seed, fault }));
                    let refused = found.pressing.iter().filter_map(|of| of.as_ref().err());
                    refused.for_each(|reason| fail(format!("probing: {reason}")));
                }
            }
        }
        let of = |error: fn(&CalibratedSeed) -> f64| done().map(error).collect();
        let warm = |motion: fn(&CalibratedSeed) -> &ColdAndWarm| {
            let warm = done().filter_map(|seed| motion(seed).warm.as_ref());
            warm.map(|warm| warm.sinusoid_rms_m).collect()
        };
        let pressing = scenario::PAPER_STIFFNESS_N_PER_M.iter().enumerate();
        let pressing = pressing.map(|(at, stiffness_n_per_m)| {
            let forces = done().filter_map(|seed| seed.pressing[at].as_ref().ok()?.as_ref().ok());
            let (pressing_force_n, spring_force_n) = forces.copied().unzip();
            PressingForces {
                stiffness_n_per_m: *stiffness_n_per_m,
                pressing_force_n,
                spring_force_n,
            }
        });
        let motions = done().flat_map(CalibratedSeed::while_learning);
        CalibratedRuns {
            sinusoid_rms_m: of(|seed| seed.learning.cold.sinusoid_rms_m),
            arc_rms_m: of(|seed| seed.learning.cold.arc_rms_m),
            warm_rms_m: warm(|seed| &seed.learning),
            soft_rms_m: of(|seed| seed.soft.sinusoid_rms_m),
            false_latches: motions.map(|motion| motion.false_latches).sum(),
            pressing: pressing.collect(),
            calibrated_sinusoid_rms_m: of(|seed| seed.calibrated.cold.sinusoid_rms_m),
            calibrated_arc_rms_m: of(|seed| seed.calibrated.cold.arc_rms_m),
            calibrated_warm_rms_m: warm(|seed| &seed.calibrated),
            ended,
            failed,
        }
    }
}

impl PressingForces {
    /// Returns by how much the force on the block exceeds that of the spring, by seed \[N\].
    pub fn excess_n(&self) -> impl Iterator<Item = f64> {
        let pairs = self.pressing_force_n.iter().zip(&self.spring_force_n);
        pairs.map(|(pressing_n, spring_n)| pressing_n - spring_n)
    }
}
