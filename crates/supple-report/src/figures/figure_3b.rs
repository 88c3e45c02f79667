//! Figure 3b: the path through the quadrant and the error along it, at each speed.

use super::axis::Axis;
use super::canvas::{distance, draw_canvas, mm};
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, MUTED, REFERENCE, px};
use super::ticks::{Ticks, extent};
use crate::sections::quadrants_with_models;
use plotters::style::text_anchor::HPos;
use std::ops::Range;
use supple_core::trajectory::{PathSegment, Quadrant};
use supple_experiment::{Demo, Sample};

/// Height of the legend above all rows \[px\].
const HEAD_PX: f64 = 24.0;
/// Height of a row \[px\].
const HEIGHT_PX: f64 = 270.0;
/// Width of the path \[px\].
const PATH_WIDTH_PX: f64 = 370.0;
/// Free space around the path, as a fraction of its size.
const MARGIN: f64 = 0.08;

/// One run of the quadrant.
pub struct QuadrantRun<'a> {
    /// Trajectory of the run.
    pub quadrant: Quadrant,
    /// Speed and model.
    pub title: String,
    /// Samples of the run.
    pub samples: &'a [Sample],
}

/// Collects the runs of a demo.
pub fn quadrant_runs(demo: &Demo) -> Vec<QuadrantRun<'_>> {
    let runs = quadrants_with_models(&demo.summary)
        .into_iter()
        .zip(&demo.quadrants);
    runs.map(|((summary, model), (quadrant, run))| QuadrantRun {
        quadrant: *quadrant,
        title: format!("{:.3} m/s, {model}", summary.speed_m_per_s),
        samples: &run.trace.samples,
    })
    .collect()
}

/// Draws the figure as SVG.
pub fn draw(quadrant_runs: &[QuadrantRun<'_>]) -> Result<String, FigureError> {
    let alt_text = "Path of the tip through the quadrant in the x-z plane, and its error over time";
    let height =
        HEAD_PX as u32 + HEIGHT_PX as u32 * u32::try_from(quadrant_runs.len()).unwrap_or(0);
    draw_canvas((760, height), alt_text, |area| {
        let (head, rows) = area.split_vertically(px(HEAD_PX));
        let entries = [
            ("reference", LegendSymbol::Line(5.0), REFERENCE),
            ("actual", LegendSymbol::Line(1.4), BLUE),
        ];
        legend(&head, (58.0, 14.0), &entries)?;
        let rows = rows.split_evenly((quadrant_runs.len().max(1), 1));
        for (row, run) in rows.iter().zip(quadrant_runs) {
            let (path, error) = row.split_horizontally(px(PATH_WIDTH_PX));
            draw_path(&path, run)?;
            draw_error(&error, run)?;
        }
        Ok(())
    })
}

fn draw_path(area: &super::panel::Area<'_>, run: &QuadrantRun<'_>) -> Result<(), FigureError> {
    // The horizontal coordinate is along the first semi-axis, which is x for the paper's path.
    let along = run.quadrant.first_m();
    let along = along / along.norm();
    let seen = move |point: &[f64; 3]| (along.x * point[0] + along.y * point[1], point[2]);
    let points = || {
        let samples = run.samples.iter();
        samples.flat_map(|s| [seen(&s.reference_m), seen(&s.tip_m)])
    };
    let horizontal = if along.y == 0.0 {
        "x [m]"
    } else {
        "outward [m]"
    };
    let margins = Margins::default();
    let axes_px = margins.axes_px(PATH_WIDTH_PX, HEIGHT_PX);
    let (x_range, z_range) = same_scale(
        extent(points().map(|(x, _)| x)),
        extent(points().map(|(_, z)| z)),
        axes_px,
    );
    let mut panel = Panel::new(
        area,
        &run.title,
        margins,
        &Axis::bounded(horizontal, Ticks::stepped(x_range.clone(), 0.1), x_range),
        &Axis::bounded("z [m]", Ticks::stepped(z_range.clone(), 0.1), z_range),
    )?;
    panel.line(
        run.samples.iter().map(|s| seen(&s.reference_m)),
        REFERENCE,
        5.0,
    )?;
    panel.line(run.samples.iter().map(|s| seen(&s.tip_m)), BLUE, 1.4)
}

/// Widens both ranges so that both axes have the same scale (metres per pixel).
fn same_scale(x: Range<f64>, z: Range<f64>, axes_px: (f64, f64)) -> (Range<f64>, Range<f64>) {
    let size = |r: &Range<f64>| (1.0 + 2.0 * MARGIN) * (r.end - r.start);
    let m_per_px = (size(&x) / axes_px.0).max(size(&z) / axes_px.1);
    let around = |r: Range<f64>, length_px: f64| {
        let (middle, half) = (0.5 * (r.start + r.end), 0.5 * m_per_px * length_px);
        middle - half..middle + half
    };
    (around(x, axes_px.0), around(z, axes_px.1))
}

fn draw_error(area: &super::panel::Area<'_>, run: &QuadrantRun<'_>) -> Result<(), FigureError> {
    let distance_mm = |s: &Sample| mm(distance(&s.tip_m, &s.reference_m));
    let end = run.samples.last().map_or(1.0, |s| s.time_s);
    let max = extent(run.samples.iter().map(distance_mm)).end;
    let mut panel = Panel::new(
        area,
        "distance from the reference, per segment",
        Margins::default(),
        &Axis::bounded("time [s]", Ticks::around(0.0..end, 5), 0.0..end),
        &Axis::new("distance [mm]", Ticks::around(0.0..1.12 * max, 5)),
    )?;
    let top = panel.y().end;
    for (segment, from, to) in segments(run) {
        if segment == PathSegment::Ellipse {
            panel.band(from, to)?;
        }
        let name = match segment {
            PathSegment::Out => "out",
            PathSegment::Ellipse => "ellipse",
            PathSegment::Back => "back",
        };
        if to - from > 0.08 * end {
            panel.note(
                name,
                (0.5 * (from + to), top),
                (0.0, 9.0),
                HPos::Center,
                MUTED,
            )?;
        }
    }
    panel.line(
        run.samples.iter().map(|s| (s.time_s, distance_mm(s))),
        BLUE,
        1.4,
    )
}

/// Pieces of the trajectory in order of travel, with their start and end times \[s\].
fn segments(run: &QuadrantRun<'_>) -> Vec<(PathSegment, f64, f64)> {
    let mut segments: Vec<(PathSegment, f64, f64)> = Vec::new();
    for s in run.samples {
        let (segment, _, _) = run.quadrant.segment_at(s.time_s);
        match segments.last_mut() {
            Some((last, _, to)) if *last == segment => *to = s.time_s,
            _ => segments.push((segment, s.time_s, s.time_s)),
        }
    }
    segments
}
