//! Converts the workspace of the TOML to the types of the core.

use crate::description::Description;
use crate::error::{ModelError, Reporter};
use crate::settings::{BoxSettings, WallSettings};
use supple_core::config::{Border, Workspace, Zone};
use supple_core::math::Vector3;
use supple_core::workspace::MAX_BORDERS_OR_ZONES;

impl Description {
    /// Borders and zones of the tip, and the margin, stiffness and damping of the borders.
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
            borders.push(border_of(report, wall)?);
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
            borders: into_fixed_array(
                report,
                "[workspace] wall, keep_in and keep_out",
                borders,
                "; keep_in counts as six",
            )?,
            zones: into_fixed_array(report, "[[workspace.zone]]", zones.collect(), "")?,
            margin_m: given.margin_m,
            stiffness_n_per_m: given.stiffness_n_per_m,
            damping_n_s_per_m: given.damping_n_s_per_m,
        })
    }
}

fn border_of(report: Reporter<'_>, wall: &WallSettings) -> Result<Border, ModelError> {
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
        "must be finite and not zero",
        format!("{:?}", wall.normal),
        "give a vector that points out of the allowed side, such as [0.0, 0.0, -1.0] for a floor",
    ))
}

fn into_fixed_array<T: Copy>(
    report: Reporter<'_>,
    element: &str,
    found: Vec<T>,
    note: &str,
) -> Result<[Option<T>; MAX_BORDERS_OR_ZONES], ModelError> {
    if found.len() > MAX_BORDERS_OR_ZONES {
        return Err(report.invalid(
            element,
            "are too many",
            found.len(),
            format!("remove some: the limit is {MAX_BORDERS_OR_ZONES}{note}"),
        ));
    }
    Ok(core::array::from_fn(|i| found.get(i).copied()))
}
