//! The name of a URDF as an arm: `robot.urdf`, or `robot.urdf#LINK` with the link that is the tip.

/// Suffix of a name that replaces inertias that no rigid body has.
const REPAIR: &str = ",repair";

/// The name of an arm that is given as a URDF.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UrdfName {
    /// Path of the URDF.
    pub path: String,
    /// The link that is the tip; `None` leaves the choice to the reader.
    pub tip: Option<String>,
    /// Whether to replace inertias that no rigid body has.
    pub repair: bool,
}

impl UrdfName {
    /// Reads `PATH.urdf`, `PATH.urdf#LINK` or `PATH.urdf#LINK,repair`; `None` if the name is not that of a URDF.
    pub fn parse(name: &str) -> Option<UrdfName> {
        let (path, rest) = name.split_once('#').unwrap_or((name, ""));
        let ends = |end: &str| path.to_ascii_lowercase().ends_with(end);
        if !(ends(".urdf") || ends(".xml") || ends(".xacro")) {
            return None;
        }
        let tip = rest.strip_suffix(REPAIR).unwrap_or(rest);
        Some(UrdfName {
            path: path.to_owned(),
            tip: (!tip.is_empty()).then(|| tip.to_owned()),
            repair: rest.ends_with(REPAIR),
        })
    }

    /// Returns the name as one word, which [`UrdfName::parse`] reads.
    pub fn to_text(&self) -> String {
        let repair = if self.repair { REPAIR } else { "" };
        match (&self.tip, self.repair) {
            (None, false) => self.path.clone(),
            (tip, _) => format!(
                "{}#{}{repair}",
                self.path,
                tip.as_deref().unwrap_or_default()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::UrdfName;

    #[test]
    fn a_written_name_is_read_back_unchanged() {
        for text in [
            "a/b.urdf",
            "a/b.urdf#tool0",
            "b.URDF#tool 0,repair",
            "b.urdf#,repair",
        ] {
            assert_eq!(UrdfName::parse(text).expect("a URDF").to_text(), text);
        }
        let name = UrdfName::parse("x.urdf#hand,repair").expect("a URDF");
        assert_eq!((name.tip.as_deref(), name.repair), (Some("hand"), true));
        assert!(UrdfName::parse("wam4").is_none());
        assert!(UrdfName::parse("arm/arm.toml").is_none());
    }
}
