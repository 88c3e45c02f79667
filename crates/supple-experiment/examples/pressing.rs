//! Force while pressing with models that were calibrated on the arm, by seed and stiffness:
//! `pressing FIRST LAST MODELS [plain] [learning] [heights=N]`.
//!
//! The plant is the realistic WAM, or with `plain` the one without options; `MODELS` is a folder that keeps the calibrated
//! models. With `learning`, strokes count after 24 s. Prints the force on the block less that of the spring \[N\]: mean and
//! worst over `N` heights of the block, a tenth of a millimetre apart; then peak and impulse.

use rayon::prelude::*;
use std::path::Path;
use supple_core::Trajectory;
use supple_experiment::effects::{LEARNING_S, calibrated};
use supple_experiment::probing::{Stroke, median_stroke, strokes};
use supple_experiment::{ExperimentError, Plan, Setup, Variant, scenario};
use supple_model::Description;
use supple_plant::PlantOptions;

const STIFFNESS_N_PER_M: [f64; 6] = [0.5, 2.0, 5.0, 25.0, 75.0, 125.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = || {
        arguments
            .next()
            .ok_or("give the first seed, the last one and a folder of models")
    };
    let (first, last): (u64, u64) = (next()?.parse()?, next()?.parse()?);
    let folder = next()?;
    let rest: Vec<String> = arguments.collect();
    let has = |name: &str| rest.iter().any(|argument| argument == name);
    let heights = rest.iter().find_map(|a| a.strip_prefix("heights="));
    let heights: u32 = heights.map_or(Ok(1), str::parse)?;
    let options = match has("plain") {
        true => PlantOptions::default(),
        false => PlantOptions::realistic(),
    };
    let arm = Description::asset("wam4")?;
    for seed in first..=last {
        let models = Path::new(&folder).join(seed.to_string());
        let model = kept(&arm, &options, &models, seed)?;
        let setup = Setup::<4>::with_model(&arm, &model, seed)?.with_plant_options(&options)?;
        let cases: Vec<(f64, u32)> = STIFFNESS_N_PER_M
            .iter()
            .flat_map(|k| (0..heights).map(move |height| (*k, height)))
            .collect();
        let found = cases
            .par_iter()
            .map(|(k, height)| probe(&setup, *k, *height, has("learning")))
            .collect::<Result<Vec<Stroke>, _>>()?;
        println!("seed {seed}");
        for (k, strokes) in STIFFNESS_N_PER_M.iter().zip(found.chunks(heights as usize)) {
            let excess = || {
                strokes
                    .iter()
                    .map(|s| s.pressing_force_n - s.spring_force_n)
            };
            let mean_n = excess().sum::<f64>() / strokes.len() as f64;
            let worst_n = excess().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let typical = median_stroke(strokes);
            println!(
                "  {k:5} N/m: {mean_n:6.3} {:6.3} of {:.3} N; peak {:4.1} N, impulse {:.3} N s",
                worst_n.unwrap_or(f64::NAN),
                typical.spring_force_n,
                typical.peak_filtered_n,
                typical.impulse_newton_s
            );
        }
    }
    Ok(())
}

fn probe(
    setup: &Setup<4>,
    stiffness_n_per_m: f64,
    height: u32,
    learning: bool,
) -> Result<Stroke, ExperimentError> {
    let (probe, _) = scenario::probe(setup.tip_radius_m());
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains(stiffness_n_per_m);
    let mut plant = setup.plant(&Variant::EXACT, scenario::block());
    plant.scene.fixed_blocks[0].center_m[2] += 1e-4 * f64::from(height);
    let not_counted = match learning {
        true => (LEARNING_S / probe.cycle_s()).ceil() as u32,
        false => 0,
    };
    let plan = Plan {
        name: format!("probing at {stiffness_n_per_m} N/m"),
        config,
        plant,
        trajectory: Trajectory::Probe(probe),
        duration_s: f64::from(not_counted + 3) * probe.cycle_s(),
        learning,
        gain_change: None,
    };
    Ok(median_stroke(&strokes(&plan)?[not_counted as usize..]))
}

fn kept(
    arm: &Description,
    options: &PlantOptions,
    folder: &Path,
    seed: u64,
) -> Result<Description, ExperimentError> {
    if folder.join("arm.toml").exists() {
        return Ok(Description::load(folder)?);
    }
    let model = calibrated::<4>(arm, options, seed)?;
    model.save(folder)?;
    Ok(model)
}
