//! The figures of a demo. Each module draws an SVG from plain series; the PNG is rendered from that SVG with an
//! embedded font, so that it does not depend on installed fonts.

mod arc;
mod axis;
mod figure_3a;
mod figure_3b;
mod figure_4;
mod figure_5;
mod figure_6;
pub mod identification;
pub mod log;
mod panel;
mod paper_letter;
mod png;
mod seeds;
mod style;
mod ticks;
mod trade_off;

use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use supple_cli::exit::Failure;
use supple_experiment::Demo;

/// Why a figure cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// The drawing library reported an error.
    #[error("a figure cannot be drawn: {0}")]
    Draw(String),
    /// The SVG cannot be rendered.
    #[error("figure {name} cannot be rendered: {reason}")]
    Render {
        /// Name of the figure.
        name: String,
        /// Error of the renderer.
        reason: String,
    },
}

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for FigureError {
    fn from(error: DrawingAreaErrorKind<E>) -> FigureError {
        FigureError::Draw(error.to_string())
    }
}

impl From<FigureError> for Failure {
    fn from(error: FigureError) -> Failure {
        Failure::Figure(error.to_string())
    }
}

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

/// All figures, in the order of the report.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn all(demo: &Demo) -> Result<Vec<Figure>, FigureError> {
    let figure = |name, svg: Result<String, FigureError>| svg.map(|svg| Figure { name, svg });
    [
        figure(
            "figure_3a",
            figure_3a::draw(&figure_3a::SinusoidRuns::of(demo)),
        ),
        figure(
            "figure_3b",
            figure_3b::draw(&figure_3b::quadrant_runs(demo)),
        ),
        figure("figure_4", figure_4::draw(figure_4::samples(demo))),
        figure("figure_5", figure_5::draw(&figure_5::probings(demo))),
        figure("figure_6", figure_6::draw(&figure_6::Impulses::of(demo))),
        figure("trade_off", trade_off::draw(&trade_off::points(demo))),
        figure(
            "paper_letter",
            paper_letter::draw(&paper_letter::PaperLawRuns::of(demo)),
        ),
        figure("seeds", seeds::draw(&seeds::Seeds::of(demo))),
        figure("arc", arc::draw(&demo.arc.trace.samples)),
    ]
    .into_iter()
    .collect()
}

/// Draws on a canvas of the given display size \[px\]; `alt_text` is the alternative text.
fn draw_canvas(
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
    // Scaled down for display, with a text alternative for accessibility.
    let (_, rest) = svg.split_once("viewBox=").unwrap_or(("", &svg));
    let (tag, rest) = rest.split_once('>').unwrap_or((rest, ""));
    let alt_text = escape(alt_text);
    Ok(format!(
        "<svg width=\"{width}\" height=\"{height}\" role=\"img\" viewBox={tag}>\n<title>{alt_text}</title>{rest}"
    ))
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Metres as millimetres.
fn mm(metres: f64) -> f64 {
    1e3 * metres
}

/// Distance between two points, in their unit.
fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}
