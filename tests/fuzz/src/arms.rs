//! Fuzz targets of arm descriptions: a fuzzed URDF with a valid TOML, and a fuzzed TOML with a valid URDF.

use supple_core::Controller;
use supple_model::Description;

/// TOML of the built-in arm with three joints.
pub const TOML: &str = include_str!("../../../assets/wam3/arm.toml");
/// URDF of the built-in arm with three joints.
pub const URDF: &str = include_str!("../../../assets/wam3/arm.urdf");

/// Reads the bytes as a URDF.
pub fn urdf(data: &[u8]) {
    if let Ok(text) = core::str::from_utf8(data) {
        describe(TOML, text);
    }
}

/// Reads the bytes as a TOML.
pub fn toml(data: &[u8]) {
    if let Ok(text) = core::str::from_utf8(data) {
        describe(text, URDF);
    }
}

/// Reads a description. The controller accepts or rejects a valid one; every rejection has a reason.
fn describe(toml: &str, urdf: &str) {
    match Description::from_text(toml, urdf) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(description) => {
            let config = description.config::<3>();
            if let Ok(Err(error)) = config.map(Controller::new) {
                assert!(!error.to_string().is_empty());
            }
            let _ = description.home::<3>();
            assert_eq!(description.joint_names().len(), description.dof());
            // The text is unchanged, except for declarations of missing prefixes.
            let kept = description.urdf();
            if kept != urdf {
                assert!(kept.contains(" xmlns:"));
                let again = Description::from_text(toml, kept).expect("the same arm");
                assert_eq!(again.urdf(), kept);
            }
        }
    }
}
