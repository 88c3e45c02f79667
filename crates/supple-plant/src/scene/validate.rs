//! Validation of a scene.

use super::objects::{FreeBox, Layer, Scene};
use crate::contact::Material;
use supple_core::nalgebra::Vector3;

/// Maximum initial overlap of a box with the ground \[m\].
const MAX_OVERLAP_M: f64 = 1e-3;

/// Error of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The text is not TOML, or has unknown keys or wrong types.
    #[error("{file}: {message}")]
    Toml {
        /// Source of the text.
        file: String,
        /// Position, key and expected value.
        message: String,
    },
    /// An invalid number.
    #[error("scene: {element}: {field} is {value}: it must be {must}")]
    Value {
        /// The object or material.
        element: String,
        /// Field of the element.
        field: &'static str,
        /// Value found.
        value: f64,
        /// Requirement on the value.
        must: &'static str,
    },
    /// An unknown material.
    #[error(
        "scene: {element}: material is {material:?}: use one of {known}, or add a [[material]]"
    )]
    UnknownMaterial {
        /// The object.
        element: String,
        /// Name of the requested material.
        material: String,
        /// Known names.
        known: String,
    },
    /// Two objects or two materials have the same name.
    #[error("scene: two elements are named {name:?}: rename one")]
    Duplicate {
        /// The name.
        name: String,
    },
}

impl Scene {
    /// Rejects an invalid scene.
    ///
    /// # Errors
    /// The first [`SceneError`] found.
    pub fn validate(&self) -> Result<(), SceneError> {
        for material in &self.materials {
            check_material(material)?;
        }
        let materials = self.materials.iter().map(|m| &m.name);
        let blocks = self.fixed_blocks.iter().map(|b| &b.name);
        let objects = blocks.chain(self.free_boxes.iter().map(|b| &b.name));
        unique(materials)?;
        unique(objects)?;
        if let Some(ground) = &self.ground {
            finite("ground", "height_m", &[ground.height_m])?;
            self.resolve("ground", &ground.material)?;
        }
        for b in &self.fixed_blocks {
            let element = format!("fixed_block {:?}", b.name);
            self.cuboid(&element, [&b.center_m, &b.size_m, &b.rpy_rad], &b.material)?;
            self.layer(&element, b.layer.as_ref())?;
        }
        for b in &self.free_boxes {
            let element = format!("free_box {:?}", b.name);
            positive(&element, "mass_kg", &[b.mass_kg])?;
            self.cuboid(&element, [&b.center_m, &b.size_m, &b.rpy_rad], &b.material)?;
            self.layer(&element, b.layer.as_ref())?;
            self.above_ground(&element, b)?;
        }
        Ok(())
    }

    fn cuboid(
        &self,
        element: &str,
        [center, size, rpy]: [&[f64; 3]; 3],
        material: &str,
    ) -> Result<(), SceneError> {
        finite(element, "center_m", center)?;
        positive(element, "size_m", size)?;
        finite(element, "rpy_rad", rpy)?;
        self.resolve(element, material).map(drop)
    }

    fn above_ground(&self, element: &str, block: &FreeBox) -> Result<(), SceneError> {
        let Some(ground) = &self.ground else {
            return Ok(());
        };
        let up = block.pose().rotation.row(2).abs();
        let half = 0.5 * (up * Vector3::from(block.size_m))[0];
        let height = [block.center_m[2]];
        let must = "high enough for the box to clear the ground";
        check(element, "center_m", &height, must, |z| {
            z - half > ground.height_m - MAX_OVERLAP_M
        })
    }

    fn layer(&self, element: &str, layer: Option<&Layer>) -> Result<(), SceneError> {
        let Some(layer) = layer else { return Ok(()) };
        positive(element, "layer.thickness_m", &[layer.thickness_m])?;
        self.resolve(element, &layer.material).map(drop)
    }

    /// Returns the material of `element`.
    pub(crate) fn resolve(&self, element: &str, material: &str) -> Result<Material, SceneError> {
        self.material(material).ok_or_else(|| {
            let mut known = vec!["\"wood\"".to_owned(), "\"rubber\"".to_owned()];
            known.extend(self.materials.iter().map(|m| format!("{:?}", m.name)));
            SceneError::UnknownMaterial {
                element: element.to_owned(),
                material: material.to_owned(),
                known: known.join(", "),
            }
        })
    }
}

fn check_material(material: &Material) -> Result<(), SceneError> {
    let element = format!("material {:?}", material.name);
    let stiffness = [material.stiffness_n_per_m_1_5];
    positive(&element, "stiffness_n_per_m_1_5", &stiffness)?;
    let dissipation = material.dissipation_s_per_m;
    not_negative(&element, "dissipation_s_per_m", dissipation)?;
    not_negative(&element, "friction", material.friction)
}

fn check(
    element: &str,
    field: &'static str,
    values: &[f64],
    must: &'static str,
    valid: impl Fn(f64) -> bool,
) -> Result<(), SceneError> {
    match values
        .iter()
        .copied()
        .find(|v| !(v.is_finite() && valid(*v)))
    {
        None => Ok(()),
        Some(value) => Err(SceneError::Value {
            element: element.to_owned(),
            field,
            value,
            must,
        }),
    }
}

fn finite(element: &str, field: &'static str, values: &[f64]) -> Result<(), SceneError> {
    check(element, field, values, "finite", |_| true)
}

fn positive(element: &str, field: &'static str, values: &[f64]) -> Result<(), SceneError> {
    check(element, field, values, "finite and positive", |v| v > 0.0)
}

fn not_negative(element: &str, field: &'static str, value: f64) -> Result<(), SceneError> {
    let must = "finite and not negative";
    check(element, field, &[value], must, |v| v >= 0.0)
}

fn unique<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), SceneError> {
    let mut seen = Vec::new();
    for name in names {
        if seen.contains(&name) {
            return Err(SceneError::Duplicate { name: name.clone() });
        }
        seen.push(name);
    }
    Ok(())
}
