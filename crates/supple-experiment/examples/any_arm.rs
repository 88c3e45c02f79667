//! Runs the demo's sinusoid at 5 N/m on arms given by name, TOML or URDF (`FILE.urdf#LINK`), with models that are 0.1 %
//! and 3 % off, for 60 s, and prints one line per arm. The allowed error is 15 mm, or more for an arm that is heavier at
//! the tip than the WAM, in proportion: the error is that of a gravity model that is a share of the weight off.
//!
//! ```text
//! cargo run --release -p supple-experiment --example any_arm -- a.urdf#tool0 b.urdf#flange
//! ```

use std::error::Error;
use std::time::Instant;
use supple_experiment::{Mismatch, Plan, Setup, Variant, run, scenario};
use supple_model::{Description, with_dof};
use supple_plant::Scene;

/// Time on the sinusoid \[s\].
const DURATION_S: f64 = 60.0;

fn main() {
    let verbose = std::env::args().any(|argument| argument == "--verbose");
    for name in std::env::args().skip(1).filter(|name| name != "--verbose") {
        let short = name.rsplit('/').next().unwrap_or(&name).to_owned();
        match one(&name, verbose) {
            Ok(line) => println!("{short:44} {line}"),
            Err(error) => println!("{short:44} FAILED: {error}"),
        }
    }
}

fn one(name: &str, verbose: bool) -> Result<String, Box<dyn Error>> {
    let since = Instant::now();
    let completed = Description::find(name)?.completed()?;
    let description = completed.description;
    let loading_s = since.elapsed().as_secs_f64();
    if verbose {
        for warning in description.warnings() {
            println!("  warning: {warning}");
        }
        for derived in &completed.derived {
            println!("  {derived}");
        }
    }
    with_dof!(description.dof(), N => sized::<N>(&description, loading_s))?
}

fn sized<const N: usize>(
    description: &Description,
    loading_s: f64,
) -> Result<String, Box<dyn Error>> {
    let setup = Setup::<N>::new(description, 0)?;
    let (mut worst_m, mut faults) = (0.0_f64, Vec::new());
    for seed in 0..2 {
        let variant = Variant {
            mismatch: Some(Mismatch::identified(seed)),
            ..Variant::EXACT
        };
        let mut config = setup.config(&variant)?;
        config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
        let (trajectory, _) = setup.paths().sinusoid(1.0);
        let plan = Plan {
            name: "sinusoid".to_owned(),
            config,
            plant: setup.plant(&variant, Scene::default()),
            trajectory,
            duration_s: DURATION_S,
            learning: false,
            gain_change: None,
        };
        let found = run(&plan, &mut |_, _| Ok(()))?;
        if !found.rms_error_m.is_finite() {
            return Err("the error is not a number".into());
        }
        worst_m = worst_m.max(found.rms_error_m);
        faults.extend(
            found
                .ended
                .map(|ended| format!("{:.1} s: {}", ended.ended_s, ended.fault)),
        );
    }
    let paths = description.paths();
    Ok(format!(
        "{:5.1} mm, {} faults {}, weight at tip {:.0} N, scale {}, r {:.2} m, z {:.2} m, {} joints, loaded in {loading_s:.2} s",
        1e3 * worst_m,
        faults.len(),
        faults.join("; "),
        supple_model::tip_weight_n::<N>(description)?,
        paths.scale,
        paths.radius_m,
        paths.height_m,
        description.dof(),
    ))
}
