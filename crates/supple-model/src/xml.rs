//! Checks a URDF before `urdf-rs` parses it.
//!
//! `urdf-rs` drops unknown elements and attributes, drops words of a vector that are not numbers, and fills
//! missing data with zeros: a misspelt `<inertial>` becomes a massless link, a missing `<limit>` a joint that
//! must not move. This module checks the raw XML against the format first. Extensions of other programs are
//! listed, see [`ignored`].

pub(crate) mod bounds;
mod elements;
mod ignored;
mod prefixes;
mod remove_unread;

use elements::{ELEMENT_RULES, children, is_known, is_own, known_children, place};

use crate::error::{Finding, ModelError, Reporter};
use ignored::IgnoredElements;
pub(crate) use prefixes::declare_prefixes;
use roxmltree::Node;

/// Maximum magnitude of a length, mass or inertia, SI units: far above any arm, and no product of such numbers
/// overflows.
pub(crate) const MAX_MAGNITUDE: f64 = 1e6;

/// Numeric attributes: element, attribute, count of numbers, required.
const NUMERIC_ATTRIBUTES: &[(&str, &str, usize, bool)] = &[
    ("origin", "xyz", 3, false),
    ("origin", "rpy", 3, false),
    ("origin", "quat_xyzw", 4, false),
    ("axis", "xyz", 3, true),
    ("mass", "value", 1, true),
    ("inertia", "ixx", 1, true),
    ("inertia", "ixy", 1, true),
    ("inertia", "ixz", 1, true),
    ("inertia", "iyy", 1, true),
    ("inertia", "iyz", 1, true),
    ("inertia", "izz", 1, true),
    ("limit", "lower", 1, false),
    ("limit", "upper", 1, false),
    ("limit", "effort", 1, false),
    ("limit", "velocity", 1, true),
    ("limit", "acceleration", 1, false),
    ("limit", "deceleration", 1, false),
    ("limit", "jerk", 1, false),
    ("dynamics", "damping", 1, false),
    ("dynamics", "friction", 1, false),
];

/// Text attributes. Namespace declarations (`xmlns`) are not attributes here.
const TEXT_ATTRIBUTES: &[(&str, &[&str])] = &[
    ("robot", &["name", "version"]),
    ("link", &["name"]),
    ("joint", &["name", "type"]),
    ("inertial", &[]),
    ("parent", &["link"]),
    ("child", &["link"]),
    ("mimic", &["joint", "multiplier", "offset"]),
    ("visual", &["name"]),
    ("collision", &["name"]),
];

/// A URDF that was checked against the format.
#[derive(Debug)]
pub(crate) struct Checked {
    /// Ignored content, each kind once.
    pub warnings: Vec<Finding>,
    /// The text without the ignored content, for `urdf-rs`.
    pub text: String,
}

/// Checks the text against the format.
pub(crate) fn check(report: Reporter<'_>, text: &str) -> Result<Checked, ModelError> {
    let document = bounds::parse(report, text)?;
    let mut ignored = IgnoredElements::default();
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        return Err(report.invalid(
            place(&robot),
            "the root element must be <robot>",
            format!("<{}>", robot.tag_name().name()),
            "give a URDF (a xacro file must be expanded first)",
        ));
    }
    for kind in ["link", "joint"] {
        let mut seen = std::collections::BTreeSet::new();
        for node in children(&robot).filter(|n| is_own(n) && n.has_tag_name(kind)) {
            let name = node.attribute("name").unwrap_or_default();
            if name.is_empty() {
                return Err(report.invalid(
                    place(&node),
                    format!("a {kind} must have a name"),
                    "none",
                    "add a `name` attribute",
                ));
            }
            if !seen.insert(name) {
                return Err(report.invalid(
                    place(&node),
                    format!("{kind} names must be unique"),
                    format!("`{name}` twice"),
                    "rename one of them",
                ));
            }
            if kind == "joint" {
                check_kind(report, &node)?;
            }
            check_element(report, &node, &mut ignored)?;
        }
    }
    ignored.attributes(report, &robot, text_attributes("robot").unwrap_or_default())?;
    for node in children(&robot).filter(|n| !is_known(n, known_children("robot"))) {
        ignored.element(report, "robot", &node, known_children("robot"))?;
    }
    check_quaternions(report, &robot)?;
    Ok(Checked {
        warnings: ignored.into_findings(),
        text: remove_unread::remove_unread(&document),
    })
}

fn text_attributes(element: &str) -> Option<&'static [&'static str]> {
    let words = TEXT_ATTRIBUTES.iter().find(|(of, _)| *of == element);
    words.map(|(_, names)| *names)
}

/// Rejects `quat_xyzw` before URDF version 1.1: older readers ignore it and leave the frame unrotated.
fn check_quaternions(report: Reporter<'_>, robot: &Node<'_, '_>) -> Result<(), ModelError> {
    let version = robot.attribute("version").unwrap_or("1.0").trim();
    let number = |part: Option<&str>| part.and_then(|part| part.parse::<u32>().ok());
    let mut parts = version.split('.');
    if (number(parts.next()), number(parts.next())) >= (Some(1), Some(1)) {
        return Ok(());
    }
    let frames = |node: &Node<'_, '_>| matches!(node.tag_name().name(), "joint" | "inertial");
    let owners = children(robot).flat_map(|owner| [owner].into_iter().chain(children(&owner)));
    let origins = owners.filter(frames).flat_map(|owner| children(&owner));
    for origin in origins.filter(|node| node.has_tag_name("origin")) {
        if let Some(given) = origin.attribute("quat_xyzw") {
            return Err(report.invalid(
                place(&origin),
                "attribute `quat_xyzw` requires version 1.1 of the format, it would be lost",
                format!("\"{given}\" with <robot version=\"{version}\">"),
                "give rpy=\"...\", or <robot version=\"1.1\"> if that is what the file is",
            ));
        }
    }
    Ok(())
}

fn check_kind(report: Reporter<'_>, joint: &Node<'_, '_>) -> Result<(), ModelError> {
    const KINDS: [&str; 7] = [
        "revolute",
        "continuous",
        "fixed",
        "prismatic",
        "floating",
        "planar",
        "spherical",
    ];
    let kind = joint.attribute("type").unwrap_or("none");
    if kind == "revolute" {
        let limit = children(joint).find(|child| is_known(child, &["limit"]));
        let given = |end| limit.is_some_and(|limit| limit.has_attribute(end));
        if !(given("lower") && given("upper")) {
            return Err(report.invalid(
                format!("{} <limit>", place(joint)),
                "a revolute joint must have both ends of its range",
                limit.map_or("no <limit>", |_| "<limit> without lower or upper"),
                "add <limit lower=\"..\" upper=\"..\" effort=\"..\" velocity=\"..\"/> in rad, N m and \
                 rad/s, or make the joint continuous",
            ));
        }
    }
    if KINDS.contains(&kind) {
        return Ok(());
    }
    Err(report.invalid(
        place(joint),
        "attribute `type` must name a kind of joint",
        format!("`{kind}`"),
        "use revolute, continuous or fixed",
    ))
}

fn check_element(
    report: Reporter<'_>,
    node: &Node<'_, '_>,
    ignored: &mut IgnoredElements,
) -> Result<(), ModelError> {
    let element = node.tag_name().name();
    if let Some(known) = text_attributes(element) {
        ignored.attributes(report, node, known)?;
    }
    if let Some(rule) = ELEMENT_RULES.iter().find(|rule| rule.element == element) {
        let (known, unknown): (Vec<_>, Vec<_>) =
            children(node).partition(|child| is_known(child, rule.known));
        for child in &unknown {
            ignored.element(report, element, child, rule.known)?;
        }
        ignored::check_once(report, &known, rule.repeatable)?;
        for child in &known {
            check_element(report, child, ignored)?;
        }
        for required in rule.required {
            if !known.iter().any(|child| child.has_tag_name(*required)) {
                return Err(report.invalid(
                    place(node),
                    format!("<{required}> is missing"),
                    "none",
                    format!("add <{required}> to <{element}>"),
                ));
            }
        }
        return Ok(());
    }
    if matches!(element, "parent" | "child") && node.attribute("link").is_none() {
        return Err(report.invalid(
            place(node),
            "attribute `link` is missing",
            "none",
            "add link=\"...\"",
        ));
    }
    if matches!(element, "visual" | "collision") {
        let mut origins = children(node).filter(|child| child.has_tag_name("origin"));
        return origins.try_for_each(|origin| check_element(report, &origin, ignored));
    }
    check_numbers(report, node, ignored)
}

fn check_numbers(
    report: Reporter<'_>,
    node: &Node<'_, '_>,
    ignored: &mut IgnoredElements,
) -> Result<(), ModelError> {
    let element = node.tag_name().name();
    let mut known = NUMERIC_ATTRIBUTES
        .iter()
        .filter(|(e, ..)| *e == element)
        .peekable();
    if known.peek().is_none() {
        return Ok(());
    }
    let names: Vec<&str> = known.clone().map(|(_, name, ..)| *name).collect();
    ignored.attributes(report, node, &names)?;
    for (_, name, count, required) in known {
        let Some(text) = node.attribute(*name) else {
            if *required {
                return Err(report.invalid(
                    place(node),
                    format!("attribute `{name}` is missing"),
                    "none",
                    format!("add {name}=\"...\""),
                ));
            }
            continue;
        };
        let words: Vec<&str> = text.split_whitespace().collect();
        // No upper bound for limits: some files use huge values for "unlimited".
        let max = match element {
            "limit" => f64::MAX,
            _ => MAX_MAGNITUDE,
        };
        let valid = |word: &&str| word.parse::<f64>().is_ok_and(|x| x.abs() <= max);
        if words.len() != *count || !words.iter().all(valid) {
            return Err(report.invalid(
                place(node),
                format!("attribute `{name}` takes {count} number(s) of at most {max:e}"),
                format!("\"{text}\""),
                "correct it (SI units; NaN, infinity and unit names are not allowed)",
            ));
        }
    }
    Ok(())
}
