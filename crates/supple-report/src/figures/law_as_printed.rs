//! Tracking error under equation (3.6) exactly as printed, until the supervisor ends the run.

use super::axis::Axis;
use super::canvas::{distance, draw_canvas, mm};
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, MUTED, REFERENCE, TEXT_COLOUR, VERMILION};
use super::ticks::{Ticks, extent};
use plotters::style::text_anchor::HPos;
use supple_experiment::{Demo, FaultEnd, Sample};

/// Time shown after the end of the run \[s\].
const AFTER_S: f64 = 0.5;

/// The run, and a run with the used law for comparison.
pub struct PaperLawRuns<'a> {
    /// Run under (3.6) exactly as printed.
    pub paper_law: &'a [Sample],
    /// Fault that ended the run, if any.
    pub ended: Option<&'a FaultEnd>,
    /// The same sinusoid and model under the law that supple uses.
    pub used_law: &'a [Sample],
}

impl<'a> PaperLawRuns<'a> {
    /// Collects the runs of a demo.
    pub fn of(demo: &'a Demo) -> PaperLawRuns<'a> {
        PaperLawRuns {
            paper_law: &demo.law_as_printed.trace.samples,
            ended: demo.law_as_printed.ended.as_ref(),
            used_law: super::figure_4::samples(demo),
        }
    }
}

/// Draws the figure as SVG.
pub fn draw(runs: &PaperLawRuns<'_>) -> Result<String, FigureError> {
    let alt_text = "Distance from the reference over time under (3.6) exactly as printed, until \
                 the supervisor ends it, and under the law used by supple";
    draw_canvas((760, 330), alt_text, |area| {
        let point = |s: &Sample| (s.time_s, mm(distance(&s.tip_m, &s.reference_m)));
        let whole_s = runs.paper_law.last().map_or(1.0, |s| s.time_s);
        let end_s = runs.ended.map_or(whole_s, |ended| ended.ended_s + AFTER_S);
        let shown = |s: &&Sample| s.time_s <= end_s;
        let all = runs
            .paper_law
            .iter()
            .chain(runs.used_law.iter().filter(shown));
        let max = extent(all.map(|s| point(s).1)).end;
        let mut panel = Panel::new(
            area,
            "",
            Margins::default(),
            &Axis::bounded("time [s]", Ticks::around(0.0..end_s, 8), 0.0..end_s),
            &Axis::bounded(
                "distance from the reference [mm]",
                Ticks::around(0.0..max, 5),
                0.0..1.25 * max,
            ),
        )?;
        panel.line(runs.used_law.iter().map(point), BLUE, 1.6)?;
        panel.line(runs.paper_law.iter().map(point), VERMILION, 1.8)?;
        if let Some(ended) = runs.ended {
            panel.vertical(ended.ended_s, REFERENCE)?;
            let at = (ended.ended_s, panel.y().end);
            let label = format!("ended by the supervisor at {:.2} s", ended.ended_s);
            let (side, dx) = match ended.ended_s < 0.5 * end_s {
                true => (HPos::Left, 8.0),
                false => (HPos::Right, -8.0),
            };
            panel.note(&label, at, (dx, 12.0), side, TEXT_COLOUR)?;
            panel.note(&ended.fault, at, (dx, 28.0), side, MUTED)?;
        }
        legend(
            area,
            (60.0, 13.0),
            &[
                (
                    "(3.6) exactly as printed",
                    LegendSymbol::Line(1.8),
                    VERMILION,
                ),
                (
                    "the law used by supple, same model",
                    LegendSymbol::Line(1.6),
                    BLUE,
                ),
            ],
        )
    })
}
