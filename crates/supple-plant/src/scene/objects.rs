//! The objects of a scene, as plain data.

use crate::contact::Material;
use serde::{Deserialize, Serialize};

/// Environment of the arm. The default is empty space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Horizontal ground, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground: Option<Ground>,
    /// Blocks that do not move.
    #[serde(rename = "fixed_block", skip_serializing_if = "Vec::is_empty")]
    pub fixed_blocks: Vec<FixedBlock>,
    /// Boxes that move.
    #[serde(rename = "free_box", skip_serializing_if = "Vec::is_empty")]
    pub free_boxes: Vec<FreeBox>,
    /// Materials in addition to the built-in ones, or instead of them.
    #[serde(rename = "material", skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<Material>,
}

/// Ground plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Height of the surface on base z \[m\].
    pub height_m: f64,
    /// Name of its material.
    pub material: String,
}

/// A cuboid that does not move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedBlock {
    /// Name, unique in the scene.
    pub name: String,
    /// Centre, base axes \[m\].
    pub center_m: [f64; 3],
    /// Edge lengths along its own axes, without the layer \[m\], positive.
    pub size_m: [f64; 3],
    /// Fixed-axis roll, pitch, yaw \[rad\]; zero by default.
    #[serde(default)]
    pub rpy_rad: [f64; 3],
    /// Name of its material.
    pub material: String,
    /// Layer on its top face.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<Layer>,
}

/// A cuboid of uniform density that moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FreeBox {
    /// Name, unique in the scene.
    pub name: String,
    /// Mass \[kg\], positive.
    pub mass_kg: f64,
    /// Centre at the start, base axes \[m\].
    pub center_m: [f64; 3],
    /// Edge lengths along its own axes, without the layer \[m\], positive.
    pub size_m: [f64; 3],
    /// Fixed-axis roll, pitch, yaw at the start \[rad\]; zero by default.
    #[serde(default)]
    pub rpy_rad: [f64; 3],
    /// Name of its material.
    pub material: String,
    /// Layer on its top face, massless.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<Layer>,
}

/// A sheet on the whole top face of a block or box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Thickness \[m\], positive.
    pub thickness_m: f64,
    /// Name of its material.
    pub material: String,
}
