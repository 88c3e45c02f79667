//! Creates `report.html`, one self-contained file that needs no network.

use crate::figures::Figure;
use crate::sections::{Section, faults, sections};
use crate::table::arm_notes;
use crate::units::{figures, percent, plain, seconds};
use askama::Template;
use supple_cli::exit::Failure;
use supple_experiment::summary::{ProbingSummary, Summary};
use supple_experiment::{Demo, Mismatch};
use supple_model::Description;
use supple_plant::Material;

#[derive(Template)]
#[template(path = "report.html")]
struct Report<'a> {
    version: &'a str,
    arm: &'a str,
    joints: String,
    seed: u64,
    model: Option<&'a str>,
    /// Whether the plant of most rows lacks the effects of a real arm.
    ideal: bool,
    logs: bool,
    faults: Vec<String>,
    adapted: Vec<String>,
    parts: Vec<Part<'a>>,
    stiffness_tables: [StiffnessTable; 5],
    gravity_off: String,
    friction_off: String,
    contact_stiffness: String,
    contact_dissipation: String,
    contact_friction: String,
}

struct Part<'a> {
    section: Section,
    svg: &'a str,
}

struct StiffnessTable {
    title: &'static str,
    head: [&'static str; 13],
    rows: Vec<[String; 13]>,
}

/// Renders the report of a demo.
///
/// # Errors
/// [`Failure::ReportGeneration`].
pub fn html(
    demo: &Demo,
    arm: &Description,
    drawn: &[Figure],
    logs: bool,
) -> Result<String, Failure> {
    let summary = &demo.summary;
    let parts = sections(summary).into_iter().filter_map(|section| {
        let figure = drawn.iter().find(|figure| figure.name == section.figure)?;
        Some(Part {
            section,
            svg: &figure.svg,
        })
    });
    let wood = Material::wood();
    let off = Mismatch::identified(summary.seed);
    let report = Report {
        version: summary.version,
        arm: &summary.arm,
        joints: arm.joint_names().join(", "),
        seed: summary.seed,
        model: summary.model.as_deref(),
        ideal: summary.plant.is_none(),
        logs,
        faults: fault_lines(summary),
        adapted: arm_notes(summary),
        parts: parts.collect(),
        stiffness_tables: [
            stiffness_table("A model identified on the arm", &summary.probing),
            stiffness_table(
                "Friction feed-forward left on, perturbed model",
                &summary.probing_fade_off,
            ),
            stiffness_table(
                "The plant's own parameters in the model",
                &summary.probing_exact_model,
            ),
            stiffness_table("A sheet of rubber on the block", &summary.probing_rubber),
            stiffness_table(
                "Apparent inertia of 1 kg by the force sensor",
                &summary.probing_apparent_inertia,
            ),
        ],
        gravity_off: percent(off.gravity),
        friction_off: percent(off.friction),
        contact_stiffness: scientific(wood.stiffness_n_per_m_1_5),
        contact_dissipation: figures(wood.dissipation_s_per_m),
        contact_friction: wood.friction.to_string(),
    };
    report
        .render()
        .map_err(|error| Failure::ReportGeneration(error.to_string()))
}

/// Describes each fault in one line, with its run.
pub fn fault_lines(summary: &Summary) -> Vec<String> {
    let lines = faults(summary).into_iter();
    lines
        .map(|(run, ended)| format!("{run} at {}: {}", seconds(ended.ended_s), ended.fault))
        .collect()
}

fn scientific(value: f64) -> String {
    let power = value.log10().floor() as i32;
    let digits: String = power.to_string().chars().map(superscript).collect();
    format!("{} \u{d7} 10{digits}", value / 10.0_f64.powi(power))
}

fn superscript(digit: char) -> char {
    match digit {
        '0' => '\u{2070}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        '4'..='9' => char::from_u32('\u{2070}' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
        _ => '\u{207b}',
    }
}

fn stiffness_table(title: &'static str, lines: &[ProbingSummary]) -> StiffnessTable {
    let rows = lines.iter().map(|e| {
        [
            e.stiffness_n_per_m.to_string(),
            plain(e.damping_n_s_per_m, 2),
            plain(1e3 * e.contact.approach_m_per_s, 1),
            plain(e.contact.peak_filtered_n, 1),
            plain(e.contact.contact_s, 3),
            plain(e.contact.impulse_newton_s, 3),
            plain(e.contact.spring_impulse_newton_s, 3),
            plain(e.contact.impact_newton_s, 3),
            plain(e.impact_theory_newton_s, 3),
            plain(e.contact.impulse_first_50ms_newton_s, 3),
            plain(e.contact.pressing_force_n, 2),
            plain(e.contact.spring_force_n, 2),
            plain(1e3 * e.free_rms_m, 1),
        ]
    });
    StiffnessTable {
        title,
        head: [
            "K [N/m]",
            "B [N\u{a0}s/m]",
            "approach [mm/s]",
            "peak [N]",
            "contact [s]",
            "impulse [N\u{a0}s]",
            "of the spring [N\u{a0}s]",
            "first impact [N\u{a0}s]",
            "m v (1 + e) [N\u{a0}s]",
            "first 50\u{a0}ms [N\u{a0}s]",
            "pressing [N]",
            "spring K\u{a0}(X\u{a0}\u{2212}\u{a0}Xo) [N]",
            "free RMS [mm]",
        ],
        rows: rows.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::scientific;

    #[test]
    fn powers_of_ten_have_superscript_exponents() {
        assert_eq!(scientific(1.4e8), "1.4 \u{d7} 10\u{2078}");
        assert_eq!(scientific(2e-13), "2 \u{d7} 10\u{207b}\u{b9}\u{b3}");
    }
}
