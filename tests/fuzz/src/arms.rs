//! Descriptions of arms: a URDF with a sound TOML, a TOML with a sound URDF.

use supple_core::Controller;
use supple_model::Description;

/// TOML of the built-in arm with three joints.
pub const TOML: &str = include_str!("../../../assets/wam3/arm.toml");
/// Its URDF.
pub const URDF: &str = include_str!("../../../assets/wam3/arm.urdf");

/// Bytes as a URDF.
pub fn urdf(data: &[u8]) {
    if let Ok(text) = core::str::from_utf8(data) {
        describe(TOML, text);
    }
}

/// Bytes as a TOML.
pub fn toml(data: &[u8]) {
    if let Ok(text) = core::str::from_utf8(data) {
        describe(text, URDF);
    }
}

/// What is not refused can be controlled, or is refused by the controller; either says why.
fn describe(toml: &str, urdf: &str) {
    match Description::from_text(toml, urdf) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(description) => {
            let config = description.config::<3>();
            if let Ok(Err(error)) = config.map(Controller::new) {
                assert!(!error.to_string().is_empty());
            }
            let _ = description.home::<3>();
            assert_eq!(
                (description.urdf(), description.joint_names().len()),
                (urdf, description.dof())
            );
        }
    }
}
