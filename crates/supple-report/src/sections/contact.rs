//! Contact: figures 5 and 6, and the trade-off.

use super::{Section, row};
use crate::units::{figures, mm, newton_seconds, newtons, percent, seconds};
use supple_experiment::metrics::{LineFit, median};
use supple_experiment::summary::{ContactStatistics, ProbingSummary, Summary};

pub(super) fn force(summary: &Summary) -> Section {
    let lines = &summary.exploration;
    let from_five: Vec<f64> = lines
        .iter()
        .filter(|line| line.stiffness_n_per_m >= 5.0)
        .map(|line| line.contact.peak_filtered_n)
        .collect();
    let fraction = |fraction: Option<f64>| fraction.map_or("none".to_owned(), percent);
    let rows = vec![
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
            fraction(summary.contact.peak_over_speed_spread),
        ),
        row(
            "resting force at 5 and 125 N/m",
            values(lines, &[5.0, 125.0], |e| newtons(e.contact.rest_force_n)),
        ),
        row(
            "time in contact at 5 and 125 N/m",
            values(lines, &[5.0, 125.0], |e| seconds(e.contact.contact_s)),
        ),
    ];
    Section {
        figure: "figure_5",
        title: "Force of an unexpected contact",
        paper_reference: "Section 4.2, figure 5",
        paper: "Filtered at 100 Hz, each contact begins with a fast transient of about 20 N, from the \
                collision itself and largely independent of a stiffness that differs by a factor of 25. \
                What follows, in size and in duration, depends on the stiffness.",
        measured_here: "The vertical force of the sensor behind the tip, filtered in the same way, at 5 and 125 N/m, \
               aligned at the first touch; the friction feed-forward fades in contact. The controller \
               uses the plant's parameters.",
        rows,
    }
}

fn at(lines: &[ProbingSummary], stiffness_n_per_m: f64) -> Option<&ProbingSummary> {
    lines
        .iter()
        .find(|line| line.stiffness_n_per_m == stiffness_n_per_m)
}

/// Values at those of these stiffnesses that were run.
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
        .exploration
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
        measured_here: "The same integral, median over the strokes, with a line through the points from 5 N/m on. \
               If it stays on, the friction feed-forward keeps pushing with nearly the Coulomb torque when the \
               block stops the tip: the intercept is then mostly friction. If it fades once contact is \
               detected, the intercept is close to the impact itself, the first 50 ms.",
        rows: vec![
            row("line, fade on", line(&summary.contact)),
            row("line, fade off", line(&summary.fade_off)),
            row(
                "first 50 ms, median, fade on",
                median(&first).map_or("none".to_owned(), newton_seconds),
            ),
        ],
    }
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
    let rows = summary.exploration.iter().map(|e| {
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
