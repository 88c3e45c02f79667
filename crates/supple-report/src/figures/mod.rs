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
use supple_experiment::{Demo, scenario};

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

/// All figures whose runs were not left out, in the order of the report.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn all(demo: &Demo) -> Result<Vec<Figure>, FigureError> {
    let sinusoids = demo.sinusoids.iter().all(|(_, run)| !run.is_left_out());
    let quadrants = demo.quadrants.iter().all(|(_, run)| !run.is_left_out());
    let summary = &demo.summary;
    let all = scenario::PROBING_STIFFNESS_N_PER_M.len();
    let probing = [&demo.probing, &demo.probing_fade_off]
        .iter()
        .all(|runs| runs.len() == all);
    let exact = &summary.sinusoid_exact_model;
    let exact = exact.coulomb.rms_error_m.is_finite() && exact.stribeck.rms_error_m.is_finite();
    type Draw<'a> = Box<dyn Fn() -> Result<String, FigureError> + 'a>;
    let figures: [(&'static str, bool, Draw<'_>); 9] = [
        (
            "figure_3a",
            sinusoids,
            Box::new(|| figure_3a::draw(&figure_3a::SinusoidRuns::of(demo))),
        ),
        (
            "figure_3b",
            quadrants,
            Box::new(|| figure_3b::draw(&figure_3b::quadrant_runs(demo))),
        ),
        (
            "figure_4",
            sinusoids,
            Box::new(|| figure_4::draw(figure_4::samples(demo))),
        ),
        (
            "figure_5",
            probing,
            Box::new(|| figure_5::draw(&figure_5::probings(demo))),
        ),
        (
            "figure_6",
            probing,
            Box::new(|| figure_6::draw(&figure_6::Impulses::of(demo))),
        ),
        (
            "trade_off",
            probing,
            Box::new(|| trade_off::draw(&trade_off::points(demo))),
        ),
        (
            "paper_letter",
            sinusoids && !demo.paper_letter.is_left_out(),
            Box::new(|| paper_letter::draw(&paper_letter::PaperLawRuns::of(demo))),
        ),
        (
            "seeds",
            exact && !summary.seeds.is_empty(),
            Box::new(|| seeds::draw(&seeds::Seeds::of(demo))),
        ),
        (
            "arc",
            !demo.arc.is_left_out(),
            Box::new(|| arc::draw(&demo.arc.trace.samples)),
        ),
    ];
    figures
        .into_iter()
        .filter(|(_, has_its_runs, _)| *has_its_runs)
        .map(|(name, _, draw)| draw().map(|svg| Figure { name, svg }))
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
