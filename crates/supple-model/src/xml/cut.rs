//! A URDF without what is not read, for `urdf-rs`: what other programs add, and shapes that it cannot read,
//! are no reason to refuse an arm.

use super::{children, is_known, is_own};
use roxmltree::{Document, Node};

/// The text without everything from which neither dynamics nor a drawing are read. Places of what stays move.
pub(super) fn cut(document: &Document<'_>) -> String {
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
                let known = super::of("joint");
                let cut = |part: &Node<'_, '_>| {
                    unread.contains(&part.tag_name().name()) || !is_known(part, known)
                };
                for part in children(&node).filter(cut) {
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

/// Masses, and shapes that can be drawn as capsules.
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
