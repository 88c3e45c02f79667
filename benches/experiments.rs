//! How fast the experiments run: a single probing run on one core against real time (20 times is asked),
//! and the whole demo on all cores with its logs (90 s on two is allowed). Several rounds; least, middle and greatest are printed.

use std::time::Instant;
use supple_core::Trajectory;
use supple_experiment::{DemoOptions, Plan, Setup, Variant, demo, run, scenario};
use supple_model::Description;

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
    };
    let mut ratios = Vec::new();
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        let run = run(&plan, &mut |_, _| Ok(()))?;
        ratios.push(run.simulated_s / begin.elapsed().as_secs_f64());
    }
    print(
        "single probing run, times real time on one core",
        &mut ratios,
    );

    let folder = tempfile::tempdir()?;
    let options = DemoOptions {
        seed: 0,
        log_dir: Some(folder.path().to_owned()),
        model: None,
    };
    let mut seconds = Vec::new();
    for _ in 0..DEMO_ROUNDS {
        let begin = Instant::now();
        demo(&description, &options, &|_| {})?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    print("whole demo with logs, seconds on all cores", &mut seconds);
    Ok(())
}

fn print(what: &str, values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
    let (least, middle, greatest) = (
        values[0],
        values[values.len() / 2],
        values[values.len() - 1],
    );
    println!("{what}: least {least:.1}, middle {middle:.1}, greatest {greatest:.1}");
}
