//! Style of all figures: sizes, colours, fonts. The colours are those of Okabe and Ito (2008), which are
//! distinguishable with all common kinds of colour blindness; series also differ in line width or mark.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The drawing library uses integer pixels, so everything is drawn at this scale.
pub const SCALE: i32 = 10;
/// Fonts. The first is the embedded font of the PNG; a browser uses the first one that is installed.
pub const FONT: &str = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif";
/// Size of labels \[px\].
pub const TEXT_PX: f64 = 11.5;

/// Axes and text.
pub const TEXT_COLOUR: RGBColor = RGBColor(0x1F, 0x24, 0x30);
/// Secondary text, time marks.
pub const MUTED: RGBColor = RGBColor(0x5B, 0x65, 0x73);
/// Grid.
pub const GRID: RGBColor = RGBColor(0xE3, 0xE6, 0xEA);
/// Reference: a wide line below the line of the actual values.
pub const REFERENCE: RGBColor = RGBColor(0xB4, 0xBB, 0xC6);
/// Background.
pub const BACKGROUND: RGBColor = RGBColor(0xFF, 0xFF, 0xFF);
/// First series.
pub const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xB2);
/// Second series.
pub const VERMILION: RGBColor = RGBColor(0xD5, 0x5E, 0x00);
/// Third series.
pub const GREEN: RGBColor = RGBColor(0x00, 0x9E, 0x73);
/// Fourth series.
pub const PURPLE: RGBColor = RGBColor(0xB4, 0x5A, 0x96);
/// Fifth series.
pub const ORANGE: RGBColor = RGBColor(0xE6, 0x9F, 0x00);

/// Converts displayed pixels to drawn pixels.
pub fn px(shown: f64) -> i32 {
    (shown * f64::from(SCALE)).round() as i32
}

/// A line with a width in displayed pixels.
pub fn stroke(colour: RGBColor, width_px: f64) -> ShapeStyle {
    ShapeStyle {
        color: colour.to_rgba(),
        filled: false,
        stroke_width: px(width_px).unsigned_abs(),
    }
}

/// A filled shape.
pub fn fill(colour: RGBColor, opacity: f64) -> ShapeStyle {
    ShapeStyle {
        color: colour.mix(opacity),
        filled: true,
        stroke_width: 0,
    }
}

/// Text with a size in displayed pixels.
pub fn text(size_px: f64, colour: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    // The library writes a font size 1.24 times smaller than the requested one.
    TextStyle {
        color: colour.to_backend_color(),
        pos: Pos::new(h, v),
        ..TextStyle::from((FONT, size_px * 1.24 * f64::from(SCALE)))
    }
}
