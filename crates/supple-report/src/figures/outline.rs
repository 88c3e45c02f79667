//! Converts text of an SVG to outlines of an embedded font, so that a bitmap does not depend on installed fonts. This module
//! only places glyphs side by side, because a text layout library would take longer to compile than all other drawing code.

use resvg::usvg::roxmltree::{Document, Node};
use std::fmt::Write as _;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// Replaces each `<text>` by a `<path>` of glyphs side by side, without kerning. A character that the font lacks becomes a
/// box.
///
/// # Errors
/// The problem of the document, as text.
pub fn outline_text(svg: &str) -> Result<String, String> {
    let face = Face::parse(dejavu::sans::regular(), 0).map_err(|error| error.to_string())?;
    let document = Document::parse(svg).map_err(|error| error.to_string())?;
    let texts = document
        .descendants()
        .filter(|node| node.is_element() && node.tag_name().name() == "text");
    let mut outlined = String::new();
    let mut copied = 0;
    for node in texts {
        let range = node.range();
        outlined.push_str(&svg[copied..range.start]);
        outlined.push_str(&outline(&face, node)?);
        copied = range.end;
    }
    outlined.push_str(&svg[copied..]);
    Ok(outlined)
}

/// Converts one text to a path.
fn outline(face: &Face<'_>, node: Node<'_, '_>) -> Result<String, String> {
    let attribute = |name| {
        node.attribute(name)
            .ok_or_else(|| format!("a text without {name}"))
    };
    let number = |name: &str, text: &str| {
        text.parse::<f64>()
            .map_err(|_| format!("{name} = {text:?} of a text is no number"))
    };
    let size = number("font-size", attribute("font-size")?)?;
    let x = number("x", attribute("x")?)?;
    let y = number("y", attribute("y")?)? + offset(attribute("dy")?, size)?;

    let mut glyphs = Glyphs::default();
    for character in node.text().unwrap_or_default().trim().chars() {
        let glyph = face.glyph_index(character).unwrap_or(GlyphId(0));
        face.outline_glyph(glyph, &mut glyphs);
        glyphs.pen += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
    }
    let start = match attribute("text-anchor")? {
        "start" => 0.0,
        "middle" => -0.5 * glyphs.pen,
        "end" => -glyphs.pen,
        other => return Err(format!("text-anchor = {other:?} of a text")),
    };
    let scale = size / f64::from(face.units_per_em());
    Ok(format!(
        "<path transform=\"{} translate({x} {y}) scale({scale} {}) translate({start} 0)\" fill=\"{}\" \
         opacity=\"{}\" d=\"{}\"/>",
        node.attribute("transform").unwrap_or(""),
        -scale,
        attribute("fill")?,
        node.attribute("opacity").unwrap_or("1"),
        glyphs.path
    ))
}

/// Returns the shift of the base line; an ex is half the font size.
fn offset(dy: &str, size: f64) -> Result<f64, String> {
    let units = [("em", 1.0), ("ex", 0.5)];
    units
        .iter()
        .find_map(|(unit, ems)| {
            let count: f64 = dy.strip_suffix(unit)?.parse().ok()?;
            Some(count * ems * size)
        })
        .ok_or_else(|| format!("dy = {dy:?} of a text has neither em nor ex"))
}

/// Outlines in units of the font, y upwards.
#[derive(Default)]
struct Glyphs {
    /// Position of the next glyph.
    pen: f64,
    path: String,
}

impl Glyphs {
    fn command(&mut self, name: char, points: &[(f32, f32)]) {
        self.path.push(name);
        for &(x, y) in points {
            // Writing to a string does not fail.
            let _ = write!(self.path, " {} {y}", self.pen + f64::from(x));
        }
    }
}

impl OutlineBuilder for Glyphs {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('M', &[(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('L', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('Q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('C', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.command('Z', &[]);
    }
}

#[cfg(test)]
mod tests {
    use super::outline_text;
    use resvg::usvg::{Node, Options, Rect, Tree};

    fn bounds(attributes: &str, text: &str) -> Rect {
        let svg = format!(
            "<svg width=\"100\" height=\"100\" xmlns=\"http://www.w3.org/2000/svg\">\n<text font-size=\"10\" \
             fill=\"#000000\" {attributes}>\n{text}\n</text>\n</svg>"
        );
        let outlined = outline_text(&svg).expect("the text can be outlined");
        assert!(!outlined.contains("<text"), "{outlined}");
        let tree = Tree::from_str(&outlined, &Options::default()).expect("an SVG");
        let Some(Node::Group(group)) = tree.root().children().first() else {
            let Some(Node::Path(path)) = tree.root().children().first() else {
                panic!("{outlined}");
            };
            return path.abs_bounding_box();
        };
        group.abs_bounding_box()
    }

    #[test]
    fn text_is_placed_according_to_its_anchor() {
        let at = |anchor: &str| {
            bounds(
                &format!("x=\"50\" y=\"60\" dy=\"0.5ex\" text-anchor=\"{anchor}\""),
                "HoH",
            )
        };
        let [start, middle, end] = ["start", "middle", "end"].map(at);
        assert!((start.left() - 50.0).abs() < 1.5, "{start:?}");
        assert!(
            ((middle.left() + middle.right()) / 2.0 - 50.0).abs() < 0.1,
            "{middle:?}"
        );
        assert!((end.right() - 50.0).abs() < 1.5, "{end:?}");
        // Half an ex below: a quarter of the size of the font.
        assert!((middle.bottom() - 62.5).abs() < 0.3, "{middle:?}");
        // A capital of this font is 0.73 em high.
        assert!((middle.height() - 7.3).abs() < 0.4, "{middle:?}");
    }

    #[test]
    fn a_rotated_text_runs_upwards() {
        let upright = bounds(
            "x=\"50\" y=\"60\" dy=\"0em\" text-anchor=\"start\"",
            "force",
        );
        let turned = bounds(
            "x=\"50\" y=\"60\" dy=\"0em\" text-anchor=\"start\" transform=\"rotate(270, 50, 60)\"",
            "force",
        );
        assert!(
            (upright.width() - turned.height()).abs() < 1e-3,
            "{turned:?}"
        );
        assert!(turned.bottom() <= 60.0, "{turned:?}");
    }

    #[test]
    fn a_character_that_the_font_lacks_becomes_a_box() {
        let at = "x=\"50\" y=\"60\" dy=\"0em\" text-anchor=\"start\"";
        let shown = bounds(at, "\u{10FFFF}");
        assert!(shown.width() > 3.0 && shown.height() > 5.0, "{shown:?}");
    }

    #[test]
    fn the_error_names_the_invalid_attribute() {
        let error = |attributes: &str, text: &str| {
            outline_text(&format!("<svg><text {attributes}>{text}</text></svg>"))
                .expect_err("an error")
        };
        assert_eq!(error("", "a"), "a text without font-size");
        let whole =
            "font-size=\"1\" x=\"0\" y=\"0\" dy=\"1em\" text-anchor=\"start\" fill=\"#000\"";
        assert_eq!(
            error(&whole.replace("1em", "1"), "a"),
            "dy = \"1\" of a text has neither em nor ex"
        );
    }
}
