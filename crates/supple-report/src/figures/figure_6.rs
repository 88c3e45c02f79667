//! Figure 6: impulse of one contact over stiffness, with a line through it, and the first impact by itself.

use super::axis::Axis;
use super::canvas::draw_canvas;
use super::error::FigureError;
use super::panel::{Area, LegendSymbol, Margins, Mark, Panel, legend};
use super::style::{BLUE, GREEN, TEXT_COLOUR, VERMILION, px};
use super::ticks::{Ticks, extent, number};
use plotters::style::RGBColor;
use std::ops::Range;
use supple_experiment::metrics::LineFit;
use supple_experiment::summary::ProbingSummary;
use supple_experiment::{Demo, scenario};

/// Range of stiffness of the second panel \[N/m\].
const NEAR_ZERO_N_PER_M: f64 = 25.0;

/// Impulses of runs that differ in stiffness only.
pub struct Series {
    /// `K` \[N/m\], impulse over the whole cycle \[N s\].
    pub whole: Vec<(f64, f64)>,
    /// `K` \[N/m\], impulse of the first impact \[N s\].
    pub impact: Vec<(f64, f64)>,
    /// Line fitted to `whole`.
    pub fit: Option<LineFit>,
}

/// Impulses with the friction feed-forward adapted in contact, and left on.
pub struct Impulses {
    /// Impulses with an identified model, and the feed-forward adapted in contact.
    pub fade_on: Series,
    /// Impulses with a perturbed model, and the feed-forward left on.
    pub fade_off: Series,
}

impl Impulses {
    /// Collects the impulses of a demo.
    pub fn of(demo: &Demo) -> Impulses {
        let summary = &demo.summary;
        let series = |lines: &[ProbingSummary], fit: Option<LineFit>| Series {
            whole: column(lines, |e| e.contact.impulse_newton_s),
            impact: column(lines, |e| e.contact.impact_newton_s),
            fit,
        };
        Impulses {
            fade_on: series(&summary.probing, summary.contact.impulse_fit),
            fade_off: series(&summary.probing_fade_off, summary.fade_off.impulse_fit),
        }
    }
}

fn column(lines: &[ProbingSummary], value: fn(&ProbingSummary) -> f64) -> Vec<(f64, f64)> {
    lines
        .iter()
        .map(|e| (e.stiffness_n_per_m, value(e)))
        .collect()
}

/// Draws the figure as SVG.
pub fn draw(impulses: &Impulses) -> Result<String, FigureError> {
    let alt_text = "Impulse of one contact over stiffness with a straight line through it, friction \
                 feed-forward adapted in contact and left on";
    draw_canvas((760, 400), alt_text, |area| {
        let (head, body) = area.split_vertically(px(46.0));
        keys(&head, impulses)?;
        let (whole, near_zero) = body.split_horizontally(px(470.0));
        panel(
            &whole,
            "(a)  all stiffnesses",
            impulses,
            (-6.0..131.0, 25.0),
        )?;
        panel(
            &near_zero,
            "(b)  near zero",
            impulses,
            (-2.5..NEAR_ZERO_N_PER_M + 2.5, 5.0),
        )
    })
}

fn panel(
    area: &Area<'_>,
    title: &str,
    impulses: &Impulses,
    (stiffness, step): (Range<f64>, f64),
) -> Result<(), FigureError> {
    let series = [&impulses.fade_on, &impulses.fade_off];
    let shown = |(k, impulse): &(f64, f64)| stiffness.contains(k).then_some(*impulse);
    let all = series.iter().flat_map(|s| s.whole.iter().chain(&s.impact));
    let values = extent(all.filter_map(shown).chain([0.0]));
    let mut panel = Panel::new(
        area,
        title,
        Margins::default(),
        &Axis::bounded(
            "stiffness K [N/m]",
            Ticks::stepped(stiffness.clone(), step),
            stiffness,
        ),
        &Axis::new(
            "impulse over one cycle [N s]",
            Ticks::around(values.start..1.04 * values.end, 8),
        ),
    )?;
    line_and_marks(&mut panel, &impulses.fade_off, Mark::Square, VERMILION)?;
    line_and_marks(&mut panel, &impulses.fade_on, Mark::Dot, BLUE)?;
    panel.marks(&impulses.fade_on.impact, Mark::Triangle, GREEN)
}

fn keys(area: &Area<'_>, impulses: &Impulses) -> Result<(), FigureError> {
    let formula = |label: &str, series: &Series| match series.fit {
        Some(fit) => format!(
            "{label}: {} + {} K, R\u{b2} = {}",
            number(fit.intercept, 2),
            number(fit.slope, 4),
            number(fit.r2, 3)
        ),
        None => label.to_owned(),
    };
    let on = formula("adapted", &impulses.fade_on);
    let off = formula("left on", &impulses.fade_off);
    let rows = [
        [
            (on.as_str(), LegendSymbol::Mark(Mark::Dot), BLUE),
            (
                "first impact, adapted",
                LegendSymbol::Mark(Mark::Triangle),
                GREEN,
            ),
        ],
        [
            (off.as_str(), LegendSymbol::Mark(Mark::Square), VERMILION),
            (
                "line through 5 to 125 N/m",
                LegendSymbol::Line(1.4),
                TEXT_COLOUR,
            ),
        ],
    ];
    for (row, y) in rows.iter().zip([14.0, 34.0]) {
        legend(area, (52.0, y), &row[..1])?;
        legend(area, (400.0, y), &row[1..])?;
    }
    Ok(())
}

fn line_and_marks(
    panel: &mut Panel<'_, '_>,
    series: &Series,
    mark: Mark,
    colour: RGBColor,
) -> Result<(), FigureError> {
    if let Some(LineFit {
        slope, intercept, ..
    }) = series.fit
    {
        let start = scenario::STIFFNESS_N_PER_M;
        let end = extent(series.whole.iter().map(|p| p.0)).end;
        // The line consists of short steps, because a panel omits points beyond its range. It ends at the outermost points.
        let steps = (0..=100).map(|k| start + (end - start) * f64::from(k) / 100.0);
        panel.line(steps.map(|k| (k, intercept + slope * k)), colour, 1.4)?;
    }
    panel.marks(&series.whole, mark, colour)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the centres of the filled discs of a colour, without the legend.
    fn discs(svg: &str, colour: &str) -> Vec<(f64, f64)> {
        let document = roxmltree::Document::parse(svg).expect("XML");
        let number = |node: &roxmltree::Node<'_, '_>, name| -> f64 {
            let value = node.attribute(name).expect("an attribute");
            value.parse().expect("a number")
        };
        document
            .descendants()
            .filter(|node| node.has_tag_name("circle") && node.attribute("fill") == Some(colour))
            .map(|node| (number(&node, "cx"), number(&node, "cy")))
            .filter(|(_, y)| *y > 600.0)
            .collect()
    }

    #[test]
    fn marks_are_drawn_at_the_positions_of_the_data() {
        let stiffnesses = [0.5, 5.0, 25.0, 50.0, 75.0, 100.0, 125.0];
        let series = |intercept: f64| {
            let whole: Vec<_> = stiffnesses.map(|k| (k, intercept + 0.02 * k)).into();
            Series {
                impact: stiffnesses.map(|k| (k, 0.1)).into(),
                fit: LineFit::new(&whole),
                whole,
            }
        };
        let svg = draw(&Impulses {
            fade_on: series(0.2),
            fade_off: series(0.9),
        });
        let svg = svg.expect("a figure");
        let places = discs(&svg, "#0072B2");
        let all = &places[..stiffnesses.len()];
        let near_zero = &places[stiffnesses.len()..];
        assert_eq!(near_zero.len(), 3, "0.5, 5 and 25 N/m");
        // Both axes are linear: distances of the marks are proportional to those of the data, within a pixel.
        let [first, .., last] = all else { panic!() };
        for (k, (x, y)) in stiffnesses.iter().zip(all) {
            let share = (k - 0.5) / 124.5;
            assert!(
                (x - first.0 - share * (last.0 - first.0)).abs() < 2.0,
                "{k}"
            );
            assert!(
                (y - first.1 - share * (last.1 - first.1)).abs() < 2.0,
                "{k}"
            );
        }
        assert!(last.1 < first.1, "a larger value is higher in the figure");
        assert!(svg.contains("adapted: 0.20 + 0.0200 K"));
    }

    #[test]
    fn a_figure_without_a_fitted_line_is_drawn() {
        let none = || Series {
            whole: vec![(5.0, f64::NAN)],
            impact: Vec::new(),
            fit: None,
        };
        let svg = draw(&Impulses {
            fade_on: none(),
            fade_off: none(),
        });
        assert!(svg.expect("a figure").contains("adapted"));
    }
}
