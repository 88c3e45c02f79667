//! Renders SVG to PNG with embedded fonts, so that the result does not depend on installed fonts.

use super::error::FigureError;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::sync::Arc;

/// Bitmap pixels per displayed pixel.
const PIXEL_RATIO: f32 = 2.0;

/// Renders an SVG to a PNG bitmap.
pub fn render(name: &str, svg: &str) -> Result<Vec<u8>, FigureError> {
    let failed = |reason: String| FigureError::Render {
        name: name.to_owned(),
        reason,
    };
    let mut options = Options::default();
    let faces = Arc::make_mut(&mut options.fontdb);
    faces.load_font_data(dejavu::sans::regular().to_vec());
    faces.set_sans_serif_family("DejaVu Sans");
    let tree = Tree::from_str(svg, &options).map_err(|error| failed(error.to_string()))?;
    let size = tree
        .size()
        .to_int_size()
        .scale_by(PIXEL_RATIO)
        .ok_or_else(|| failed("it has no size".to_owned()))?;
    let mut pixmap = Pixmap::new(size.width(), size.height())
        .ok_or_else(|| failed("it is too large".to_owned()))?;
    resvg::render(
        &tree,
        Transform::from_scale(PIXEL_RATIO, PIXEL_RATIO),
        &mut pixmap.as_mut(),
    );
    pixmap
        .encode_png()
        .map_err(|error| failed(error.to_string()))
}
