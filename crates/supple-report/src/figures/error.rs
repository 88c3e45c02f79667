//! Errors of drawing a figure.

use plotters::drawing::DrawingAreaErrorKind;
use supple_cli::exit::Failure;

/// Error: a figure cannot be drawn.
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
