//! A section of the report and its rows.

use supple_experiment::summary::{QuadrantSummary, Summary};

/// Section of the report about one subject of the paper.
#[derive(Clone, Debug)]
pub struct Section {
    /// Name of the figure of this section.
    pub figure: &'static str,
    /// Headline.
    pub title: &'static str,
    /// Section, figure or equation of the paper.
    pub paper_reference: &'static str,
    /// Results of the paper.
    pub paper: &'static str,
    /// What the figure shows, and how it differs from the paper.
    pub measured_here: &'static str,
    /// Measured quantities.
    pub rows: Vec<Row>,
}

/// One measured quantity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name of the quantity.
    pub quantity: String,
    /// Value with its unit.
    pub measured: String,
}

/// Lists the runs of the quadrant, each with the model of its controller.
pub fn quadrants_with_models(summary: &Summary) -> [(&QuadrantSummary, &'static str); 5] {
    [
        (&summary.quadrant, "exact model"),
        (&summary.quadrant_perturbed, "perturbed model"),
        (&summary.quadrant_at_paper_speed, "exact model"),
        (
            &summary.quadrant_damped,
            "exact model, ten times the damping",
        ),
        (
            &summary.quadrant_corner_ramp,
            "exact model, finite acceleration at the corners",
        ),
    ]
}

pub(super) fn row(quantity: impl Into<String>, measured: impl Into<String>) -> Row {
    Row {
        quantity: quantity.into(),
        measured: measured.into(),
    }
}
