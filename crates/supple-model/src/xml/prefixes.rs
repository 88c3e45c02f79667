//! Declares the XML prefixes that a URDF uses without declaring them, such as `drake:`. Readers that resolve no
//! namespaces accept such files. What has a prefix belongs to another program and is not read.

use std::collections::BTreeSet;

/// Adds `xmlns:PREFIX` to the root element for every undeclared prefix of an element or an attribute. A word in a
/// quoted value or a comment that looks like one is declared too, which changes nothing.
pub(crate) fn declare_prefixes(urdf: String) -> String {
    let Some(root) = urdf.find("<robot") else {
        return urdf;
    };
    let mut prefixes = BTreeSet::new();
    for part in urdf[root..].split('<').skip(1) {
        let tag = part.split('>').next().unwrap_or_default();
        let tag = tag.trim_start_matches('/');
        prefixes.extend(tag.split_whitespace().filter_map(prefix));
    }
    // A prefix declared anywhere is left to the parser.
    let undeclared = |prefix: &&&str| {
        !matches!(**prefix, "xml" | "xmlns") && !urdf.contains(&format!("xmlns:{prefix}="))
    };
    let declarations: String = prefixes
        .iter()
        .filter(undeclared)
        .map(|prefix| format!(" xmlns:{prefix}=\"undeclared:{prefix}\""))
        .collect();
    if declarations.is_empty() {
        return urdf;
    }
    let mut declared = urdf;
    declared.insert_str(root + "<robot".len(), &declarations);
    declared
}

/// Returns the prefix of a name at the start of a word, such as `drake` of `drake:acceleration="2.5"`.
fn prefix(word: &str) -> Option<&str> {
    let end = word.find(|c: char| !(c.is_ascii_alphanumeric() || "_-.".contains(c)))?;
    let starts_a_name = word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    (starts_a_name && word[end..].starts_with(':')).then(|| &word[..end])
}

#[cfg(test)]
mod tests {
    use super::declare_prefixes;

    #[test]
    fn only_undeclared_prefixes_are_declared() {
        let text = "<?xml version=\"1.0\"?>\n<robot name=\"a\" xmlns:g=\"u\"><g:b/><d:c k=\"1 < 2\"><d:e/></d:c></robot>";
        let declared = declare_prefixes(text.to_owned());
        assert_eq!(declared.matches("xmlns:d=").count(), 1, "{declared}");
        assert_eq!(declared.matches("xmlns:g=").count(), 1, "{declared}");
        assert_eq!(declared.lines().count(), text.lines().count());
        let attribute =
            declare_prefixes("<robot><limit drake:acceleration=\"2\"/></robot>".to_owned());
        assert!(attribute.contains("xmlns:drake"), "{attribute}");
        let plain = "<robot name=\"a\"><link name=\"b\"/></robot>".to_owned();
        assert_eq!(declare_prefixes(plain.clone()), plain);
        // A prefix whose name begins like that of a declared one.
        let similar = declare_prefixes("<robot xmlns:gazebo=\"u\"><g:b/></robot>".to_owned());
        assert_eq!(similar.matches("xmlns:g=").count(), 1, "{similar}");
        // Readers know xacro by this name, and refuse it with the remedy.
        let xacro = declare_prefixes("<robot><xacro:arm/></robot>".to_owned());
        assert!(xacro.contains("undeclared:xacro"));
    }
}
