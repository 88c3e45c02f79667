//! A figure and the canvas on which it is drawn.

use super::error::FigureError;
use super::{panel, png, style};
use plotters::prelude::*;

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Name of the files, without extension.
    pub name: &'static str,
    /// The drawing.
    pub svg: String,
}

impl Figure {
    /// Renders the figure to a PNG with two pixels per displayed pixel.
    ///
    /// # Errors
    /// [`FigureError::Render`].
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        png::render(self.name, &self.svg)
    }
}

/// Draws on a canvas of the given display size \[px\]; `alt_text` is the alternative text.
pub(super) fn draw_canvas(
    size_px: (u32, u32),
    alt_text: &str,
    draw: impl FnOnce(&panel::Area<'_>) -> Result<(), FigureError>,
) -> Result<String, FigureError> {
    let (width, height) = size_px;
    let scale = style::SCALE.unsigned_abs();
    let drawn = (width * scale, height * scale);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, drawn).into_drawing_area();
        area.fill(&style::BACKGROUND)?;
        draw(&area)?;
        area.present()?;
    }
    // The figure is scaled down for display and has an alternative text for accessibility.
    let (_, rest) = svg.split_once("viewBox=").unwrap_or(("", &svg));
    let (tag, rest) = rest.split_once('>').unwrap_or((rest, ""));
    let alt_text = escape(alt_text);
    Ok(format!(
        "<svg width=\"{width}\" height=\"{height}\" role=\"img\" viewBox={tag}>\n<title>{alt_text}</title>{rest}"
    ))
}

pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Converts metres to millimetres.
pub(super) fn mm(metres: f64) -> f64 {
    1e3 * metres
}

/// Distance between two points, in their unit.
pub(super) fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}
