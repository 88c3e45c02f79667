//! Curves of an identification: two quantities over time, angle or speed, one panel per joint.

use super::axis::Axis;
use super::canvas::draw_canvas;
use super::error::FigureError;
use super::panel::{LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, REFERENCE};
use super::ticks::{Ticks, extent};

/// Width of the canvas and height of a panel \[px\].
const SIZE_PX: (u32, u32) = (760, 190);

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// Title of the panel.
    pub title: String,
    /// Unit of the vertical axis.
    pub unit: &'static str,
    /// Name and points of the wide line.
    pub first: (&'static str, Vec<(f64, f64)>),
    /// Name and points of the line on top.
    pub second: (&'static str, Vec<(f64, f64)>),
}

/// Draws the figure as SVG; `horizontal` is the label of the horizontal axes.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn curves(alt_text: &str, horizontal: &str, panels: &[Curves]) -> Result<String, FigureError> {
    let (width, height) = SIZE_PX;
    let count = panels.len().max(1) as u32;
    draw_canvas((width, height * count), alt_text, |area| {
        for (curves, area) in panels.iter().zip(area.split_evenly((panels.len(), 1))) {
            let all = || curves.first.1.iter().chain(&curves.second.1);
            let across = extent(all().map(|point| point.0));
            let value = extent(all().map(|point| point.1));
            let mut panel = Panel::new(
                &area,
                &curves.title,
                Margins::default(),
                &Axis::new(horizontal, Ticks::around(across, 8)),
                &Axis::new(curves.unit, Ticks::around(value, 4)),
            )?;
            panel.line(curves.first.1.iter().copied(), REFERENCE, 3.0)?;
            panel.line(curves.second.1.iter().copied(), BLUE, 1.2)?;
            legend(
                &area,
                (520.0, 14.0),
                &[
                    (curves.first.0, LegendSymbol::Line(3.0), REFERENCE),
                    (curves.second.0, LegendSymbol::Line(1.2), BLUE),
                ],
            )?;
        }
        Ok(())
    })
}
