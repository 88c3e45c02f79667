//! An arm from a URDF alone: `robot.urdf`, or `robot.urdf#LINK` with the link that is the tip.

use crate::description::Description;
use crate::error::{Finding, ModelError, Reporter};
use crate::urdf_name::UrdfName;
use crate::xml;
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml_edit::{DocumentMut, value};

impl Description {
    /// Reads an arm from a URDF alone. Its TOML contains only name, URDF and tip, see [`Description::completed`]. Without a given
    /// tip, the tip is the end of the chain with the most movable joints. A warning names this link, because it may be a finger.
    ///
    /// # Errors
    /// [`ModelError`] if the file cannot be read or is invalid, if it has no movable joint, or if several chains are equally
    /// long.
    pub fn from_urdf(name: &UrdfName) -> Result<Self, ModelError> {
        let path = Path::new(&name.path);
        let urdf = crate::description::read(path, "give the path of a URDF")?;
        let report = Reporter { file: &name.path };
        if name.path.to_ascii_lowercase().ends_with(".xacro") {
            return Err(report.invalid(
                "the file",
                "a xacro file must be expanded first",
                "a xacro file",
                format!(
                    "run `xacro {} > robot.urdf`, with its arguments as name:=value (without ROS: `pip install xacro`), and give \
                     robot.urdf",
                    name.path
                ),
            ));
        }
        let (tip, tip_warning) = match &name.tip {
            Some(tip) => (tip.clone(), None),
            None => {
                let end = ChainEnd::of_longest_chain(report, &urdf)?;
                let warning = end.warning(report);
                (end.tip, Some(warning))
            }
        };
        let stem = path.file_stem().map(|stem| stem.to_string_lossy());
        let file_name = path.file_name().map(|name| name.to_string_lossy());
        let mut toml = DocumentMut::new();
        toml["name"] = value(stem.as_deref().unwrap_or("arm"));
        toml["urdf"] = value(file_name.as_deref().unwrap_or("arm.urdf"));
        toml["tip_frame"] = value(tip.as_str());
        if name.repair {
            toml["repair_inertia"] = value(true);
        }
        let mut description = Self::from_named_text(&toml.to_string(), &name.path, &urdf)?;
        description.warnings.extend(tip_warning);
        Ok(description)
    }
}

/// End of the chain with the most movable joints.
struct ChainEnd {
    /// Last link of the chain.
    tip: String,
    /// Last movable joint of the chain.
    last_joint: String,
    /// Parent link of this joint.
    link_before: String,
}

/// The joint that moves a given link.
struct ParentJoint<'a> {
    joint: &'a str,
    link: &'a str,
    moves: bool,
}

impl ChainEnd {
    fn of_longest_chain(report: Reporter<'_>, urdf: &str) -> Result<Self, ModelError> {
        let document = xml::bounds::parse(report, urdf)?;
        let root = document.root_element();
        let joints: Vec<Node<'_, '_>> = root
            .children()
            .filter(|node| node.has_tag_name("joint"))
            .collect();
        let mut parents: BTreeMap<&str, ParentJoint<'_>> = BTreeMap::new();
        for joint in &joints {
            if let (Some(link), Some(child)) = (link_of(joint, "parent"), link_of(joint, "child")) {
                let parent = ParentJoint {
                    joint: joint.attribute("name").unwrap_or_default(),
                    link,
                    moves: moves(joint),
                };
                parents.insert(child, parent);
            }
        }
        let with_children: BTreeSet<&str> = parents.values().map(|parent| parent.link).collect();
        let movable = |end: &str| {
            let mut moving = Vec::new();
            let mut link = end;
            // A cycle is reported later.
            for _ in 0..parents.len() {
                let Some(parent) = parents.get(link) else {
                    break;
                };
                moving.extend(parent.moves.then_some(parent));
                link = parent.link;
            }
            moving
        };
        let ends: Vec<(&str, Vec<&ParentJoint<'_>>)> = parents
            .keys()
            .filter(|link| !with_children.contains(*link))
            .map(|link| (*link, movable(link)))
            .collect();
        let length = ends.iter().map(|(_, moving)| moving.len()).max();
        let longest = ends
            .iter()
            .filter(|(_, moving)| Some(moving.len()) == length);
        let longest: Vec<&(&str, Vec<&ParentJoint<'_>>)> = longest.collect();
        match longest.as_slice() {
            [] => Err(no_chain(report, &root, &joints)),
            [(_, moving), ..] if moving.is_empty() => Err(no_chain(report, &root, &joints)),
            [(tip, moving)] => Ok(ChainEnd {
                tip: (*tip).to_owned(),
                last_joint: moving[0].joint.to_owned(),
                link_before: moving[0].link.to_owned(),
            }),
            links => {
                let names: Vec<&str> = links.iter().map(|(link, _)| *link).collect();
                Err(report.invalid(
                    "the tip",
                    "which link is the tip must be said: several chains are equally long",
                    names.join(", "),
                    "give --tip LINK (or FILE.urdf#LINK), one of these or another link",
                ))
            }
        }
    }

    /// Returns the warning that names the chosen link, because a URDF does not state whether the last joint belongs to the arm or
    /// to a gripper.
    fn warning(&self, report: Reporter<'_>) -> Finding {
        Finding {
            file: report.file.to_owned(),
            element: "the tip".to_owned(),
            problem: "no link is named as the tip, it is the end of the longest chain".to_owned(),
            value: format!("`{}`, beyond joint `{}`", self.tip, self.last_joint),
            remedy: format!(
                "if that joint belongs to a gripper, give the link before it, --tip {}; to confirm, --tip {}",
                self.link_before, self.tip
            ),
        }
    }
}

/// Returns the link that a joint names as its parent or child.
fn link_of<'a>(joint: &Node<'a, '_>, role: &str) -> Option<&'a str> {
    let mut ends = joint.children();
    ends.find(|child| child.has_tag_name(role))?
        .attribute("link")
}

fn moves(joint: &Node<'_, '_>) -> bool {
    let is_mimic = joint.children().any(|child| child.has_tag_name("mimic"));
    matches!(joint.attribute("type"), Some("revolute" | "continuous")) && !is_mimic
}

/// Returns the error of a file without an arm; the error's value is the content of the file.
fn no_chain(report: Reporter<'_>, root: &Node<'_, '_>, joints: &[Node<'_, '_>]) -> ModelError {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for joint in joints {
        *kinds
            .entry(joint.attribute("type").unwrap_or("untyped"))
            .or_default() += 1;
    }
    let kinds = kinds.iter().map(|(kind, count)| format!("{count} {kind}"));
    let found = match joints.len() {
        0 => format!("<{}> without any <joint>", root.tag_name().name()),
        _ => format!("joints: {}", kinds.collect::<Vec<_>>().join(", ")),
    };
    report.invalid(
        "the chain",
        "an arm needs 3 to 7 revolute or continuous joints in a row, each with <parent> and <child>, and no chain here has one",
        found,
        "give the URDF of an arm; that of a part or of a scene has no chain, and a xacro file must be expanded first",
    )
}
