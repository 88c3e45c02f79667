//! Data behind the contact-detection parameters, for an arm with held roll (`wam4`).
//!
//! For several bandwidths, the maximum opposing force beyond friction in free motion over
//! perturbed models, and its minimum within 40 ms of a first touch. A threshold between the two distinguishes
//! contact from free motion.
//! `contact_share` of the same folder chooses what the latch leaves of the friction feed-forward.

use rayon::prelude::*;
use supple_core::Trajectory;
use supple_core::trajectory::Probe;
use supple_experiment::{ExperimentError, Mismatch, Plan, Setup, Variant, run, scenario};
use supple_model::Description;
use supple_plant::Scene;

const BANDWIDTHS: [(f64, f64); 4] = [(180.0, 40.0), (400.0, 80.0), (500.0, 120.0), (600.0, 120.0)];
const STIFFNESS_N_PER_M: [f64; 4] = [5.0, 25.0, 75.0, 125.0];
/// A threshold that is never reached.
const NEVER_N: f64 = 1e9;
const FIRST_TOUCH_S: f64 = 0.04;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = Description::asset("wam4")?;
    let setup = Setup::<4>::new(&description, 0)?;
    println!("estimator  observer  free motion  first touch   [rad/s, rad/s, N, N]");
    for (estimator, observer) in BANDWIDTHS {
        let free = (0..12)
            .into_par_iter()
            .map(|seed| {
                force_beyond_friction_uncertainty(
                    &free_plan(&setup, seed)?,
                    estimator,
                    observer,
                    None,
                )
            })
            .collect::<Result<Vec<_>, _>>()?;
        let touch = STIFFNESS_N_PER_M
            .par_iter()
            .map(|stiffness| {
                let (plan, probe) = probing_plan(&setup, *stiffness)?;
                force_beyond_friction_uncertainty(&plan, estimator, observer, Some(probe))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let max_free = free.into_iter().fold(0.0, f64::max);
        let min_touch = touch.into_iter().fold(f64::MAX, f64::min);
        println!("{estimator:9}  {observer:8}  {max_free:11.2}  {min_touch:11.2}");
    }
    Ok(())
}

fn free_plan(setup: &Setup<4>, seed: u64) -> Result<Plan<4>, ExperimentError> {
    let variant = Variant {
        mismatch: Some(Mismatch::identified(seed)),
        stribeck: seed.is_multiple_of(2),
        ..Variant::EXACT
    };
    let (trajectory, duration_s) = match seed % 4 {
        0 => scenario::sinusoid(0.5),
        1 => scenario::sinusoid(1.0),
        2 => scenario::arc(),
        _ => {
            let (quadrant, duration_s) = scenario::quadrant(scenario::QUADRANT_SPEED_M_PER_S);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
    };
    let mut config = setup.config(&variant)?;
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    Ok(Plan {
        name: format!("free motion, model {seed}"),
        config,
        plant: setup.plant(&variant, Scene::default()),
        trajectory,
        duration_s,
        learning: false,
        gain_change: None,
    })
}

fn probing_plan(
    setup: &Setup<4>,
    stiffness_n_per_m: f64,
) -> Result<(Plan<4>, Probe), ExperimentError> {
    let (probe, _) = scenario::probe(setup.tip_radius_m());
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains(stiffness_n_per_m);
    let plan = Plan {
        name: format!("probing at {stiffness_n_per_m} N/m"),
        config,
        plant: setup.plant(&Variant::EXACT, scenario::block()),
        trajectory: Trajectory::Probe(probe),
        duration_s: probe.cycle_s(),
        learning: false,
        gain_change: None,
    };
    Ok((plan, probe))
}

/// Returns the maximum opposing force beyond the friction uncertainty; with a probe, within 40 ms of the first touch.
fn force_beyond_friction_uncertainty(
    plan: &Plan<4>,
    estimator_rad_per_s: f64,
    observer_rad_per_s: f64,
    probe: Option<Probe>,
) -> Result<f64, ExperimentError> {
    let mut plan = plan.clone();
    plan.config.estimator_rad_per_s = estimator_rad_per_s;
    plan.config.latch.observer_rad_per_s = observer_rad_per_s;
    plan.config.latch.threshold_n = NEVER_N;
    // The configured threshold, so that the uncertainty in it can be separated.
    plan.config.latch.false_alarms_per_hour = f64::INFINITY;
    let mut max_force_n = 0.0_f64;
    let mut touched_s = None;
    run(&plan, &mut |cycle, time_s| {
        let Some(time_s) = time_s else {
            return Ok(());
        };
        if touched_s.is_none() && cycle.steps.iter().any(|step| step.force_n.z > 0.0) {
            touched_s = Some(time_s);
        }
        let counts = match (probe, touched_s) {
            (None, _) => true,
            (Some(_), Some(touched_s)) => time_s - touched_s < FIRST_TOUCH_S,
            (Some(_), None) => false,
        };
        if counts {
            // After a reversal the whole threshold is doubled, including the friction uncertainty.
            let reversing = cycle.output.contact_threshold_n > 1.5 * NEVER_N;
            let factor = if reversing { 2.0 } else { 1.0 };
            let friction_uncertainty_n = cycle.output.contact_threshold_n / factor - NEVER_N;
            max_force_n =
                max_force_n.max(cycle.output.force_against_n / factor - friction_uncertainty_n);
        }
        Ok(())
    })?;
    Ok(max_force_n)
}
