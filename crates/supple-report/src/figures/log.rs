//! The standard figures of a log: tracking and contact, the torque terms of every joint, the timing of the cycles.

use super::axis::Axis;
use super::canvas::{Figure, draw_canvas};
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, GREEN, ORANGE, PURPLE, REFERENCE, VERMILION};
use super::ticks::{Ticks, extent};
use plotters::style::RGBColor;

/// Width of the canvas and height of a panel \[px\].
const SIZE_PX: (u32, u32) = (760, 190);
/// Maximum number of points of a curve, apart from two more for each gap. In a longer curve, each pair of points is the minimum and maximum of an interval.
const MAX_POINTS: usize = 4000;

/// A curve ends before an interval that is longer than this multiple of its median interval, and begins again after it.
const GAP: f64 = 20.0;

/// Points of a curve: time \[s\] and value.
pub type Points = Vec<(f64, f64)>;

/// A line of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: &'static str,
    /// Points, in order of time.
    pub points: Points,
}

/// One panel: its curves over time.
#[derive(Clone, Debug, PartialEq)]
pub struct LogPanel {
    /// Title.
    pub title: String,
    /// Quantity and unit of the vertical axis.
    pub unit: &'static str,
    /// The curves; the first is drawn wide and grey, below the others, if `wide_first`.
    pub curves: Vec<Curve>,
    /// Whether the first curve is a reference.
    pub wide_first: bool,
    /// Intervals that are shaded \[s\].
    pub shaded_s: Vec<(f64, f64)>,
    /// Times of vertical lines \[s\].
    pub marked_s: Vec<f64>,
}

/// Draws panels below one another with the same time axis.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn draw(
    name: &'static str,
    alt_text: &str,
    panels: &[LogPanel],
) -> Result<Figure, FigureError> {
    let (width, height) = SIZE_PX;
    let count = panels.len().max(1) as u32;
    let all = || panels.iter().flat_map(|panel| &panel.curves);
    let time = extent(all().flat_map(|curve| curve.points.iter().map(|point| point.0)));
    let svg = draw_canvas((width, height * count), alt_text, |area| {
        for (panel, area) in panels.iter().zip(area.split_evenly((panels.len(), 1))) {
            let values = panel.curves.iter().flat_map(|curve| &curve.points);
            let value = extent(values.map(|point| point.1));
            let mut drawn = Panel::new(
                &area,
                &panel.title,
                Margins::default(),
                &Axis::new("time [s]", Ticks::around(time.clone(), 8)),
                &Axis::new(panel.unit, Ticks::around(value, 4)),
            )?;
            for (from, to) in &panel.shaded_s {
                drawn.band(*from, *to)?;
            }
            for at in &panel.marked_s {
                drawn.vertical(*at, VERMILION)?;
            }
            let mut entries = Vec::new();
            for (index, curve) in panel.curves.iter().enumerate() {
                let (colour, width_px) = stroke_of(index, panel.wide_first);
                let size = curve.points.len().div_ceil(MAX_POINTS / 2);
                for part in without_gaps(&curve.points) {
                    drawn.line(thinned(part, size), colour, width_px)?;
                }
                entries.push((curve.name, LegendSymbol::Line(width_px), colour));
            }
            legend(&area, (360.0, 14.0), &entries)?;
        }
        Ok(())
    })?;
    Ok(Figure { name, svg })
}

fn stroke_of(index: usize, wide_first: bool) -> (RGBColor, f64) {
    const COLOURS: [RGBColor; 5] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE];
    match (wide_first, index) {
        (true, 0) => (REFERENCE, 3.0),
        (true, _) => (COLOURS[(index - 1) % COLOURS.len()], 1.2),
        (false, _) => (COLOURS[index % COLOURS.len()], 1.2),
    }
}

/// Divides a curve where it has no points for a while.
fn without_gaps(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    let mut intervals: Vec<f64> = (points.windows(2))
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    let gap_s = match intervals.len() {
        0 => f64::INFINITY,
        count => {
            GAP * *intervals
                .select_nth_unstable_by(count / 2, f64::total_cmp)
                .1
        }
    };
    points.chunk_by(move |a, b| b.0 - a.0 <= gap_s)
}

/// Thins a curve out: divides it into intervals of `size` points, and keeps minimum and maximum of each, in order.
fn thinned(points: &[(f64, f64)], size: usize) -> Points {
    if size <= 2 {
        return points.to_vec();
    }
    let mut thinned = Vec::with_capacity(MAX_POINTS);
    for points in points.chunks(size) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let ends = [
            points.iter().min_by(by_value),
            points.iter().max_by(by_value),
        ];
        let mut ends: Points = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        thinned.extend(ends);
    }
    thinned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_not_drawn_over_a_gap() {
        let at = |k: i32| (1e-3 * f64::from(k), 1.0);
        let points: Points = (0..500).chain(900..1200).map(at).collect();
        let parts: Vec<_> = without_gaps(&points).collect();
        assert_eq!(parts, [&points[..500], &points[500..]]);
        // A few lost cycles are no gap.
        let points: Points = (0..500).chain(510..600).map(at).collect();
        assert_eq!(without_gaps(&points).count(), 1);
        assert_eq!(without_gaps(&points[..1]).count(), 1);
    }

    #[test]
    fn thinning_keeps_peaks_and_order() {
        let mut points: Points = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[12_345].1 = 7.0;
        points[54_321].1 = -3.0;
        let thinned = thinned(&points, 50);
        assert!(thinned.len() <= MAX_POINTS, "{}", thinned.len());
        for peak in [(12_345.0, 7.0), (54_321.0, -3.0)] {
            assert!(thinned.contains(&peak), "{peak:?}");
        }
        assert!(thinned.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!(super::thinned(&points[..100], 1), points[..100]);
    }
}
