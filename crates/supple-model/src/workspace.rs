//! Converts the workspace of the TOML to the types of the core.

use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::settings::{BoxSettings, WallSettings};
use supple_core::config::{Border, Workspace, Zone};
use supple_core::math::Vector3;
use supple_core::workspace::MAX_BOUNDARIES;

impl Description {
    /// Boundaries and zones of the tip.
    ///
    /// # Errors
    /// [`ModelError`] if there are too many, or if the normal of a wall is zero or not finite.
    pub(crate) fn workspace(&self) -> Result<Workspace, ModelError> {
        let given = &self.settings.workspace;
        let report = Reporter {
            file: &self.toml_file,
        };
        let mut borders = Vec::new();
        for wall in &given.wall {
            borders.push(plane(report, wall)?);
        }
        if let Some(BoxSettings { lower_m, upper_m }) = &given.keep_in {
            for axis in 0..3 {
                for (sign, offset_m) in [(1.0, upper_m[axis]), (-1.0, -lower_m[axis])] {
                    let mut normal = Vector3::zeros();
                    normal[axis] = sign;
                    borders.push(Border::Wall { normal, offset_m });
                }
            }
        }
        for BoxSettings { lower_m, upper_m } in &given.keep_out {
            borders.push(Border::KeepOut {
                lower_m: Vector3::from(*lower_m),
                upper_m: Vector3::from(*upper_m),
            });
        }
        let zones = given.zone.iter().map(|zone| Zone {
            lower_m: Vector3::from(zone.lower_m),
            upper_m: Vector3::from(zone.upper_m),
            tip_speed_m_per_s: zone.tip_speed_m_per_s.unwrap_or(f64::MAX),
            tip_force_n: zone.tip_force_n.unwrap_or(f64::MAX),
        });
        Ok(Workspace {
            borders: into_fixed_array(report, "[workspace] borders", borders)?,
            zones: into_fixed_array(report, "[[workspace.zone]]", zones.collect())?,
            margin_m: given.margin_m,
            stiffness_n_per_m: given.stiffness_n_per_m,
            damping_n_s_per_m: given.damping_n_s_per_m,
        })
    }
}

fn plane(report: Reporter<'_>, wall: &WallSettings) -> Result<Border, ModelError> {
    let normal = Vector3::from(wall.normal);
    let length = normal.norm();
    if length > 0.0 && length.is_finite() {
        return Ok(Border::Wall {
            normal: normal / length,
            offset_m: wall.offset_m,
        });
    }
    Err(report.invalid(
        "[[workspace.wall]] normal",
        "must have a direction",
        format!("{:?}", wall.normal),
        "give a vector that points out of the allowed side, such as [0.0, 0.0, -1.0] for a floor",
    ))
}

fn into_fixed_array<T: Copy>(
    report: Reporter<'_>,
    element: &str,
    found: Vec<T>,
) -> Result<[Option<T>; MAX_BOUNDARIES], ModelError> {
    if found.len() > MAX_BOUNDARIES {
        return Err(report.invalid(
            element,
            "are too many",
            found.len(),
            format!("remove some: the limit is {MAX_BOUNDARIES}; a keep_in box counts as six"),
        ));
    }
    Ok(core::array::from_fn(|i| found.get(i).copied()))
}
