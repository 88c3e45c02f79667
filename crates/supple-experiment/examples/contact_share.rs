//! Data behind `[latch] contact_share`, the fraction of the dry friction feed-forward that stays on in contact.
//!
//! For each share, force while pressing minus the force that the spring asks for, over the stiffness and over
//! three sorts of models: the plant's own, ten with the error of an identification, and models identified on the
//! simulated arm. Then the impulse over one cycle.
//!
//! `contact_share [ARM] [IDENTIFIED MODELS] [SETTLE_S]`; default: `wam4`, 3, the arm's.

use rayon::prelude::*;
use supple_core::Trajectory;
use supple_experiment::probing::{Stroke, median_stroke, strokes};
use supple_experiment::{
    Calibration, ExperimentError, Mismatch, Plan, Setup, Variant, calibrate, scenario,
};
use supple_model::{Description, with_dof};

const SHARES: [f64; 7] = [0.2, 0.25, 0.3, 0.35, 0.4, 0.55, 1.0];
const STIFFNESS_N_PER_M: [f64; 6] = [0.5, 2.0, 5.0, 25.0, 75.0, 125.0];
const PERTURBED_MODELS: u64 = 10;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let arm = arguments.next().unwrap_or_else(|| "wam4".to_owned());
    let identified = arguments.next().map_or(Ok(3), |count| count.parse())?;
    let settle_s = arguments.next().map(|time_s| time_s.parse()).transpose()?;
    let description = Description::asset(&arm)?;
    with_dof!(description.dof(), N => sized::<N>(&description, identified, settle_s))??;
    Ok(())
}

/// A model and the variant that applies it.
struct Model<const N: usize> {
    setup: Setup<N>,
    variant: Variant,
}

fn sized<const N: usize>(
    description: &Description,
    identified: u64,
    settle_s: Option<f64>,
) -> Result<(), ExperimentError> {
    let exact = Setup::<N>::new(description, 0)?;
    let perturbed = (0..PERTURBED_MODELS).map(|seed| Model {
        setup: exact.clone(),
        variant: Variant {
            mismatch: Some(Mismatch::identified(seed)),
            ..Variant::EXACT
        },
    });
    let identified = (0..identified)
        .into_par_iter()
        .map(|seed| identified_model(description, seed))
        .collect::<Result<Vec<_>, _>>()?;
    let exact = vec![Model {
        setup: exact.clone(),
        variant: Variant::EXACT,
    }];
    for (name, models) in [
        ("exact model", exact),
        ("perturbed models", perturbed.collect()),
        ("identified models", identified),
    ] {
        table(name, &models, settle_s)?;
    }
    Ok(())
}

fn identified_model<const N: usize>(
    description: &Description,
    seed: u64,
) -> Result<Model<N>, ExperimentError> {
    let calibration = Calibration {
        load: true,
        ..Calibration::new(seed)
    };
    let calibrated = calibrate::<N>(description, &calibration, &mut |_| {})?;
    Ok(Model {
        setup: Setup::with_model(description, &calibrated.description, seed)?,
        variant: Variant::EXACT,
    })
}

/// Prints the greatest deviation over the models, with its sign, and the median impulse.
fn table<const N: usize>(
    name: &str,
    models: &[Model<N>],
    settle_s: Option<f64>,
) -> Result<(), ExperimentError> {
    let stiffness = STIFFNESS_N_PER_M.map(|k| format!("{k:>8}")).join("");
    if models.is_empty() {
        return Ok(());
    }
    println!("\n{name} ({}), K [N/m]   {stiffness}", models.len());
    for share in SHARES {
        let cases: Vec<(f64, &Model<N>)> = STIFFNESS_N_PER_M
            .iter()
            .flat_map(|k| models.iter().map(move |model| (*k, model)))
            .collect();
        let strokes = cases
            .par_iter()
            .map(|(k, model)| probe(model, *k, share, settle_s))
            .collect::<Result<Vec<_>, _>>()?;
        let by_stiffness: Vec<&[Stroke]> = strokes.chunks(models.len()).collect();
        let row = |what: &str, value: &dyn Fn(&[Stroke]) -> f64| {
            let values: Vec<String> = by_stiffness
                .iter()
                .map(|strokes| format!("{:8.3}", value(strokes)))
                .collect();
            println!("share {share:4}  {what:<28}{}", values.join(""));
        };
        row("pressing - spring, worst [N]", &|strokes| {
            let off = strokes
                .iter()
                .map(|s| s.pressing_force_n - s.spring_force_n);
            off.fold(
                0.0,
                |worst: f64, off| {
                    if off.abs() > worst.abs() { off } else { worst }
                },
            )
        });
        row("spring [N]", &|strokes| {
            median_stroke(strokes).spring_force_n
        });
        row("impulse [N s]", &|strokes| {
            median_stroke(strokes).impulse_newton_s
        });
    }
    Ok(())
}

fn probe<const N: usize>(
    model: &Model<N>,
    stiffness_n_per_m: f64,
    contact_share: f64,
    settle_s: Option<f64>,
) -> Result<Stroke, ExperimentError> {
    let setup = &model.setup;
    let (probe, _) = scenario::probe(setup.tip_radius_m());
    let mut config = setup.config(&model.variant)?;
    config.law.gains = scenario::gains(stiffness_n_per_m);
    config.latch.contact_share = contact_share;
    config.latch.settle_s = settle_s.unwrap_or(config.latch.settle_s);
    let plan = Plan {
        name: format!("probing at {stiffness_n_per_m} N/m"),
        config,
        plant: setup.plant(&model.variant, scenario::block()),
        trajectory: Trajectory::Probe(probe),
        duration_s: probe.cycle_s(),
        learning: false,
        gain_change: None,
    };
    Ok(median_stroke(&strokes(&plan)?))
}
