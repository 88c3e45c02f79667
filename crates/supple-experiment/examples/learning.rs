//! The sinusoid at 5 N/m on arms that deviate from the controller's model, without and with learning while moving.
//!
//! Prints the tip's RMS error from 24 s on and the learned parameters in force at the end:
//! `cargo run --release -p supple-experiment --example learning`.

use supple_core::Output;
use supple_experiment::metrics::Rms;
use supple_experiment::{Deviation, Plan, Setup, Variant, run, scenario};
use supple_model::Description;
use supple_plant::Scene;

/// From here on the error counts \[s\].
const FROM_S: f64 = 24.0;
/// Duration of a run: two more periods \[s\].
const DURATION_S: f64 = 40.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = Description::asset("wam4")?;
    let setup = Setup::<4>::new(&description, 0)?;
    println!("deviation                RMS mm: without / with learning");
    for deviation in [
        Deviation::None,
        Deviation::Friction(0.2),
        Deviation::Friction(-0.2),
        Deviation::TorqueConstant(-0.02),
        Deviation::TorqueConstant(0.02),
        Deviation::Payload(0.05),
        Deviation::Tilt(0.0, 0.5_f64.to_radians()),
    ] {
        let mut found = Vec::new();
        let mut learned = None;
        for learning in [false, true] {
            let mut config = setup.config(&Variant::EXACT)?;
            config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
            let mut plant = setup.plant(&Variant::EXACT, Scene::default());
            deviation.apply(&mut plant)?;
            let plan = Plan {
                name: format!("{deviation:?}"),
                config,
                plant,
                trajectory: scenario::sinusoid(1.0).0,
                duration_s: DURATION_S,
                learning,
            };
            let mut late = Rms::default();
            let mut last: Option<Output<4>> = None;
            let ended = run(&plan, &mut |cycle, time_s| {
                if let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference)
                    && time_s >= FROM_S
                {
                    late.add((reference.position - cycle.truth.tip_position_m).norm());
                }
                last = Some(cycle.output);
                Ok(())
            })?
            .ended;
            found.push(match ended {
                Some(end) => format!("{} ({:.1} s)", end.fault, end.ended_s),
                None => format!("{:.2}", 1e3 * late.rms()),
            });
            learned = last.map(|output| output.learned);
        }
        println!("{deviation:<24?} {}", found.join(" / "));
        if let Some(learned) = learned {
            println!("    {learned:?}");
        }
    }
    Ok(())
}
