//! Renders SVG to PNG.

use super::error::FigureError;
use super::outline::outline_text;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// Bitmap pixels per displayed pixel.
const PIXEL_RATIO: f32 = 2.0;

/// Renders an SVG to a PNG bitmap.
pub fn render(name: &str, svg: &str) -> Result<Vec<u8>, FigureError> {
    let failed = |reason: String| FigureError::Render {
        name: name.to_owned(),
        reason,
    };
    let svg = outline_text(svg).map_err(failed)?;
    let tree =
        Tree::from_str(&svg, &Options::default()).map_err(|error| failed(error.to_string()))?;
    let size = tree
        .size()
        .to_int_size()
        .scale_by(PIXEL_RATIO)
        .ok_or_else(|| failed("the figure has no size".to_owned()))?;
    let mut pixmap = Pixmap::new(size.width(), size.height())
        .ok_or_else(|| failed("the figure is too large".to_owned()))?;
    resvg::render(
        &tree,
        Transform::from_scale(PIXEL_RATIO, PIXEL_RATIO),
        &mut pixmap.as_mut(),
    );
    pixmap
        .encode_png()
        .map_err(|error| failed(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::render;
    use resvg::tiny_skia::Pixmap;

    #[test]
    fn text_is_drawn() {
        let svg = "<svg width=\"60\" height=\"20\" viewBox=\"0 0 60 20\" xmlns=\"http://www.w3.org/2000/svg\"><rect width=\"60\" \
                   height=\"20\" fill=\"#FFFFFF\"/><text x=\"30\" y=\"15\" dy=\"0em\" text-anchor=\"middle\" font-size=\"12\" \
                   fill=\"#000000\">error [mm]</text></svg>";
        let png = render("text", svg).expect("the figure is rendered");
        let bitmap = Pixmap::decode_png(&png).expect("a PNG");
        assert_eq!((bitmap.width(), bitmap.height()), (120, 40));
        let dark = bitmap.pixels().iter().filter(|p| p.red() < 0x40).count();
        assert!(dark > 100, "{dark} dark pixels");
    }
}
