//! An arm from a URDF alone: `robot.urdf`, or `robot.urdf#LINK` with the link that is the tip.

use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::urdf_name::UrdfName;
use crate::xml;
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml_edit::{DocumentMut, value};

impl Description {
    /// Reads an arm from a URDF alone. Its TOML gives name, URDF and tip only, see [`Description::completed`]. Without a tip
    /// it is the end of the chain with the most movable joints.
    ///
    /// # Errors
    /// [`ModelError`] if the file cannot be read or is invalid, or if several chains are equally long.
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
        let tip = match &name.tip {
            Some(tip) => tip.clone(),
            None => longest_chain(report, &urdf)?,
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
        Self::from_named_text(&toml.to_string(), &name.path, &urdf)
    }
}

/// The last link of the chain with the most movable joints.
fn longest_chain(report: Reporter<'_>, urdf: &str) -> Result<String, ModelError> {
    let document = xml::bounds::parse(report, urdf)?;
    let joints: Vec<Node<'_, '_>> = document
        .root_element()
        .children()
        .filter(|node| node.has_tag_name("joint"))
        .collect();
    let link_of = |joint: &Node<'_, '_>, role: &str| {
        let end = joint.children().find(|child| child.has_tag_name(role));
        end.and_then(|end| end.attribute("link").map(str::to_owned))
    };
    // Parent link and number of movable joints of each child link.
    let mut parent: BTreeMap<String, (String, usize)> = BTreeMap::new();
    for joint in &joints {
        let is_mimic = joint.children().any(|child| child.has_tag_name("mimic"));
        let moves = matches!(joint.attribute("type"), Some("revolute" | "continuous")) && !is_mimic;
        if let (Some(from), Some(to)) = (link_of(joint, "parent"), link_of(joint, "child")) {
            parent.insert(to, (from, usize::from(moves)));
        }
    }
    let parents: BTreeSet<&String> = parent.values().map(|(link, _)| link).collect();
    let length = |link: &String| {
        let (mut link, mut moving) = (link, 0);
        // A cycle is reported later.
        for _ in 0..parent.len() {
            let Some((next, movable)) = parent.get(link) else {
                break;
            };
            moving += movable;
            link = next;
        }
        moving
    };
    let ends: Vec<(usize, &String)> = parent
        .keys()
        .filter(|link| !parents.contains(link))
        .map(|link| (length(link), link))
        .collect();
    let longest = ends.iter().map(|(length, _)| *length).max().unwrap_or(0);
    let longest: Vec<&String> = ends
        .iter()
        .filter(|(length, _)| *length == longest)
        .map(|(_, link)| *link)
        .collect();
    match longest.as_slice() {
        [link] => Ok((*link).clone()),
        links => {
            let names: Vec<&str> = links.iter().map(|link| link.as_str()).collect();
            Err(report.invalid(
                "the tip",
                "which link is the tip must be said: several chains are equally long",
                names.join(", "),
                "give --tip LINK (or FILE.urdf#LINK), one of these or another link",
            ))
        }
    }
}
