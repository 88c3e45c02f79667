//! The arms built into the crate. Each is a folder of `assets/`: `arm.toml` and `arm.urdf`.

use crate::error::ModelError;

macro_rules! asset {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../../assets/", $name, "/arm.toml")),
            include_str!(concat!("../../../assets/", $name, "/arm.urdf")),
        )
    };
}

/// Name, TOML, URDF.
const ASSETS: [(&str, &str, &str); 6] = [
    asset!("openarm"),
    asset!("paper3"),
    asset!("wam3"),
    asset!("wam4"),
    asset!("wam7"),
    asset!("yam"),
];

const NAMES: [&str; ASSETS.len()] = {
    let mut names = [""; ASSETS.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = ASSETS[i].0;
        i += 1;
    }
    names
};

/// Returns the names of the built-in arms.
///
/// - `openarm`: OpenArm 1.0, the right arm, seven Damiao motors; upper arm roll and wrist held.
/// - `paper3`: the physically consistent arm closest to the paper's identified parameters, three joints.
/// - `wam3`: the WAM with its roll joint fixed at 0, three joints.
/// - `wam4`: the 4-joint WAM, roll held.
/// - `wam7`: the 7-joint WAM, roll and wrist held.
/// - `yam`: I2RT YAM with its gripper, six Damiao motors; wrist held.
pub fn assets() -> &'static [&'static str] {
    &NAMES
}

/// Returns the TOML and URDF of a built-in arm.
pub(crate) fn text(name: &str) -> Result<(&'static str, &'static str), ModelError> {
    let found = ASSETS.iter().find(|(asset, ..)| *asset == name);
    found
        .map(|(_, toml, urdf)| (*toml, *urdf))
        .ok_or_else(|| ModelError::UnknownAsset {
            found: name.to_owned(),
            expected: NAMES.join(", "),
        })
}
