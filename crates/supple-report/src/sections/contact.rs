//! Contact: figures 5 and 6, and the trade-off.

use super::row::{Section, row};
use crate::table::{plants, pressing_excess};
use crate::units::{figures, mm, newton_seconds, newtons, percent, plain, seconds};
use supple_experiment::metrics::{LineFit, median};
use supple_experiment::summary::{ContactStatistics, ProbingSummary, Summary};

pub(super) fn force(summary: &Summary) -> Section {
    let lines = &summary.probing;
    let from_five: Vec<f64> = lines
        .iter()
        .filter(|line| line.stiffness_n_per_m >= 5.0)
        .map(|line| line.contact.peak_filtered_n)
        .collect();
    let fraction = |fraction: Option<f64>| fraction.map_or("none".to_owned(), percent);
    let mut rows = vec![
        row(
            "first transient, median over K from 5 N/m",
            median(&from_five).map_or("none".to_owned(), newtons),
        ),
        row(
            "its spread, (max \u{2212} min) / median",
            fraction(summary.contact.peak_spread),
        ),
        row(
            "the same for the ratio of peak to approach speed",
            fraction(summary.contact.peak_per_approach_speed_spread),
        ),
        row(
            "force while pressing at 5 and 125 N/m",
            values(lines, &[5.0, 125.0], |e| {
                newtons(e.contact.pressing_force_n)
            }),
        ),
        row(
            "force that the spring asks for, K (X \u{2212} Xo)",
            values(lines, &[5.0, 125.0], |e| newtons(e.contact.spring_force_n)),
        ),
        row(
            "first transient without model error",
            values(&summary.probing_exact_model, &[5.0, 125.0], |e| {
                newtons(e.contact.peak_filtered_n)
            }),
        ),
        row(
            "first transient on a sheet of rubber",
            values(&summary.probing_rubber, &[5.0, 125.0], |e| {
                newtons(e.contact.peak_filtered_n)
            }),
        ),
        row(
            "first transient with an apparent inertia of 1 kg",
            values(&summary.probing_apparent_inertia, &[5.0, 125.0], |e| {
                newtons(e.contact.peak_filtered_n)
            }),
        ),
        row(
            "time in contact at 5 and 125 N/m",
            values(lines, &[5.0, 125.0], |e| seconds(e.contact.contact_s)),
        ),
    ];
    let (_, imperfect) = plants(summary);
    let pressing = summary.realistic.iter().flat_map(|found| &found.pressing);
    rows.extend(pressing.map(|forces| {
        let stiffness = forces.stiffness_n_per_m;
        row(
            format!("{imperfect} at {stiffness} N/m: force while pressing less that of the spring; median, worst"),
            pressing_excess(forces),
        )
    }));
    if let Some(reason) = &summary.not_identified {
        rows.push(row("no model was identified, it is perturbed", reason));
    }
    Section {
        figure: "figure_5",
        title: "Force of an unexpected contact",
        paper_reference: "Section 4.2, figure 5",
        paper: "Filtered at 100 Hz, each contact begins with a fast transient of about 20 N, from the \
                collision itself and largely independent of a stiffness that differs by a factor of 25. \
                What follows, in size and in duration, depends on the stiffness.",
        measured_here: "The vertical force of the sensor behind the tip, filtered in the same way, at 5 and 125 N/m, \
               aligned at the first touch; in contact the friction feed-forward follows the measured motion. The controller's \
               model was identified on the same arm; rows without model error have the arm's parameters, without the \
               travel over which its friction reverses. At the bottom of the stroke \
               the reference rests for a second, which the paper's cycle does not have: the force while pressing \
               is the mean over its last half.",
        rows,
    }
}

fn at(lines: &[ProbingSummary], stiffness_n_per_m: f64) -> Option<&ProbingSummary> {
    lines
        .iter()
        .find(|line| line.stiffness_n_per_m == stiffness_n_per_m)
}

/// Formats the values at these stiffnesses; omits stiffnesses that were not run.
fn values(
    lines: &[ProbingSummary],
    stiffnesses: &[f64],
    value: impl Fn(&ProbingSummary) -> String,
) -> String {
    let found = stiffnesses.iter().filter_map(|k| at(lines, *k));
    found.map(value).collect::<Vec<_>>().join(", ")
}

pub(super) fn impulse(summary: &Summary) -> Section {
    let first: Vec<f64> = summary
        .probing
        .iter()
        .map(|e| e.contact.impulse_first_50ms_newton_s)
        .collect();
    Section {
        figure: "figure_6",
        title: "Impulse over stiffness",
        paper_reference: "Section 4.2, figure 6",
        paper: "The integral of the force over one cycle of the probing motion grows linearly with the \
                stiffness, as for a linear spring. Extrapolated to zero stiffness it is not zero, which the \
                paper attributes to the impact: to the kinetic energy of the arm, not to the stiffness.",
        measured_here: "The same integral, median over the strokes and without the dwell, with a line through the \
               points from 5 N/m on. The impulse is curved: its slope grows with the stiffness towards that of the \
               spring, because a soft spring does not overcome the joints' friction. The intercept of a line is \
               therefore not the impact; the impact is measured by itself, from the first touch until the tip leaves \
               the block, beside m v (1 + e) of the mass that the arm has at the tip. With a perturbed model, if it stays on, the friction \
               feed-forward keeps pushing with nearly the Coulomb torque when the block stops the tip.",
        rows: vec![
            row(
                "impulse at 0.5, 1 and 2 N/m",
                values(&summary.probing, &[0.5, 1.0, 2.0], |e| {
                    newton_seconds(e.contact.impulse_newton_s)
                }),
            ),
            row(
                "first impact at 0.5, 5 and 125 N/m",
                values(&summary.probing, &[0.5, 5.0, 125.0], |e| {
                    newton_seconds(e.contact.impact_newton_s)
                }),
            ),
            row(
                "m v (1 + e) at 0.5, 5 and 125 N/m",
                values(&summary.probing, &[0.5, 5.0, 125.0], |e| {
                    newton_seconds(e.impact_theory_newton_s)
                }),
            ),
            row(
                "slope from one stiffness to the next",
                slopes(&summary.contact),
            ),
            row("line from 5 N/m on", line(&summary.contact)),
            row(
                "line from 5 N/m on, friction left on, perturbed model",
                line(&summary.fade_off),
            ),
            row(
                "first 50 ms, median",
                median(&first).map_or("none".to_owned(), newton_seconds),
            ),
        ],
    }
}

/// Formats the slopes of the impulse, each with the upper stiffness.
fn slopes(contact: &ContactStatistics) -> String {
    let slopes = contact.impulse_slopes.iter();
    let each = slopes.map(|s| format!("{} to {} N/m", plain(s.slope, 3), s.to_n_per_m));
    each.collect::<Vec<_>>().join(", ")
}

fn line(contact: &ContactStatistics) -> String {
    match contact.impulse_fit {
        Some(LineFit {
            slope,
            intercept,
            r2,
        }) => format!(
            "{} + {} K, R\u{b2} {}",
            newton_seconds(intercept),
            figures(slope),
            figures(r2)
        ),
        None => "no line".to_owned(),
    }
}

pub(super) fn trade_off(summary: &Summary) -> Section {
    let rows = summary.probing.iter().map(|e| {
        row(
            format!("{} N/m: free error, impulse", e.stiffness_n_per_m),
            format!(
                "{}, {}",
                mm(e.free_rms_m),
                newton_seconds(e.contact.impulse_newton_s)
            ),
        )
    });
    Section {
        figure: "trade_off",
        title: "The trade-off",
        paper_reference: "Section 5",
        paper: "Position error against contact force is the central trade-off: as the stiffness rises, \
                the error falls and the impulse grows, and the task decides. If positions are uncertain \
                anyway, there may be no reason for high gains.",
        measured_here: "Tip error during the descent, before contact, against the impulse of the contact, one \
               point per stiffness.",
        rows: rows.collect(),
    }
}
