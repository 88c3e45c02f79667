//! Arguments of an arm that is given as a URDF, for every program that reads one.

use crate::urdf_name::UrdfName;

/// What a URDF alone does not contain.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct UrdfArgs {
    /// The link whose origin is the tip, if the arm is given as a URDF. Default: the end of its longest chain, which may be
    /// a finger; a warning names it.
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Replace inertias in the URDF that no rigid body has by the nearest one that a rigid body has, and say so.
    #[arg(long)]
    pub repair: bool,
}

impl UrdfArgs {
    /// Returns the arm's name with the tip, as all programs read it. The two flags have no effect on other arms than a URDF.
    pub fn name(&self, arm: &str) -> String {
        match UrdfName::parse(arm) {
            Some(mut name) => {
                name.tip = self.tip.clone().or(name.tip);
                name.repair |= self.repair;
                name.to_text()
            }
            None => arm.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::UrdfArgs;

    #[test]
    fn the_arguments_of_a_urdf_are_part_of_its_name() {
        let args = UrdfArgs {
            tip: Some("hand".to_owned()),
            repair: true,
        };
        for (arm, name) in [
            ("a.urdf", "a.urdf#hand,repair"),
            ("a.urdf#flange", "a.urdf#hand,repair"),
            ("wam4", "wam4"),
        ] {
            assert_eq!(args.name(arm), name);
        }
        assert_eq!(UrdfArgs::default().name("a.urdf#flange"), "a.urdf#flange");
    }
}
