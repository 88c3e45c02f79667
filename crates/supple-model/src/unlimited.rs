//! A URDF of which dynamics alone are wanted, with the limits that it does not state.
//!
//! A controller must know where an arm ends and what it bears: [`crate::Description`] refuses joints
//! without limits. Dynamics and identification ask for none, and many URDFs have none.

use crate::error::Reporter;
use crate::xml;
use roxmltree::Node;
use std::f64::consts::TAU;
use std::ops::Range;

/// Torque (N m) of a joint that has no limits: beyond any arm's.
pub const UNLIMITED_NM: f64 = 1e5;
/// Speed (rad/s) of a joint that has no limits: beyond any arm's.
pub const UNLIMITED_RAD_PER_S: f64 = 100.0;

/// `urdf` in which every movable joint has limits: where it states none, or zero, a range of a turn either
/// way, [`UNLIMITED_NM`] as effort and [`UNLIMITED_RAD_PER_S`] as velocity. A text that is no XML, or out of all
/// proportion, is given back as it is: whoever reads it says why.
pub fn with_limits(urdf: &str) -> String {
    let Ok(document) = xml::bounds::parse(Reporter { file: "" }, urdf) else {
        return urdf.to_owned();
    };
    let movable = |node: &Node<'_, '_>| {
        node.has_tag_name("joint")
            && matches!(node.attribute("type"), Some("revolute" | "continuous"))
    };
    let joints = document.root_element().children().filter(movable);
    let mut edits: Vec<(Range<usize>, String)> = joints.filter_map(|joint| edit(&joint)).collect();
    edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut edited = urdf.to_owned();
    for (range, text) in edits {
        edited.replace_range(range, &text);
    }
    edited
}

/// The `<limit>` that a joint lacks, or with what it lacks.
fn edit(joint: &Node<'_, '_>) -> Option<(Range<usize>, String)> {
    let limit = joint.children().find(|child| child.has_tag_name("limit"));
    let stated = |name: &str| limit.and_then(|limit| limit.attribute(name));
    let mut added = String::new();
    let mut dropped = Vec::new();
    // One end alone is a mistake, and refused as such.
    if stated("lower").is_none() && stated("upper").is_none() {
        added += &format!(" lower=\"{:?}\" upper=\"{TAU:?}\"", -TAU);
    }
    for (name, unlimited) in [("effort", UNLIMITED_NM), ("velocity", UNLIMITED_RAD_PER_S)] {
        let zero = |text: &str| text.trim().parse::<f64>().is_ok_and(|value| value == 0.0);
        if stated(name).is_none_or(zero) {
            added += &format!(" {name}=\"{unlimited:?}\"");
            dropped.push(name);
        }
    }
    if added.is_empty() {
        return None;
    }
    let kept: String = limit
        .iter()
        .flat_map(Node::attributes)
        .filter(|attribute| !dropped.contains(&attribute.name()))
        .map(|attribute| format!(" {}=\"{}\"", attribute.name(), attribute.value()))
        .collect();
    let text = format!("<limit{kept}{added}/>");
    match limit {
        Some(limit) => Some((limit.range(), text)),
        None => {
            let start = joint.first_child()?.range().start;
            Some((start..start, text))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::with_limits;

    #[test]
    fn what_is_stated_stays_and_what_is_not_is_added() {
        let joint = |kind: &str, limit: &str| {
            format!(
                "<robot><joint name=\"j\" type=\"{kind}\"><parent link=\"a\"/>{limit}</joint></robot>"
            )
        };
        let whole = "<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"4\"/>";
        for unchanged in [
            joint("revolute", whole),
            joint("fixed", ""),
            "<robot".to_owned(),
        ] {
            assert_eq!(with_limits(&unchanged), unchanged);
        }
        let bare = with_limits(&joint("revolute", ""));
        for word in [
            "<limit",
            "lower=\"-6.28",
            "upper=\"6.28",
            "effort=\"1000",
            "velocity=\"100",
        ] {
            assert!(bare.contains(word), "{word} in {bare}");
        }
        let weak = with_limits(&joint(
            "revolute",
            "<limit lower=\"-1\" upper=\"2\" effort=\"0\" velocity=\"4\"/>",
        ));
        for word in [
            "lower=\"-1\"",
            "upper=\"2\"",
            "velocity=\"4\"",
            "effort=\"100000.0\"",
        ] {
            assert!(weak.contains(word), "{word} in {weak}");
        }
        assert_eq!(weak.matches("effort").count(), 1);
        // Half a range is a mistake that someone must see.
        let half = with_limits(&joint("revolute", "<limit lower=\"-1\"/>"));
        assert!(!half.contains("upper"), "{half}");
    }
}
