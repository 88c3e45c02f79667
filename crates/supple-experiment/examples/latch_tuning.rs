//! What the numbers of the contact latch rest on, for an arm with its roll held (`wam4`).
//!
//! First table: for several bandwidths, the greatest force against the reference's motion that free
//! motion shows beyond what friction explains, over perturbed models, and the least that a first
//! touch shows within 40 ms. A threshold between the two tells them apart.
//! Second table: for several shares of the dry feed-forward left on in contact, the resting force over
//! the spring's, and the line of the impulse over stiffness.

use rayon::prelude::*;
use supple_core::Trajectory;
use supple_core::trajectory::Probe;
use supple_experiment::metrics::LineFit;
use supple_experiment::probing::{ContactMeter, Stroke, median_stroke};
use supple_experiment::{ExperimentError, Mismatch, Plan, Setup, Variant, run, scenario};
use supple_model::Description;
use supple_plant::Scene;

const BANDWIDTHS: [(f64, f64); 4] = [(180.0, 40.0), (400.0, 80.0), (500.0, 120.0), (600.0, 120.0)];
const SHARES: [f64; 5] = [0.0, 0.3, 0.55, 0.7, 1.0];
const STIFFNESS_N_PER_M: [f64; 4] = [5.0, 25.0, 75.0, 125.0];
/// A threshold that nothing reaches.
const NEVER_N: f64 = 1e9;
const FIRST_TOUCH_S: f64 = 0.04;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = Description::asset("wam4")?;
    let setup = Setup::<4>::new(&description, 0)?;
    println!("estimator  observer  free motion  first touch   [rad/s, rad/s, N, N]");
    for (estimator, observer) in BANDWIDTHS {
        let free = (0..12)
            .into_par_iter()
            .map(|seed| beyond_doubt(&free_plan(&setup, seed)?, estimator, observer, None))
            .collect::<Result<Vec<_>, _>>()?;
        let touch = STIFFNESS_N_PER_M
            .par_iter()
            .map(|stiffness| {
                let (plan, probe) = probing_plan(&setup, *stiffness)?;
                beyond_doubt(&plan, estimator, observer, Some(probe))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let greatest = free.into_iter().fold(0.0, f64::max);
        let least = touch.into_iter().fold(f64::MAX, f64::min);
        println!("{estimator:9}  {observer:8}  {greatest:11.2}  {least:11.2}");
    }
    println!("\nshare  rest force - K e at 5, 25, 75, 125 N/m [N]   impulse over K [N s]");
    let press_m = press_m(setup.tip_radius_m());
    for share in SHARES {
        let strokes = STIFFNESS_N_PER_M
            .par_iter()
            .map(|stiffness| probe_once(&setup, *stiffness, share))
            .collect::<Result<Vec<_>, _>>()?;
        let beyond: Vec<String> = strokes
            .iter()
            .zip(STIFFNESS_N_PER_M)
            .map(|(stroke, k)| format!("{:6.2}", stroke.rest_force_n - k * press_m))
            .collect();
        let points: Vec<_> = strokes
            .iter()
            .zip(STIFFNESS_N_PER_M)
            .map(|(stroke, k)| (k, stroke.impulse_newton_s))
            .collect();
        if let Some(fit) = LineFit::new(&points) {
            println!(
                "{share:5}  {}                  {:.3} + {:.4} K, R2 {:.3}",
                beyond.join(" "),
                fit.intercept,
                fit.slope,
                fit.r2
            );
        }
    }
    Ok(())
}

/// How far the reference is beyond the cap's rest on the block, on average over the last 0.3 s of the
/// stroke, in which the resting force is taken \[m\].
fn press_m(tip_radius_m: f64) -> f64 {
    let (probe, _) = scenario::probe(tip_radius_m);
    let stroke_s = probe.stroke_m / probe.speed_m_per_s + probe.ramp_s;
    let below = |k: u32| {
        let time_s = stroke_s - 1e-3 * f64::from(k);
        scenario::FACE_M + tip_radius_m - Trajectory::Probe(probe).at(time_s).position.z
    };
    (0..300).map(below).sum::<f64>() / 300.0
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
    };
    Ok((plan, probe))
}

/// Greatest force against the reference's motion beyond the doubt of friction; with a probe, within
/// 40 ms of the first touch.
fn beyond_doubt(
    plan: &Plan<4>,
    estimator_rad_per_s: f64,
    observer_rad_per_s: f64,
    probe: Option<Probe>,
) -> Result<f64, ExperimentError> {
    let mut plan = plan.clone();
    plan.config.estimator_rad_per_s = estimator_rad_per_s;
    plan.config.latch.observer_rad_per_s = observer_rad_per_s;
    plan.config.latch.threshold_n = NEVER_N;
    let mut greatest = 0.0_f64;
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
            // After a reversal the threshold is doubled, doubt and all.
            let reversing = cycle.output.contact_threshold_n > 1.5 * NEVER_N;
            let share = if reversing { 2.0 } else { 1.0 };
            let doubt_n = cycle.output.contact_threshold_n / share - NEVER_N;
            greatest = greatest.max(cycle.output.force_against_n / share - doubt_n);
        }
        Ok(())
    })?;
    Ok(greatest)
}

fn probe_once(
    setup: &Setup<4>,
    stiffness_n_per_m: f64,
    contact_share: f64,
) -> Result<Stroke, ExperimentError> {
    let (mut plan, probe) = probing_plan(setup, stiffness_n_per_m)?;
    plan.config.latch.contact_share = contact_share;
    let mut meter = ContactMeter::new(probe);
    run(&plan, &mut |cycle, time_s| {
        if let Some(time_s) = time_s {
            meter.cycle(time_s, &cycle.truth, cycle.steps, cycle.output.in_contact);
        }
        Ok(())
    })?;
    Ok(median_stroke(&meter.finish()))
}
