//! What a URDF holds besides what is read: which of it may be left out with a warning, and which may not.
//!
//! Robots are published with what other programs want beside the format: Gazebo's surfaces, transmissions,
//! `ros2_control`, `mu_coulomb`, `D` and `K` of a joint, an `<origin>` of a link. Nothing of that is read, so
//! each kind of it is a [`Finding`], once, with its first place. What would silently change the dynamics is
//! still refused:
//!
//! - anything unknown in `<inertial>` or as an attribute of `<origin>`, `<axis>`, `<mass>`, `<inertia>`, `<mimic>`,
//!   `<parent>` or `<child>`: a number under another name is a number lost;
//! - a name that dynamics are read from in a place where they are not, such as `<mass>` in `<link>`;
//! - a name within a letter or two of one of these, such as `<axes>` or `frction`, and `min` and `max` of
//!   a `<limit>`;
//! - `<loop_joint>`, which closes a chain, and elements of xacro, which stand for others.
//!
//! What has a namespace of its own is another program's, whatever it is called.

use super::{is_own, place};
use crate::error::{Finding, ModelError, Reporter};
use roxmltree::{Attribute, Node};
use std::collections::BTreeMap;

/// Elements that dynamics are read from.
const DYNAMIC: &[&str] = &[
    "link", "joint", "inertial", "origin", "mass", "inertia", "parent", "child", "axis", "limit",
    "dynamics", "mimic",
];
/// Attributes that dynamics are read from, where the element is not one of [`CLOSED`].
const DYNAMIC_ATTRIBUTES: &[&str] = &["damping", "friction"];
/// Attributes that say how far and how fast, by their names and by what they are called elsewhere.
const LIMIT_ATTRIBUTES: &[&str] = &["lower", "upper", "effort", "velocity", "min", "max"];
/// Elements in which nothing unknown is let pass.
const CLOSED: &[&str] = &[
    "inertial", "origin", "axis", "mass", "inertia", "mimic", "parent", "child",
];
/// Elements that other programs take for joints of their own.
const ALWAYS_REFUSED: &[&str] = &["loop_joint"];
/// Part of the name of xacro's namespace.
const XACRO: &str = "xacro";

/// What was left out, each kind once: first place, and how often.
#[derive(Default)]
pub(super) struct Foreign(BTreeMap<(String, String), (Finding, usize)>);

impl Foreign {
    /// Takes note of a child of `parent` that is not one of `known`.
    ///
    /// # Errors
    /// Where leaving it out would change the dynamics.
    pub fn element(
        &mut self,
        report: Reporter<'_>,
        parent: &str,
        node: &Node<'_, '_>,
        known: &[&str],
    ) -> Result<(), ModelError> {
        let name = node.tag_name().name();
        let namespace = node.tag_name().namespace();
        if namespace.is_some_and(|uri| uri.contains(XACRO)) {
            return Err(report.invalid(
                place(node),
                "an element of xacro stands for others, which would be lost",
                format!("<xacro:{name}>"),
                "expand the file first, as `xacro robot.urdf.xacro > robot.urdf` does",
            ));
        }
        let refused = is_own(node)
            && (CLOSED.contains(&parent)
                || ALWAYS_REFUSED.contains(&name)
                || (name != "origin" && meant(name, DYNAMIC).is_some()));
        if refused {
            return Err(report.invalid(
                place(node),
                format!("not an element of <{parent}>, it would be lost"),
                format!("<{name}>"),
                format!("one of {} is meant, or remove it", known.join(", ")),
            ));
        }
        self.note(report, node, (parent, format!("<{name}>")), || {
            format!("not an element of <{parent}>, it is left out")
        });
        Ok(())
    }

    /// Takes note of the attributes of a node that are not among `known`.
    ///
    /// # Errors
    /// As [`Foreign::element`].
    pub fn attributes(
        &mut self,
        report: Reporter<'_>,
        node: &Node<'_, '_>,
        known: &[&str],
    ) -> Result<(), ModelError> {
        let element = node.tag_name().name();
        let unknown = |a: &Attribute<'_, '_>| a.namespace().is_some() || !known.contains(&a.name());
        for stray in node.attributes().filter(unknown) {
            let name = stray.name();
            let refused = stray.namespace().is_none()
                && (CLOSED.contains(&element)
                    || meant(name, DYNAMIC).is_some()
                    || (element == "limit" && meant(name, LIMIT_ATTRIBUTES).is_some())
                    || meant(name, DYNAMIC_ATTRIBUTES).is_some());
            let value: String = stray.value().chars().take(60).collect();
            if refused {
                return Err(report.invalid(
                    place(node),
                    "not an attribute of this element, it would be lost",
                    format!("{name}=\"{value}\""),
                    format!("one of {} is meant, or remove it", known.join(", ")),
                ));
            }
            self.note(
                report,
                node,
                (element, format!("{name}=\"{value}\"")),
                || format!("`{name}` is not an attribute of <{element}>, it is left out"),
            );
        }
        Ok(())
    }

    fn note(
        &mut self,
        report: Reporter<'_>,
        node: &Node<'_, '_>,
        (parent, value): (&str, String),
        problem: impl Fn() -> String,
    ) {
        let kind = (
            parent.to_owned(),
            value.split('=').next().unwrap_or_default().to_owned(),
        );
        let entry = self.0.entry(kind).or_insert_with(|| {
            let finding = Finding {
                file: report.file.to_owned(),
                element: place(node),
                problem: problem(),
                value,
                remedy: "neither dynamics nor limits are read from it".to_owned(),
            };
            (finding, 0)
        });
        entry.1 += 1;
    }

    /// One finding a kind, in the order of their names.
    pub fn into_findings(self) -> Vec<Finding> {
        let findings = self.0.into_values().map(|(mut finding, count)| {
            if count > 1 {
                finding.value += &format!(" first of {count}");
            }
            finding
        });
        findings.collect()
    }
}

/// Refuses two of the children of an element that have a name that may stand once.
pub(super) fn check_once(
    report: Reporter<'_>,
    known: &[Node<'_, '_>],
    many: &[&str],
) -> Result<(), ModelError> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for child in known {
        *seen.entry(child.tag_name().name()).or_default() += 1;
    }
    for child in known {
        let parent = child.parent_element();
        let element = parent.map_or("robot", |parent| parent.tag_name().name());
        let name = child.tag_name().name();
        let count = seen.get(name).copied().unwrap_or_default();
        if count > 1 && !many.contains(&name) {
            return Err(report.invalid(
                place(child),
                format!("<{element}> takes one <{name}>"),
                count,
                "keep one of them",
            ));
        }
    }
    Ok(())
}

/// The word that is meant by `name`: itself, or one that differs by a letter, by two where it is long.
fn meant<'a>(name: &str, words: &[&'a str]) -> Option<&'a str> {
    let name = name.to_ascii_lowercase();
    let near = |word: &&&str| distance(&name, word) <= if word.len() > 5 { 2 } else { 1 };
    words.iter().find(near).copied()
}

/// Letters to insert, delete or replace between two words (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    // A word that is much longer is another.
    if a.len() > b.len() + 2 {
        return usize::MAX;
    }
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{DYNAMIC, DYNAMIC_ATTRIBUTES, meant};

    #[test]
    fn slips_of_the_pen_are_told_from_other_words() {
        for (slip, word) in [
            ("axes", "axis"),
            ("orgin", "origin"),
            ("Origin", "origin"),
            ("inertal", "inertial"),
            ("limits", "limit"),
            ("dinamics", "dynamics"),
            ("axis", "axis"),
        ] {
            assert_eq!(meant(slip, DYNAMIC), Some(word), "{slip}");
        }
        assert_eq!(meant("dampng", DYNAMIC_ATTRIBUTES), Some("damping"));
        for other in [
            "gazebo",
            "transmission",
            "ros2_control",
            "material",
            "sensor",
            "self_collide",
            "selfCollide",
            "hardware",
            "mu_coulomb",
            "mu_viscous",
            "D",
            "K",
            "axis_of_gripper",
        ] {
            let all = [DYNAMIC, DYNAMIC_ATTRIBUTES].concat();
            assert_eq!(meant(other, &all), None, "{other}");
        }
    }
}
