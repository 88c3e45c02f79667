//! The table that the demo prints: measured results beside the statements of the paper.

use crate::units::{LEFT_OUT, figures, mm, newton_seconds, newtons, percent, plain, seconds};
use comfy_table::{ContentArrangement, Table, presets};
use supple_experiment::metrics::median;
use supple_experiment::summary::{ContactStatistics, ProbingSummary, Summary, TrackingError};
use supple_experiment::{CalibratedRuns, JointTorque, PressingForces};

/// Formats the summary, one line per quantity.
pub fn table(summary: &Summary) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(["quantity", "measured here", "the paper"]);
    for line in free_motion(summary).into_iter().chain(contact(summary)) {
        table.add_row(line);
    }
    table.trim_fmt()
}

/// Describes each run that the arm cannot perform at the full size of its paths, with the reason, and each fault that is not a
/// failure. Empty for an arm whose settings are not derived.
pub fn arm_notes(summary: &Summary) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(derived) = &summary.derived {
        let worst_m = worst(&summary.perturbed_rms_m);
        lines.push(format!(
            "the tip weight of this arm along the sinusoid is {} RMS: a model 0.1 % and 3 % off may cost {} at 5 N/m (15 mm up to 23 N, then in \
             proportion); worst here: {}",
            newtons(derived.tip_weight_n),
            mm(derived.allowed_error_m),
            mm(worst_m)
        ));
    }
    let adapted = summary.adapted.iter();
    lines.extend(adapted.map(|adapted| match adapted.scale {
        Some(scale) => format!(
            "{}: at {scale} of the size of this arm's paths, because at full size: {}",
            adapted.run, adapted.reason
        ),
        None => format!("{}: left out: {}", adapted.run, adapted.reason),
    }));
    if summary.derived.is_some() {
        let ended = summary.realistic.iter().flat_map(|found| &found.ended);
        lines.extend(ended.map(|ended| {
            format!(
                "realistic plant, seed {}: ended at {}: {}",
                ended.seed,
                seconds(ended.fault.ended_s),
                ended.fault.fault
            )
        }));
    }
    lines
}

/// Quantity, measured value, statement of the paper.
type Line = [String; 3];

fn line(quantity: &str, measured: String, paper: &str) -> Line {
    [quantity.to_owned(), measured, paper.to_owned()]
}

fn free_motion(summary: &Summary) -> Vec<Line> {
    let speeds: Vec<_> = summary
        .sinusoid_by_speed
        .iter()
        .filter(|at| at.speed != 1.0)
        .collect();
    let names: Vec<_> = speeds
        .iter()
        .map(|at| format!("{} \u{d7}", at.speed))
        .collect();
    let exact = &summary.sinusoid_exact_model;
    let worst_m = worst(&summary.perturbed_rms_m);
    let torque = |t: &JointTorque| {
        let terms = [t.gravity, t.friction, t.feedback].map(figures);
        format!("{} N m", terms.join(", "))
    };
    let (ideal, imperfect) = plants(summary);
    // A model given by the user is not perturbed in any run.
    let given_model = summary.model.is_some();
    let runs = [(&summary.realistic, imperfect), (&summary.ideal, ideal)];
    let runs = runs.into_iter().filter_map(|(found, plant)| {
        let found = found.as_ref()?;
        Some(calibrated(found, plant))
    });
    let mut lines: Vec<Line> = runs.flatten().collect();
    lines.extend([
        line(
            &format!(
                "{ideal}{}: sinusoid at 5 N/m, RMS error",
                match given_model {
                    true => "",
                    false => ", perturbed model",
                }
            ),
            rms(&[&summary.sinusoid]),
            "follows closely (fig. 3a)",
        ),
        line(
            &format!("  at {} the speed", names.join(", ")),
            rms(&speeds.iter().map(|at| &at.tracking).collect::<Vec<_>>()),
            "essentially unchanged",
        ),
    ]);
    if !given_model {
        lines.push(line(
            &format!(
                "  {} perturbed models: median, worst",
                summary.perturbed_rms_m.len()
            ),
            millimetres(&[
                median(&summary.perturbed_rms_m).unwrap_or(f64::NAN),
                worst_m,
            ]),
            "",
        ));
    }
    lines.extend([
        line(
            match given_model {
                true => "  plant without load-dependent friction: Coulomb, Stribeck",
                false => "  exact model, plant without load-dependent friction: Coulomb, Stribeck",
            },
            rms(&[&exact.coulomb, &exact.stribeck]),
            "",
        ),
        line(
            "  apparent mass of 1 kg by force feedback",
            rms(&[&summary.sinusoid_apparent_inertia]),
            "full Eq. (3.6)",
        ),
        line(
            "  (3.6) exactly as printed",
            paper_law(&summary.law_as_printed),
            "the law of the paper",
        ),
        line(
            &format!(
                "quadrant at {:.3} m/s, RMS error",
                summary.quadrant_at_paper_speed.speed_m_per_s
            ),
            rms(&[&summary.quadrant_at_paper_speed.tracking]),
            "errors at corners decay (fig. 3b)",
        ),
        line(
            "  with ten times the damping",
            rms(&[&summary.quadrant_damped.tracking]),
            "",
        ),
        line(
            "  with finite acceleration at its corners",
            rms(&[&summary.quadrant_corner_ramp.tracking]),
            "",
        ),
        line(
            &format!(
                "  at {:.3} m/s{}",
                summary.quadrant.speed_m_per_s,
                if given_model {
                    ""
                } else {
                    ": exact, perturbed model"
                }
            ),
            match given_model {
                true => rms(&[&summary.quadrant.tracking]),
                false => rms(&[
                    &summary.quadrant.tracking,
                    &summary.quadrant_perturbed.tracking,
                ]),
            },
            "",
        ),
        line("arc, RMS error", rms(&[&summary.arc]), ""),
        line(
            "shoulder: gravity, friction, feedback",
            torque(&summary.torque_rms.shoulder_pitch),
            "largest to smallest in this order (fig. 4)",
        ),
        line(
            "elbow: gravity, friction, feedback",
            torque(&summary.torque_rms.elbow),
            "largest to smallest in this order (fig. 4)",
        ),
    ]);
    lines
}

/// Returns the name of the plant of most rows, and of the plant on which the model is calibrated.
pub(crate) fn plants(summary: &Summary) -> (&'static str, &'static str) {
    match summary.plant.is_none() {
        // A model given by the user is not used on the realistic plant, on which the demo calibrates a model.
        true if summary.model.is_some() => ("ideal plant", "realistic plant, its own model"),
        true => ("ideal plant", "realistic plant"),
        false => ("given plant", "given plant"),
    }
}

/// Returns the rows of the controllers that were calibrated on their arm.
fn calibrated(found: &CalibratedRuns, plant: &str) -> Vec<Line> {
    let median_and_worst =
        |errors: &[f64]| millimetres(&[median(errors).unwrap_or(f64::NAN), worst(errors)]);
    let mut faults = match found.ended.len() {
        0 => String::new(),
        faults => format!(", {faults} ended by a fault"),
    };
    if !found.failed.is_empty() {
        faults.push_str(&format!(", {} without result", found.failed.len()));
    }
    let mut lines = vec![line(
        &format!("{plant}, calibrated and learning: sinusoid at 5 N/m; median, worst"),
        format!("{}{faults}", median_and_worst(&found.sinusoid_rms_m)),
        "follows closely (fig. 3a)",
    )];
    if !found.warm_rms_m.is_empty() {
        lines.push(line(
            "  after 20 min of warm-up",
            median_and_worst(&found.warm_rms_m),
            "",
        ));
    }
    lines.extend([
        line("  arc", median_and_worst(&found.arc_rms_m), ""),
        line(
            "  sinusoid at 0.5 N/m, learned at 5 N/m",
            median_and_worst(&found.soft_rms_m),
            "",
        ),
        line(
            "  calibrated, without learning: sinusoid",
            median_and_worst(&found.calibrated_sinusoid_rms_m),
            "",
        ),
        line(
            "  false contacts in all learning runs",
            found.false_latches.to_string(),
            "",
        ),
    ]);
    lines.extend(found.pressing.iter().map(|forces| {
        line(
            &format!(
                "  pressing at {} N/m, force less that of the spring",
                forces.stiffness_n_per_m
            ),
            pressing_excess(forces),
            "",
        )
    }));
    lines
}

/// Formats median and worst of the force while pressing less that of the spring, and the force of the spring.
pub(crate) fn pressing_excess(forces: &PressingForces) -> String {
    let excess: Vec<f64> = forces.excess_n().collect();
    let worst_n = excess
        .iter()
        .copied()
        .max_by(|a, b| a.abs().total_cmp(&b.abs()));
    match (median(&excess), worst_n, median(&forces.spring_force_n)) {
        (Some(median_n), Some(worst_n), Some(spring_n)) => {
            let [median_n, worst_n, spring_n] = [median_n, worst_n, spring_n].map(|n| plain(n, 2));
            format!("{median_n}, {worst_n} of {spring_n} N")
        }
        _ => LEFT_OUT.to_owned(),
    }
}

fn contact(summary: &Summary) -> Vec<Line> {
    let lines = &summary.probing;
    let from_five = || lines.iter().filter(|e| e.stiffness_n_per_m >= 5.0);
    let peaks: Vec<_> = from_five().map(|e| e.contact.peak_filtered_n).collect();
    let first: Vec<_> = lines
        .iter()
        .map(|e| e.contact.impulse_first_50ms_newton_s)
        .collect();
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "none".to_owned());
    let fit = |contact: &ContactStatistics| {
        let fit = contact.impulse_fit.as_ref();
        or_none(fit.map(|fit| {
            let [intercept, slope] = [fit.intercept, fit.slope].map(figures);
            format!(
                "({intercept} + {slope} K) N s, R\u{b2} {}",
                plain(fit.r2, 3)
            )
        }))
    };
    let pressing = |stiffness: f64| {
        let found = lines.iter().find(|e| e.stiffness_n_per_m == stiffness);
        found.map(|e| {
            format!(
                "{} of {}",
                newtons(e.contact.pressing_force_n),
                newtons(e.contact.spring_force_n)
            )
        })
    };
    let soft = lines.iter().filter(|e| e.stiffness_n_per_m < 5.0);
    let (soft_stiffness, soft): (Vec<_>, Vec<_>) = soft
        .map(|e| {
            let impulse = plain(e.contact.impulse_newton_s, 2);
            (figures(e.stiffness_n_per_m), impulse)
        })
        .unzip();
    let impacts: Vec<_> = lines.iter().map(|e| e.contact.impact_newton_s).collect();
    let theory: Vec<_> = lines.iter().map(|e| e.impact_theory_newton_s).collect();
    let peak_at_five = |lines: &[ProbingSummary]| {
        let found = lines.iter().find(|e| e.stiffness_n_per_m >= 5.0);
        or_none(found.map(|e| newtons(e.contact.peak_filtered_n)))
    };
    vec![
        line(
            "first transient, median over K from 5 N/m",
            or_none(median(&peaks).map(newtons)),
            "about 20 N (fig. 5)",
        ),
        line(
            "  its spread over these K",
            or_none(summary.contact.peak_spread.map(percent)),
            "largely independent of K",
        ),
        line(
            match summary.model {
                Some(_) => "  at 5 N/m: wood, rubber, 1 kg",
                None => "  at 5 N/m: no model error, rubber, 1 kg",
            },
            [
                &summary.probing_exact_model,
                &summary.probing_rubber,
                &summary.probing_apparent_inertia,
            ]
            .map(|lines| peak_at_five(lines))
            .join(", "),
            "rubber: much lower (section 5)",
        ),
        line(
            "pressing force at 5 N/m, of the spring's K (Xo - X)",
            or_none(pressing(5.0)),
            "",
        ),
        line("  at 125 N/m", or_none(pressing(125.0)), ""),
        line(
            &format!("impulse at {} N/m", soft_stiffness.join(", ")),
            format!("{} N s", soft.join(", ")),
            "not zero at K = 0 (fig. 6)",
        ),
        line(
            "  of the first impact, and m v (1 + e)",
            format!(
                "{}, {}",
                or_none(median(&impacts).map(newton_seconds)),
                or_none(median(&theory).map(newton_seconds))
            ),
            "contribution of the impact",
        ),
        line(
            "impulse over K from 5 N/m, friction compensation adapted in contact",
            fit(&summary.contact),
            "linear (fig. 6)",
        ),
        line(
            match summary.model {
                Some(_) => "  kept in contact",
                None => "  kept in contact, perturbed model",
            },
            fit(&summary.fade_off),
            "",
        ),
        line(
            "  first 50 ms, adapted, median over all K",
            or_none(median(&first).map(newton_seconds)),
            "",
        ),
    ]
}

/// Returns the largest value, or NaN if there are none.
pub(crate) fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NAN, f64::max)
}

fn rms(runs: &[&TrackingError]) -> String {
    let errors: Vec<_> = runs.iter().map(|run| run.rms_error_m).collect();
    let ended = runs.iter().filter_map(|run| run.ended.as_ref()).count();
    let errors = millimetres(&errors);
    match ended {
        0 => errors,
        _ => format!("{errors}, ended by a fault"),
    }
}

fn millimetres(metres: &[f64]) -> String {
    if metres.iter().all(|m| m.is_nan()) {
        return LEFT_OUT.to_owned();
    }
    let each: Vec<_> = metres.iter().map(|m| plain(1e3 * m, 1)).collect();
    format!("{} mm", each.join(", "))
}

fn paper_law(run: &TrackingError) -> String {
    match &run.ended {
        Some(ended) => format!("ended by a fault at {}", seconds(ended.ended_s)),
        None => rms(&[run]),
    }
}
