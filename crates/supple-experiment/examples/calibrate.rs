//! Calibrates the simulated arm for several seeds and tracks the sinusoid at 5 N/m with the identified model:
//! `cargo run --release -p supple-experiment --example calibrate -- SEEDS [RIPPLE_NM] [load]`.

use rayon::prelude::*;
use supple_experiment::calibrate::plant_of;
use supple_experiment::{Calibration, Plan, calibrate, run, scenario};
use supple_model::Description;

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let mut args = std::env::args().skip(1);
    let seeds: u64 = args.next().map_or(Ok(3), |a| a.parse())?;
    let ripple_nm: f64 = args.next().map_or(Ok(0.0), |a| a.parse())?;
    let load = args.next().is_some_and(|a| a == "load");
    let description = Description::asset("wam4")?;
    let lines = (0..seeds)
        .into_par_iter()
        .map(|seed| -> Result<String, supple_experiment::ExperimentError> {
            let calibration = Calibration {
                ripple_nm,
                load,
                ..Calibration::new(seed)
            };
            let found = calibrate::<4>(&description, &calibration, &mut |_| {})?;
            let follow = |stribeck: bool| {
                let mut config = found.description.config::<4>()?;
                config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
                if !stribeck {
                    config.friction.iter_mut().for_each(|f| f.breakaway_nm = f.coulomb_nm);
                }
                let (trajectory, duration_s) = scenario::sinusoid(1.0);
                let plan = Plan {
                    name: "sinusoid".to_owned(),
                    config,
                    plant: plant_of::<4>(&description, &calibration)?,
                    trajectory,
                    duration_s,
                    learning: false,
                    gain_change: None,
                };
                run(&plan, &mut |_, _| Ok(()))
            };
            let (coulomb, stribeck) = (follow(false)?, follow(true)?);
            let percent = |x: f64| format!("{:.3}", 100.0 * x);
            let friction: Vec<String> =
                found.truth.friction_relative.iter().map(|x| percent(*x)).collect();
            Ok(format!(
                "seed {seed}: condition {:.0}, rank {}, held out {} %, gravity {} %, friction {} %, Coulomb {:.1} mm, Stribeck {:.1} mm{}",
                found.designed.condition,
                found.fit.rank(),
                percent(found.validation.total_relative),
                percent(found.truth.gravity_relative),
                friction.join(" "),
                1e3 * coulomb.rms_error_m,
                1e3 * stribeck.rms_error_m,
                coulomb.ended.or(stribeck.ended).map_or_else(String::new, |e| e.fault),
            ))
        })
        .collect::<Result<Vec<_>, _>>()?;
    lines.iter().for_each(|line| println!("{line}"));
    Ok(())
}
