//! Removes from a URDF everything that is not read (extensions of other programs, unsupported shapes), so that
//! `urdf-rs` accepts the file.

use super::elements::{children, is_known, is_own};
use roxmltree::{Document, Node};

/// Returns the text without everything that neither dynamics nor drawing read. Line numbers of the remaining
/// elements change.
pub(super) fn remove_unread(document: &Document<'_>) -> String {
    let text = document.input_text();
    let robot = document.root_element();
    let mut kept = String::with_capacity(text.len());
    let mut at = 0;
    for node in children(&robot) {
        match node.tag_name().name() {
            _ if !is_own(&node) => leave_out(text, &node, &mut at, &mut kept),
            "link" => {
                for part in children(&node).filter(|part| !is_read(part)) {
                    leave_out(text, &part, &mut at, &mut kept);
                }
            }
            "joint" => {
                let unread = ["calibration", "safety_controller"];
                let known = super::elements::known_children("joint");
                let is_unread = |part: &Node<'_, '_>| {
                    unread.contains(&part.tag_name().name()) || !is_known(part, known)
                };
                for part in children(&node).filter(is_unread) {
                    leave_out(text, &part, &mut at, &mut kept);
                }
            }
            _ => leave_out(text, &node, &mut at, &mut kept),
        }
    }
    kept + &text[at..]
}

fn leave_out(text: &str, node: &Node<'_, '_>, at: &mut usize, kept: &mut String) {
    kept.push_str(&text[*at..node.range().start]);
    *at = node.range().end;
}

/// Returns whether a part of a link is read: inertial data, and shapes that can be drawn as capsules.
fn is_read(part: &Node<'_, '_>) -> bool {
    match part.tag_name().name() {
        _ if !is_own(part) => false,
        "inertial" => true,
        "visual" => children(part).any(|child| child.has_tag_name("geometry") && is_round(&child)),
        _ => false,
    }
}

fn is_round(geometry: &Node<'_, '_>) -> bool {
    let number = |shape: &Node<'_, '_>, name: &str| {
        let value = shape.attribute(name).and_then(|text| text.parse().ok());
        value.is_some_and(f64::is_finite)
    };
    let mut shapes = children(geometry);
    match (shapes.next(), shapes.next()) {
        (Some(shape), None) => match shape.tag_name().name() {
            "sphere" => number(&shape, "radius"),
            "cylinder" | "capsule" => number(&shape, "radius") && number(&shape, "length"),
            _ => false,
        },
        _ => false,
    }
}
