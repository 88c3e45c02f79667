//! Elements of the format: which ones there are, their children, and their place in messages.

use roxmltree::Node;

/// Children that an element may have, those that it must have, and those that may occur more than once.
pub(super) struct ElementRule {
    pub(super) element: &'static str,
    pub(super) known: &'static [&'static str],
    pub(super) required: &'static [&'static str],
    pub(super) repeatable: &'static [&'static str],
}

pub(super) const ELEMENT_RULES: &[ElementRule] = &[
    ElementRule {
        element: "robot",
        known: &["link", "joint", "material"],
        required: &[],
        repeatable: &["link", "joint", "material"],
    },
    ElementRule {
        element: "link",
        known: &["inertial", "visual", "collision", "contact"],
        required: &[],
        repeatable: &["visual", "collision"],
    },
    ElementRule {
        element: "inertial",
        known: &["origin", "mass", "inertia"],
        required: &["mass", "inertia"],
        repeatable: &[],
    },
    ElementRule {
        element: "joint",
        known: &[
            "origin",
            "parent",
            "child",
            "axis",
            "calibration",
            "dynamics",
            "limit",
            "mimic",
            "safety_controller",
        ],
        required: &["parent", "child"],
        repeatable: &[],
    },
];

/// Returns the names of the known children of an element.
pub(super) fn known_children(element: &str) -> &'static [&'static str] {
    let rule = ELEMENT_RULES.iter().find(|rule| rule.element == element);
    rule.map_or(&[], |rule| rule.known)
}

/// Returns whether the element belongs to the format, not to another program: its namespace is that of the root.
pub(super) fn is_own(node: &Node<'_, '_>) -> bool {
    node.tag_name().namespace() == node.document().root_element().tag_name().namespace()
}

pub(super) fn is_known(node: &Node<'_, '_>, names: &[&str]) -> bool {
    is_own(node) && names.contains(&node.tag_name().name())
}

pub(super) fn children<'a, 'input>(
    node: &Node<'a, 'input>,
) -> impl Iterator<Item = Node<'a, 'input>> + use<'a, 'input> {
    node.children().filter(Node::is_element)
}

/// Returns text such as ``joint `elbow` <limit> (line 12)``.
pub(super) fn place(node: &Node<'_, '_>) -> String {
    let owner = node
        .ancestors()
        .find(|n| n.has_tag_name("link") || n.has_tag_name("joint"))
        .filter(|owner| owner.attribute("name").is_some());
    let line = node.document().text_pos_at(node.range().start).row;
    let tag = node.tag_name().name();
    match owner {
        Some(owner) => {
            let kind = owner.tag_name().name();
            let name = owner.attribute("name").unwrap_or_default();
            if owner.id() == node.id() {
                format!("{kind} `{name}` (line {line})")
            } else {
                format!("{kind} `{name}` <{tag}> (line {line})")
            }
        }
        None => format!("<{tag}> (line {line})"),
    }
}
