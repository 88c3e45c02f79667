//! Figure of the arc about the base: top view of the path, and tracking error.

use super::axis::Axis;
use super::canvas::{distance, draw_canvas, mm};
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, REFERENCE, px};
use super::ticks::{Ticks, extent};
use supple_experiment::Sample;

/// Draws the figure as SVG.
pub fn draw(samples: &[Sample]) -> Result<String, FigureError> {
    let alt_text = "Path of the tip along the arc seen from above, and its error over time";
    draw_canvas((760, 270), alt_text, |area| {
        let (path_area, distance_area) = area.split_horizontally(px(300.0));
        let coordinate = |axis: usize| {
            extent(
                samples
                    .iter()
                    .flat_map(move |s| [s.reference_m[axis], s.tip_m[axis]]),
            )
        };
        let mut panel = Panel::new(
            &path_area,
            "path from above, x enlarged",
            Margins::default(),
            &Axis::new("y [m]", Ticks::around(coordinate(1), 4)),
            &Axis::new("x [m]", Ticks::around(coordinate(0), 4)),
        )?;
        panel.line(
            samples.iter().map(|s| (s.reference_m[1], s.reference_m[0])),
            REFERENCE,
            5.0,
        )?;
        panel.line(samples.iter().map(|s| (s.tip_m[1], s.tip_m[0])), BLUE, 1.4)?;
        let distance_mm = |s: &Sample| mm(distance(&s.tip_m, &s.reference_m));
        let end = samples.last().map_or(1.0, |s| s.time_s.floor());
        let max = extent(samples.iter().map(distance_mm)).end;
        let mut panel = Panel::new(
            &distance_area,
            "distance from the reference",
            Margins::default(),
            &Axis::new("time [s]", Ticks::stepped(0.0..end, 2.0)),
            &Axis::new("distance [mm]", Ticks::around(0.0..1.05 * max, 5)),
        )?;
        panel.line(
            samples.iter().map(|s| (s.time_s, distance_mm(s))),
            BLUE,
            1.4,
        )?;
        legend(
            &distance_area,
            (240.0, 14.0),
            &[
                ("reference", LegendSymbol::Line(5.0), REFERENCE),
                ("actual", LegendSymbol::Line(1.4), BLUE),
            ],
        )
    })
}
