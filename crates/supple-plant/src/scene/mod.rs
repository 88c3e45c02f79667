//! Environment of the arm: ground, fixed blocks, free boxes, rubber layers.
//!
//! Plain data, from code or from TOML:
//!
//! ```toml
//! [ground]
//! height_m = -0.35
//! material = "wood"
//!
//! [[fixed_block]]
//! name = "table"
//! center_m = [0.70, 0.0, -0.05]
//! size_m = [0.30, 0.60, 0.10]
//! rpy_rad = [0.0, 0.0, 0.0]         # optional
//! material = "wood"
//! layer = { thickness_m = 0.008, material = "rubber" }   # optional
//!
//! [[free_box]]
//! name = "carton"
//! mass_kg = 2.0
//! center_m = [0.70, 0.0, -0.25]
//! size_m = [0.10, 0.10, 0.20]
//! material = "wood"
//!
//! [[material]]                       # "wood" and "rubber" are built in; this overrides or adds
//! name = "wood"
//! stiffness_n_per_m_1_5 = 1.4e8
//! dissipation_s_per_m = 40.0
//! friction = 0.3
//! ```
//!
//! Coordinates are in the arm's base axes. A layer lies on the top face (+z of the block); when the tip has
//! compressed it fully, it also contacts the block below. Unknown keys are rejected.

mod objects;
mod validate;

pub use objects::{FixedBlock, FreeBox, Ground, Layer, Scene};

pub use validate::SceneError;

use crate::contact::Material;
use supple_core::Pose;
use supple_core::nalgebra::Vector3;

impl FixedBlock {
    /// Returns the frame of the block, origin at the centre: `base_from_block`.
    pub fn pose(&self) -> Pose {
        Pose::from_xyz_rpy(self.center_m, self.rpy_rad)
    }

    /// Returns a horizontal wooden block with the centre of its top face at `top_m`.
    pub fn wooden(name: &str, top_m: Vector3<f64>, size_m: [f64; 3]) -> FixedBlock {
        FixedBlock {
            name: name.to_owned(),
            center_m: [top_m.x, top_m.y, top_m.z - 0.5 * size_m[2]],
            size_m,
            rpy_rad: [0.0; 3],
            material: "wood".to_owned(),
            layer: None,
        }
    }
}

impl FreeBox {
    /// Returns the frame of the box at the start, origin at the centre: `base_from_box`.
    pub fn pose(&self) -> Pose {
        Pose::from_xyz_rpy(self.center_m, self.rpy_rad)
    }
}

impl Scene {
    /// Reads and validates a scene; `file` names the text in errors.
    ///
    /// # Errors
    /// [`SceneError`] with element, field, value and remedy.
    pub fn from_toml(text: &str, file: &str) -> Result<Scene, SceneError> {
        let scene: Scene = toml::from_str(text).map_err(|error| SceneError::Toml {
            file: file.to_owned(),
            message: error.to_string(),
        })?;
        scene.validate()?;
        Ok(scene)
    }

    /// Returns a wooden block below the whole reach of the arm, with its top face at this height \[m\].
    pub fn with_block_at(face_m: f64) -> Scene {
        let (side_m, height_m) = (2.4, 0.1);
        Scene {
            fixed_blocks: vec![FixedBlock {
                name: "block".to_owned(),
                center_m: [0.0, 0.0, face_m - 0.5 * height_m],
                size_m: [side_m, side_m, height_m],
                rpy_rad: [0.0; 3],
                material: "wood".to_owned(),
                layer: None,
            }],
            ..Scene::default()
        }
    }

    /// Returns the material of this name: that of the scene, otherwise the built-in one.
    pub fn material(&self, name: &str) -> Option<Material> {
        let built_in = [Material::wood(), Material::rubber()];
        let mut all = self.materials.iter().chain(&built_in);
        all.find(|m| m.name == name).cloned()
    }
}
