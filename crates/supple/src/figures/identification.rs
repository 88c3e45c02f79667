//! Curves of an identification: two quantities over time, a panel a joint.

use super::axis::Axis;
use super::panel::{Key, Panel, Room, legend};
use super::style::{BLUE, REFERENCE};
use super::ticks::{Ticks, extent};
use super::{FigureError, sheet};

/// Width of the sheet and height of a panel \[px\].
const SIZE_PX: (u32, u32) = (760, 190);

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// Its title.
    pub title: String,
    /// Unit of the vertical axis.
    pub unit: &'static str,
    /// Name and points, drawn broad.
    pub first: (&'static str, Vec<(f64, f64)>),
    /// Name and points, drawn above.
    pub second: (&'static str, Vec<(f64, f64)>),
}

/// The SVG.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn curves(words: &str, panels: &[Curves]) -> Result<String, FigureError> {
    let (width, height) = SIZE_PX;
    let count = panels.len().max(1) as u32;
    sheet((width, height * count), words, |area| {
        for (curves, place) in panels.iter().zip(area.split_evenly((panels.len(), 1))) {
            let all = || curves.first.1.iter().chain(&curves.second.1);
            let time = extent(all().map(|point| point.0));
            let value = extent(all().map(|point| point.1));
            let mut panel = Panel::new(
                &place,
                &curves.title,
                Room::default(),
                &Axis::new("time [s]", Ticks::around(time, 8)),
                &Axis::new(curves.unit, Ticks::around(value, 4)),
            )?;
            panel.line(curves.first.1.iter().copied(), REFERENCE, 3.0)?;
            panel.line(curves.second.1.iter().copied(), BLUE, 1.2)?;
            legend(
                &place,
                (520.0, 14.0),
                &[
                    (curves.first.0, Key::Line(3.0), REFERENCE),
                    (curves.second.0, Key::Line(1.2), BLUE),
                ],
            )?;
        }
        Ok(())
    })
}
