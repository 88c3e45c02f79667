//! `supple effects`: tracking at 5 N/m with each effect of a real arm alone and with all together, as a table.

use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use supple_cli::arguments::EffectsArgs;
use supple_cli::arms;
use supple_cli::console::{json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::effects::{Effect, EffectRun, ModelSource, effects, run_effects};
use supple_experiment::metrics::median;
use supple_plant::PlantOptions;

#[derive(Serialize)]
struct Summary<'a> {
    version: &'static str,
    arm: &'a str,
    seeds: u64,
    effects: Vec<Row<'a>>,
    runs: &'a [EffectRun],
}

#[derive(Serialize)]
struct Row<'a> {
    name: &'static str,
    plant: &'a PlantOptions,
}

/// Runs `supple effects`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &EffectsArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let mut chosen = effects(&arm);
    if !args.only.is_empty() {
        chosen.retain(|effect| args.only.iter().any(|text| effect.name.contains(&**text)));
    }
    if chosen.is_empty() {
        return Err(Failure::NoSuchEffect {
            text: args.only.join(", "),
        });
    }
    let staging = Staging::new(&args.out, &["effects.md", "effects.json"])?;
    let progress = |done: usize, all: usize, name: &str| {
        if !args.quiet {
            print_status(&format!("{done} of {all}: {name}"));
        }
    };
    let runs = run_effects(&arm, &chosen, &ModelSource::ALL, args.seeds, &progress)?;
    let rows = chosen.iter().map(|effect| Row {
        name: effect.name,
        plant: &effect.options,
    });
    let text = json(&Summary {
        version: env!("CARGO_PKG_VERSION"),
        arm: arm.name(),
        seeds: args.seeds,
        effects: rows.collect(),
        runs: &runs,
    })?;
    let page = page(arm.name(), args.seeds, &chosen, &runs);
    staging.write("effects.json", format!("{text}\n").as_bytes())?;
    staging.write("effects.md", page.as_bytes())?;
    staging.publish()?;
    if args.json {
        return print_line(&text);
    }
    print_line(page.trim_end())
}

/// The Markdown page: one row per effect, median and worst seed.
fn page(arm: &str, seeds: u64, effects: &[Effect], runs: &[EffectRun]) -> String {
    let mut page = format!(
        "# What ruins low stiffness\n\n\
         Tracking error of the tip at 5 N/m on the simulated {arm}, RMS in mm: median over the seeds ({seeds}), the worst in\n\
         brackets. Each row has one effect of a real arm in the plant, the last one all of them together at modest size. The\n\
         sizes are assumptions, not measurements of an arm; `supple plant list` describes each option. *Not calibrated*: the\n\
         controller's model is exact but for the effect. *Calibrated*: the model was identified on the arm with the effect,\n\
         with the errors that an identification leaves. *Learning*: that model, refined while the arm moves; errors count\n\
         after 24 s of motion. Latches are false reports of contact, summed over all seeds; nothing is there to touch.\n\n\
         Made by `supple effects --arm {arm} --seeds {seeds}`.\n\n| effect |"
    );
    let models = ModelSource::ALL;
    for quantity in ["sinusoid", "arc", "latches"] {
        for model in models {
            let _ = write!(page, " {quantity}, {} |", model.name());
        }
    }
    page.push_str("\n|---|");
    page.push_str(&"---:|".repeat(3 * models.len()));
    page.push('\n');
    let mut notes: BTreeMap<_, Vec<String>> = BTreeMap::new();
    for effect in effects {
        let _ = write!(page, "| {} |", effect.name);
        let of = |model: ModelSource| {
            let own = move |run: &&EffectRun| run.effect == effect.name && run.model == model;
            runs.iter().filter(own)
        };
        for error in [
            |run: &EffectRun| run.motion.as_ref().map(|m| m.sinusoid_rms_m),
            |run: &EffectRun| run.motion.as_ref().map(|m| m.arc_rms_m),
        ] {
            for model in models {
                let errors: Vec<f64> = of(model).filter_map(error).collect();
                let _ = write!(page, " {} |", median_and_worst_mm(&errors));
            }
        }
        for model in models {
            let motions = of(model).filter_map(|run| run.motion.as_ref());
            let latches: usize = motions.map(|motion| motion.false_latches).sum();
            let _ = write!(page, " {latches} |");
            for run in of(model) {
                let ended = run.motion.as_ref().and_then(|m| m.ended.as_ref());
                let fault = ended.map(|ended| format!("a fault ended a run: {}", ended.fault));
                let failed = run.failed.clone().map(|f| format!("no result: {f}"));
                if let Some(note) = fault.or(failed) {
                    let of = (effect.name, model.name(), note);
                    notes.entry(of).or_default().push(run.seed.to_string());
                }
            }
        }
        page.push('\n');
    }
    if !notes.is_empty() {
        let _ = write!(
            page,
            "\nErrors of runs that a fault ended are those before it.\n\n"
        );
        for ((effect, model, note), seeds) in notes {
            let seeds = seeds.join(", ");
            let _ = writeln!(page, "- {effect}, {model}, seed {seeds}: {note}");
        }
    }
    page
}

fn median_and_worst_mm(errors_m: &[f64]) -> String {
    let mm = |error_m: f64| format!("{:.1}", 1e3 * error_m);
    match median(errors_m) {
        None => "none".to_owned(),
        Some(middle) if errors_m.len() == 1 => mm(middle),
        Some(middle) => {
            let worst = errors_m.iter().copied().fold(0.0, f64::max);
            format!("{} ({})", mm(middle), mm(worst))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_experiment::effects::FreeMotion;
    use supple_model::Description;

    #[test]
    fn a_row_has_median_worst_seed_false_contacts_and_failures() {
        let run = |seed, model, sinusoid_rms_m: f64| EffectRun {
            effect: "none",
            model,
            seed,
            motion: (sinusoid_rms_m > 0.0).then_some(FreeMotion {
                sinusoid_rms_m,
                arc_rms_m: 2.0 * sinusoid_rms_m,
                false_latches: 2,
                ended: None,
            }),
            failed: (sinusoid_rms_m == 0.0).then(|| "no torque".to_owned()),
        };
        let runs = [
            run(0, ModelSource::Nominal, 1e-3),
            run(1, ModelSource::Nominal, 3e-3),
            run(2, ModelSource::Nominal, 2e-3),
            run(0, ModelSource::Calibrated, 4e-3),
            run(1, ModelSource::Calibrated, 0.0),
            run(0, ModelSource::Learning, 1e-3),
        ];
        let arm = Description::asset("wam4").expect("a built-in arm");
        let effects = &effects(&arm)[..1];
        let page = page("wam4", 3, effects, &runs);
        assert!(
            page.contains("| none | 2.0 (3.0) | 4.0 | 1.0 | 4.0 (6.0) | 8.0 | 2.0 | 6 | 2 | 2 |"),
            "{page}"
        );
        assert!(
            page.contains("- none, calibrated, seed 1: no result: no torque"),
            "{page}"
        );
    }
}
