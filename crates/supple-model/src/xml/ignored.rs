//! Unknown URDF content: which of it is ignored with a warning, and which is rejected.
//!
//! Published URDFs contain extensions of other programs: Gazebo's surfaces, transmissions, `ros2_control`,
//! `mu_coulomb`, `D` and `K` of a joint, an `<origin>` of a link. They are not read; each kind is reported as one
//! [`Finding`] with its first occurrence. Content that would silently change the dynamics is rejected:
//!
//! - anything unknown in `<inertial>` or as an attribute of `<origin>`, `<axis>`, `<mass>`, `<inertia>`, `<mimic>`,
//!   `<parent>` or `<child>`: a misnamed number would be lost;
//! - a name of the dynamics in the wrong parent, such as `<mass>` in `<link>`;
//! - a name that differs from one of these by a letter or two, such as `<axes>` or `frction`, and `min` and `max`
//!   of a `<limit>`;
//! - `<loop_joint>`, which closes a chain, and elements of xacro, which are macros for other elements.
//!
//! Elements with their own XML namespace belong to other programs and are always ignored.

use super::elements::{is_own, place};
use crate::error::{Finding, ModelError, Reporter};
use roxmltree::{Attribute, Node};
use std::collections::BTreeMap;

/// Elements with dynamics data.
const DYNAMICS_ELEMENTS: &[&str] = &[
    "link", "joint", "inertial", "origin", "mass", "inertia", "parent", "child", "axis", "limit",
    "dynamics", "mimic",
];
/// Attributes with dynamics data in elements other than [`STRICT_ELEMENTS`].
const DYNAMIC_ATTRIBUTES: &[&str] = &["damping", "friction"];
/// Attributes of joint limits, with the names that other programs use for them.
const LIMIT_ATTRIBUTES: &[&str] = &["lower", "upper", "effort", "velocity", "min", "max"];
/// Elements in which unknown content is rejected.
const STRICT_ELEMENTS: &[&str] = &[
    "inertial", "origin", "axis", "mass", "inertia", "mimic", "parent", "child",
];
/// Elements that other programs read as additional joints.
const ALWAYS_REJECTED: &[&str] = &["loop_joint"];
/// Part of the xacro namespace URI.
const XACRO: &str = "xacro";

/// Ignored content, each kind once: first occurrence and count.
#[derive(Default)]
pub(super) struct IgnoredElements(BTreeMap<(String, String), (Finding, usize)>);

impl IgnoredElements {
    /// Records a child of `parent` that is not one of `known`.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] if ignoring the child would change the dynamics.
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
                "an element of xacro is a macro, its content would be lost",
                format!("<xacro:{name}>"),
                "expand the file first, as `xacro robot.urdf.xacro > robot.urdf` does (without ROS: `pip install xacro`)",
            ));
        }
        let rejected = is_own(node)
            && (STRICT_ELEMENTS.contains(&parent)
                || ALWAYS_REJECTED.contains(&name)
                || (name != "origin" && closest_known_name(name, DYNAMICS_ELEMENTS).is_some()));
        if rejected {
            return Err(report.invalid(
                place(node),
                format!("unknown element in <{parent}>, its data would be lost"),
                format!("<{name}>"),
                format!("use one of {}, or remove it", known.join(", ")),
            ));
        }
        self.note(report, node, (parent, format!("<{name}>")), || {
            format!("unknown element in <{parent}>, it is ignored")
        });
        Ok(())
    }

    /// Records the attributes of a node that are not among `known`.
    ///
    /// # Errors
    /// As [`IgnoredElements::element`].
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
            let rejected = stray.namespace().is_none()
                && (STRICT_ELEMENTS.contains(&element)
                    || closest_known_name(name, DYNAMICS_ELEMENTS).is_some()
                    || (element == "limit"
                        && closest_known_name(name, LIMIT_ATTRIBUTES).is_some())
                    || closest_known_name(name, DYNAMIC_ATTRIBUTES).is_some());
            let value: String = stray.value().chars().take(60).collect();
            if rejected {
                return Err(report.invalid(
                    place(node),
                    "unknown attribute of this element, its value would be lost",
                    format!("{name}=\"{value}\""),
                    format!("use one of {}, or remove it", known.join(", ")),
                ));
            }
            self.note(
                report,
                node,
                (element, format!("{name}=\"{value}\"")),
                || format!("unknown attribute `{name}` of <{element}>, it is ignored"),
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

    /// Returns one finding per kind, sorted by name.
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

/// Rejects repeated children of an element that may occur only once.
pub(super) fn check_once(
    report: Reporter<'_>,
    known: &[Node<'_, '_>],
    repeatable: &[&str],
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
        if count > 1 && !repeatable.contains(&name) {
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

/// Returns the word in `words` closest to `name`: equal, or different by one letter, or by two in words of more than five.
fn closest_known_name<'a>(name: &str, words: &[&'a str]) -> Option<&'a str> {
    let name = name.to_ascii_lowercase();
    let near = |word: &&&str| distance(&name, word) <= if word.len() > 5 { 2 } else { 1 };
    words.iter().find(near).copied()
}

/// Returns the Levenshtein distance between two words.
fn distance(a: &str, b: &str) -> usize {
    // Words of very different length cannot be typos of each other.
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
    use super::{DYNAMIC_ATTRIBUTES, DYNAMICS_ELEMENTS, closest_known_name};

    #[test]
    fn typos_are_distinguished_from_unknown_words() {
        for (slip, word) in [
            ("axes", "axis"),
            ("orgin", "origin"),
            ("Origin", "origin"),
            ("inertal", "inertial"),
            ("limits", "limit"),
            ("dinamics", "dynamics"),
            ("axis", "axis"),
        ] {
            assert_eq!(
                closest_known_name(slip, DYNAMICS_ELEMENTS),
                Some(word),
                "{slip}"
            );
        }
        assert_eq!(
            closest_known_name("dampng", DYNAMIC_ATTRIBUTES),
            Some("damping")
        );
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
            let all = [DYNAMICS_ELEMENTS, DYNAMIC_ATTRIBUTES].concat();
            assert_eq!(closest_known_name(other, &all), None, "{other}");
        }
    }
}
