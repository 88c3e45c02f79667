//! Size limits of a URDF, which bound the processing time: a few megabytes can contain nesting deeper than the
//! stack allows, or tens of thousands of links.

use super::elements::{children, place};
use crate::error::{ModelError, Reporter};
use roxmltree::{Document, Node, ParsingOptions};

/// Maximum number of XML nodes, text nodes included: a hundred times as many as in the URDF of a humanoid.
const MAX_NODES: u32 = 500_000;
/// Maximum nesting depth; published URDFs have about ten levels.
const MAX_DEPTH: usize = 64;
/// Maximum number of attributes of one element: to find duplicates, the parser compares every pair.
const MAX_ATTRIBUTES: usize = 256;
/// Maximum number of links, and likewise of joints.
const MAX_LINKS: usize = 1000;

const REMEDY: &str =
    "give a URDF of the arm only, without elements of other programs such as <gazebo>";

/// Parses a text within the size limits.
pub(crate) fn parse<'a>(report: Reporter<'_>, text: &'a str) -> Result<Document<'a>, ModelError> {
    check_attributes(report, text)?;
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options);
    let document = document.map_err(|error| match error {
        roxmltree::Error::NodesLimitReached => report.invalid(
            "<robot>",
            format!("may have at most {MAX_NODES} elements and texts"),
            "more",
            REMEDY,
        ),
        error => ModelError::Syntax {
            file: report.file.to_owned(),
            message: error.to_string(),
            remedy: "a URDF is one well-formed XML document with <robot> at its root",
        },
    })?;
    check_depth(report, &document)?;
    let robot = document.root_element();
    for kind in ["link", "joint"] {
        let count = children(&robot).filter(|n| n.has_tag_name(kind)).count();
        if count > MAX_LINKS {
            return Err(report.invalid(
                place(&robot),
                format!("may have at most {MAX_LINKS} of <{kind}>"),
                count,
                REMEDY,
            ));
        }
    }
    Ok(document)
}

/// Limits the number of attributes per element before parsing: each piece of the text between two `<` has the
/// attributes of
/// at most one element.
fn check_attributes(report: Reporter<'_>, text: &str) -> Result<(), ModelError> {
    let values = |tag: &str| {
        let mut before = 0_u8;
        let mut count = 0;
        for byte in tag.bytes().filter(|byte| !byte.is_ascii_whitespace()) {
            count += usize::from(before == b'=' && matches!(byte, b'"' | b'\''));
            before = byte;
        }
        count
    };
    for tag in text.split('<') {
        let count = values(tag);
        if count > MAX_ATTRIBUTES {
            let name: String = tag.chars().take_while(|c| c.is_alphanumeric()).collect();
            return Err(report.invalid(
                format!("<{name}>"),
                format!("may have at most {MAX_ATTRIBUTES} attributes"),
                count,
                REMEDY,
            ));
        }
    }
    Ok(())
}

fn check_depth(report: Reporter<'_>, document: &Document<'_>) -> Result<(), ModelError> {
    let mut depth = 0;
    let mut node = document.root();
    loop {
        node = match node.first_child() {
            Some(child) => {
                depth += 1;
                child
            }
            None => match next_beside(node, &mut depth) {
                Some(next) => next,
                None => return Ok(()),
            },
        };
        if depth > MAX_DEPTH {
            return Err(report.invalid(
                place(&node),
                format!("elements may be nested at most {MAX_DEPTH} levels deep"),
                "more",
                REMEDY,
            ));
        }
    }
}

/// Returns the next node after `node` and its descendants, in document order.
fn next_beside<'a, 'input>(
    mut node: Node<'a, 'input>,
    depth: &mut usize,
) -> Option<Node<'a, 'input>> {
    loop {
        if let Some(next) = node.next_sibling() {
            return Some(next);
        }
        node = node.parent()?;
        *depth -= 1;
    }
}
