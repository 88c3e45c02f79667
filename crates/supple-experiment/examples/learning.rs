//! The sinusoid at 5 N/m on arms that deviate from the controller's model, without and with learning while moving; then
//! the arc with what was learned, without learning further.
//!
//! The arm without a deviation also probes, without and with what the sinusoid taught and learning on. Prints the tip's RMS error, of the sinusoid from 24 s on, and the learned parameters in force at the end:
//! `cargo run --release -p supple-experiment --example learning`.

use supple_core::Trajectory;
use supple_core::controller::Request;
use supple_core::learned::LearnedTerms;
use supple_experiment::metrics::Rms;
use supple_experiment::probing::{Stroke, median_stroke, strokes};
use supple_experiment::{Deviation, ExperimentError, Plan, Setup, Variant, run, scenario};
use supple_model::Description;
use supple_plant::Scene;

/// From here on the error of the sinusoid counts \[s\].
const FROM_S: f64 = 24.0;
/// Duration of the sinusoid: two more periods \[s\].
const DURATION_S: f64 = 40.0;

/// Tracks a trajectory; returns its error from `from_s` on in words, and the learned terms in force at the end.
fn track(
    setup: &Setup<4>,
    deviation: Deviation,
    (trajectory, duration_s, from_s): (Trajectory, f64, f64),
    learning: bool,
    learned: LearnedTerms<4>,
) -> Result<(String, LearnedTerms<4>), ExperimentError> {
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains(scenario::STIFFNESS_N_PER_M);
    config.learned = learned;
    let mut plant = setup.plant(&Variant::EXACT, Scene::default());
    deviation.apply(&mut plant)?;
    let plan = Plan {
        name: format!("{deviation:?}"),
        config,
        plant,
        trajectory,
        duration_s,
        learning,
        gain_change: None,
    };
    let (mut late, mut terms) = (Rms::default(), learned);
    let run = run(&plan, &mut |cycle, time_s| {
        if let (Some(time_s), Some(reference)) = (time_s, cycle.output.reference)
            && time_s >= from_s
        {
            late.add((reference.position - cycle.truth.tip_position_m).norm());
        }
        match cycle.input.request {
            Some(Request::LearnedMap { joint, map }) => terms.map[joint] = map,
            Some(Request::LearnedParameters(parameters)) => terms.parameters = parameters,
            _ => {}
        }
        Ok(())
    })?;
    let words = match run.ended {
        Some(end) => format!("{} ({:.1} s)", end.fault, end.ended_s),
        None => format!("{:.2}", 1e3 * late.rms()),
    };
    Ok((words, terms))
}

/// Returns the median stroke of probing with these terms and learning on, or without either.
fn probing(
    setup: &Setup<4>,
    stiffness_n_per_m: f64,
    learned: Option<LearnedTerms<4>>,
) -> Result<Stroke, ExperimentError> {
    let (probe, duration_s) = scenario::probe(setup.tip_radius_m());
    let mut config = setup.config(&Variant::EXACT)?;
    config.law.gains = scenario::gains(stiffness_n_per_m);
    config.learned = learned.unwrap_or(config.learned);
    let plan = Plan {
        gain_change: None,
        name: "probing".to_owned(),
        config,
        plant: setup.plant(&Variant::EXACT, scenario::block()),
        trajectory: Trajectory::Probe(probe),
        duration_s,
        learning: learned.is_some(),
    };
    Ok(median_stroke(&strokes(&plan)?))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let description = Description::asset("wam4")?;
    let setup = Setup::<4>::new(&description, 0)?;
    println!(
        "RMS mm: sinusoid without / with learning, arc without / with what was learned there / learning"
    );
    for deviation in [
        Deviation::None,
        Deviation::Friction(0.2),
        Deviation::Friction(-0.2),
        Deviation::TorqueConstant(-0.02),
        Deviation::TorqueConstant(0.02),
        Deviation::Payload(0.05),
        Deviation::Tilt(0.0, 0.5_f64.to_radians()),
    ] {
        let sinusoid = (scenario::sinusoid(1.0).0, DURATION_S, FROM_S);
        let (arc, arc_s) = scenario::arc();
        let track = |task, learning, learned| track(&setup, deviation, task, learning, learned);
        let zero = LearnedTerms::zero();
        let (without, _) = track(sinusoid, false, zero)?;
        let (with, learned) = track(sinusoid, true, zero)?;
        let (arc_without, _) = track((arc, arc_s, 0.0), false, zero)?;
        let (arc_with, _) = track((arc, arc_s, 0.0), false, learned)?;
        let (arc_learning, _) = track((arc, DURATION_S, FROM_S), true, zero)?;
        println!("{deviation:?}: {without} / {with}, {arc_without} / {arc_with} / {arc_learning}");
        println!("    {:?}", learned.parameters);
        if deviation == Deviation::None {
            for stiffness_n_per_m in [5.0, 125.0] {
                for terms in [None, Some(learned)] {
                    let stroke = probing(&setup, stiffness_n_per_m, terms)?;
                    let with = if terms.is_some() { "with" } else { "without" };
                    println!("    probing at {stiffness_n_per_m} N/m {with}: {stroke:?}");
                }
            }
        }
    }
    Ok(())
}
