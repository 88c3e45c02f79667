//! Adds missing joint limits to a URDF that is used only for dynamics or identification.
//!
//! A controller needs position, torque and speed limits: [`crate::Description`] rejects joints without limits.
//! Dynamics and identification need none, and many URDFs have none.

use crate::error::Reporter;
use crate::xml;
use roxmltree::Node;
use std::f64::consts::TAU;
use std::ops::Range;

/// Torque limit (N m) of a joint without limits: larger than that of any arm.
pub const UNLIMITED_NM: f64 = 1e5;
/// Speed limit (rad/s) of a joint without limits: larger than that of any arm.
pub const UNLIMITED_RAD_PER_S: f64 = 100.0;

/// Returns `urdf` with limits for every movable joint. Missing or zero limits become a range of one turn in each
/// direction, [`UNLIMITED_NM`] as effort and [`UNLIMITED_RAD_PER_S`] as velocity. Invalid or oversized XML is
/// returned unchanged; the reader reports the error.
pub fn with_default_limits(urdf: &str) -> String {
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

/// Returns the edit that adds a missing `<limit>` to a joint, or missing attributes to its `<limit>`.
fn edit(joint: &Node<'_, '_>) -> Option<(Range<usize>, String)> {
    let limit = joint.children().find(|child| child.has_tag_name("limit"));
    let stated = |name: &str| limit.and_then(|limit| limit.attribute(name));
    let mut added = String::new();
    let mut dropped = Vec::new();
    // A limit with only one end is an error and stays unchanged, so that the reader rejects it.
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
    use super::with_default_limits;

    #[test]
    fn stated_limits_stay_and_missing_ones_are_added() {
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
            assert_eq!(with_default_limits(&unchanged), unchanged);
        }
        let bare = with_default_limits(&joint("revolute", ""));
        for word in [
            "<limit",
            "lower=\"-6.28",
            "upper=\"6.28",
            "effort=\"1000",
            "velocity=\"100",
        ] {
            assert!(bare.contains(word), "{word} in {bare}");
        }
        let weak = with_default_limits(&joint(
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
        // A range with only one end is an error that the reader must report.
        let half = with_default_limits(&joint("revolute", "<limit lower=\"-1\"/>"));
        assert!(!half.contains("upper"), "{half}");
    }
}
