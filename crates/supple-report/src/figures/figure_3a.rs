//! Figure 3a: the tip along x over time, its error, and the error at other speeds.

use super::axis::Axis;
use super::canvas::{distance, draw_canvas, mm};
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, GREEN, PURPLE, REFERENCE, VERMILION};
use super::ticks::{Ticks, extent};
use plotters::style::RGBColor;
use supple_core::trajectory::Sinusoid;
use supple_experiment::{Demo, Sample};

/// Runs of the sinusoid.
pub struct SinusoidRuns<'a> {
    /// Run at the paper's speed.
    pub at_paper_speed: &'a [Sample],
    /// All runs, with their speed factors.
    pub all: Vec<(f64, &'a [Sample])>,
}

impl<'a> SinusoidRuns<'a> {
    /// Collects the runs of a demo.
    pub fn of(demo: &'a Demo) -> SinusoidRuns<'a> {
        let all: Vec<_> = demo
            .sinusoids
            .iter()
            .map(|(speed, run)| (*speed, run.trace.samples.as_slice()))
            .collect();
        let paper = all.iter().find(|(speed, _)| *speed == 1.0);
        SinusoidRuns {
            at_paper_speed: paper.map_or(&[], |(_, samples)| samples),
            all,
        }
    }
}

/// Draws the figure as SVG.
pub fn draw(runs: &SinusoidRuns<'_>) -> Result<String, FigureError> {
    let alt_text =
        "Tip along x over time for the sinusoid, its error, and the error at three speeds";
    draw_canvas((760, 640), alt_text, |area| {
        let (position, rest) = area.split_vertically(super::style::px(235.0));
        let (components, by_speed) = rest.split_vertically(super::style::px(195.0));
        let time = time_ticks(runs.at_paper_speed);

        let x = |s: &Sample| [s.reference_m[0], s.tip_m[0]];
        let y_ticks = Ticks::around(extent(runs.at_paper_speed.iter().flat_map(x)), 5);
        let mut panel = Panel::new(
            &position,
            "(i)  reference and actual tip, K = 5 N/m",
            Margins::default(),
            &Axis::new("time [s]", time.clone()),
            &Axis::new("x [m]", y_ticks),
        )?;
        panel.line(
            runs.at_paper_speed
                .iter()
                .map(|s| (s.time_s, s.reference_m[0])),
            REFERENCE,
            5.0,
        )?;
        panel.line(
            runs.at_paper_speed.iter().map(|s| (s.time_s, s.tip_m[0])),
            BLUE,
            1.6,
        )?;
        legend(
            &position,
            (560.0, 14.0),
            &[
                ("reference", LegendSymbol::Line(5.0), REFERENCE),
                ("actual", LegendSymbol::Line(1.6), BLUE),
            ],
        )?;

        let error = |s: &Sample, axis: usize| mm(s.tip_m[axis] - s.reference_m[axis]);
        let all = runs
            .at_paper_speed
            .iter()
            .flat_map(|s| [0, 1, 2].map(|axis| error(s, axis)));
        let mut panel = Panel::new(
            &components,
            "(ii)  its error, by component",
            Margins::default(),
            &Axis::new("time [s]", time),
            &Axis::new("error [mm]", Ticks::around(extent(all), 4)),
        )?;
        for (axis, colour) in [(1, GREEN), (2, VERMILION), (0, BLUE)] {
            panel.line(
                runs.at_paper_speed
                    .iter()
                    .map(|s| (s.time_s, error(s, axis))),
                colour,
                1.4,
            )?;
        }
        legend(
            &components,
            (590.0, 14.0),
            &[
                ("x", LegendSymbol::Line(1.6), BLUE),
                ("y", LegendSymbol::Line(1.6), GREEN),
                ("z", LegendSymbol::Line(1.6), VERMILION),
            ],
        )?;

        let distance_mm = |s: &Sample| mm(distance(&s.tip_m, &s.reference_m));
        let all = runs
            .all
            .iter()
            .flat_map(|(_, samples)| samples.iter().map(distance_mm));
        let max = extent(all).end;
        let periods = |speed: f64, s: &Sample| s.time_s / Sinusoid::paper(speed).period_s();
        let mut panel = Panel::new(
            &by_speed,
            "(iii)  distance from the reference at three speeds",
            Margins::default(),
            &Axis::new(
                "time [periods]",
                Ticks::stepped(0.0..last(runs, periods), 0.25),
            ),
            &Axis::new("distance [mm]", Ticks::around(0.0..1.05 * max, 4)),
        )?;
        let colours: [RGBColor; 3] = [GREEN, BLUE, PURPLE];
        let mut entries = Vec::new();
        for ((speed, samples), colour) in runs.all.iter().zip(colours.into_iter().cycle()) {
            panel.line(
                samples.iter().map(|s| (periods(*speed, s), distance_mm(s))),
                colour,
                1.4,
            )?;
            entries.push((format!("{speed} \u{d7}"), colour));
        }
        let entries: Vec<_> = entries
            .iter()
            .map(|(label, colour)| (label.as_str(), LegendSymbol::Line(1.6), *colour))
            .collect();
        legend(&by_speed, (520.0, 14.0), &entries)
    })
}

fn time_ticks(samples: &[Sample]) -> Ticks {
    Ticks::stepped(0.0..samples.last().map_or(1.0, |s| s.time_s.floor()), 2.0)
}

fn last(runs: &SinusoidRuns<'_>, periods: impl Fn(f64, &Sample) -> f64) -> f64 {
    let ends = runs
        .all
        .iter()
        .filter_map(|(speed, samples)| samples.last().map(|s| periods(*speed, s)));
    ends.fold(0.25, f64::max).floor().max(0.25)
}
