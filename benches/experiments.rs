//! Speed of the experiments: a single probing run on one core relative to real time (target: factor 20), and
//! the complete demo with logs on all cores (limit: 90 s on two cores). Prints minimum, median and maximum over
//! several repetitions.

use std::time::Instant;
use supple_core::Trajectory;
use supple_experiment::{DemoOptions, Plan, Setup, Variant, demo, run, scenario};
use supple_model::Description;
use supple_plant::PlantOptions;

const ROUNDS: usize = 5;
const DEMO_ROUNDS: usize = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = Description::asset("wam4")?;
    let setup = Setup::<4>::new(&description, 0)?;
    let (probe, duration_s) = scenario::probe(setup.tip_radius_m());
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    let plan = Plan {
        name: "probing".to_owned(),
        config,
        plant: setup.plant(&Variant::EXACT, scenario::block()),
        trajectory: Trajectory::Probe(probe),
        duration_s,
        learning: false,
        gain_change: None,
    };
    let mut ratios = Vec::new();
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        let run = run(&plan, &mut |_, _| Ok(()))?;
        ratios.push(run.simulated_s / begin.elapsed().as_secs_f64());
    }
    print(
        "single probing run, real-time factor on one core",
        &mut ratios,
    );

    let folder = tempfile::tempdir()?;
    let options = DemoOptions {
        seed: 0,
        log_dir: Some(folder.path().to_owned()),
        model: None,
        plant: PlantOptions::default(),
        realistic_seeds: 0,
    };
    let mut seconds = Vec::new();
    for _ in 0..DEMO_ROUNDS {
        let begin = Instant::now();
        demo(&description, &options, &|_| {})?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    print(
        "complete demo with logs, seconds on all cores",
        &mut seconds,
    );
    Ok(())
}

fn print(what: &str, values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
    let (min, median, max) = (
        values[0],
        values[values.len() / 2],
        values[values.len() - 1],
    );
    println!("{what}: minimum {min:.1}, median {median:.1}, maximum {max:.1}");
}
