//! The paper's trade-off: error in free motion against impulse in contact, over stiffness.

use super::axis::Axis;
use super::canvas::{draw_canvas, mm};
use super::error::FigureError;
use super::panel::{Margins, Mark, Panel};
use super::style::{BLUE, REFERENCE, TEXT_COLOUR};
use super::ticks::{Ticks, extent};
use plotters::style::text_anchor::HPos;
use supple_experiment::Demo;

/// Point of the figure for one stiffness.
pub struct Point {
    /// `K` \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Error in free motion, root mean square \[m\].
    pub free_rms_m: f64,
    /// Impulse over one cycle \[N s\].
    pub impulse_newton_s: f64,
}

/// Collects the points of a demo, with the fade on.
pub fn points(demo: &Demo) -> Vec<Point> {
    let lines = demo.summary.probing.iter();
    lines
        .map(|e| Point {
            stiffness_n_per_m: e.stiffness_n_per_m,
            free_rms_m: e.free_rms_m,
            impulse_newton_s: e.contact.impulse_newton_s,
        })
        .collect()
}

/// Draws the figure as SVG.
pub fn draw(points: &[Point]) -> Result<String, FigureError> {
    let alt_text = "Error in free motion against impulse in contact, one point per stiffness";
    draw_canvas((760, 400), alt_text, |area| {
        let values: Vec<_> = points
            .iter()
            .map(|p| (mm(p.free_rms_m), p.impulse_newton_s))
            .collect();
        let error = extent(values.iter().map(|p| p.0));
        let impulse = extent(values.iter().map(|p| p.1)).end;
        let mut panel = Panel::new(
            area,
            "",
            Margins::default(),
            &Axis::logarithmic(
                "error in free motion, RMS [mm]",
                0.8 * error.start..1.4 * error.end,
            ),
            &Axis::new(
                "impulse over one cycle [N s]",
                Ticks::around(0.0..1.1 * impulse, 6),
            ),
        )?;
        panel.line(values.iter().copied(), REFERENCE, 1.6)?;
        panel.marks(&values, Mark::Dot, BLUE)?;
        for (point, value) in points.iter().zip(&values) {
            let label = format!("{} N/m", point.stiffness_n_per_m);
            panel.note(&label, *value, (9.0, -9.0), HPos::Left, TEXT_COLOUR)?;
        }
        Ok(())
    })
}
