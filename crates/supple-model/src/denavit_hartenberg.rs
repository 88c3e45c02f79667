//! An arm from a Denavit-Hartenberg table, as the text of a URDF.
//!
//! ```text
//! standard (Denavit, Hartenberg 1955):  T_i = Rot_z(theta_i + q_i) Trans_z(d_i) Trans_x(a_i) Rot_x(alpha_i)
//! modified (Craig; Khalil):             T_i = Rot_x(alpha_i) Trans_x(a_i) Rot_z(theta_i + q_i) Trans_z(d_i)
//! ```
//!
//! In the modified convention the row of a joint has the `alpha` and `a` that lead to its axis, often written with the index
//! `i - 1`. A table has no masses: unless they are given, every link is a ball of 1 kg, from which an identification can begin.

use nalgebra::{Rotation3, Vector3};
use std::fmt::Write;

/// Radius of the balls that the links are \[m\].
const BALL_M: f64 = 0.1;
/// Mass of a link without a given one \[kg\].
const MASS_KG: f64 = 1.0;
/// Greatest number of rows.
const MAX_ROWS: usize = 32;
/// Greatest length \[m\] or angle \[rad\] of a table.
const MAX_VALUE: f64 = 1e3;

/// Convention of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum DhConvention {
    /// The joint turns about the z axis of the frame before it: `Rot_z Trans_z Trans_x Rot_x`.
    Standard,
    /// The joint turns about the z axis of its own frame, as in Craig's and Khalil's books: `Rot_x Trans_x Rot_z Trans_z`.
    Modified,
}

/// A row of a table: a revolute joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DhRow {
    /// Length along x \[m\].
    pub a_m: f64,
    /// Angle about x \[rad\].
    pub alpha_rad: f64,
    /// Length along z \[m\].
    pub d_m: f64,
    /// Angle about z where the joint's angle is zero \[rad\].
    pub theta_rad: f64,
    /// Mass of the link after the joint, at the origin of its frame \[kg\]; `None`: 1 kg.
    pub mass_kg: Option<f64>,
}

/// Error of a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DhError {
    /// The header lacks a column.
    #[error(
        "the header has no column {column}: name the columns a_m, alpha_rad or alpha_deg, d_m, theta_rad or theta_deg and, if known, \
         mass_kg, one row for each joint"
    )]
    NoColumn {
        /// The column.
        column: &'static str,
    },
    /// A column that the table does not know.
    #[error(
        "the header has the column {found}: give a_m, alpha_rad or alpha_deg, d_m, theta_rad or theta_deg, mass_kg"
    )]
    UnknownColumn {
        /// The column.
        found: String,
    },
    /// A column is given twice, or in two units.
    #[error("the header has the column {column} twice, or in two units: leave one of them out")]
    Twice {
        /// The column.
        column: String,
    },
    /// A row has another number of cells than the header.
    #[error(
        "row {row} has {found} cells, the header {expected}: separate cells by commas, and decimals by points"
    )]
    Cells {
        /// Number of the row, from 1, without the header.
        row: usize,
        /// Cells found.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// A cell is not a number within its bounds.
    #[error(
        "row {row}, {column}: found {found}, must be a number of at most 1000 in magnitude{more}"
    )]
    Cell {
        /// Number of the row, from 1, without the header.
        row: usize,
        /// The column.
        column: &'static str,
        /// The cell.
        found: String,
        /// A further condition.
        more: &'static str,
    },
    /// There are no rows, or too many.
    #[error("{found} rows: give one row for each revolute joint, 1 to {MAX_ROWS}")]
    Rows {
        /// Rows found.
        found: usize,
    },
}

/// Reads a table from CSV: a header with the names of [`DhRow`], angles in `_rad` or `_deg`, and one row for each joint.
///
/// # Errors
/// [`DhError`].
pub fn dh_rows_of_csv(text: &str) -> Result<Vec<DhRow>, DhError> {
    let mut lines = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let header: Vec<&str> = lines
        .next()
        .unwrap_or("")
        .split(',')
        .map(str::trim)
        .collect();
    let known = [
        "a_m",
        "alpha_rad",
        "alpha_deg",
        "d_m",
        "theta_rad",
        "theta_deg",
        "mass_kg",
    ];
    if let Some(found) = header
        .iter()
        .find(|name| !known.contains(name) && !name.is_empty())
    {
        let found = (*found).to_owned();
        return Err(DhError::UnknownColumn { found });
    }
    for (i, name) in header.iter().enumerate() {
        let twice = |other: &str| header[..i].contains(&other);
        let other_unit = name.replace("_rad", "_deg");
        if twice(name) || name.ends_with("_rad") && header.contains(&other_unit.as_str()) {
            let column = (*name).to_owned();
            return Err(DhError::Twice { column });
        }
    }
    let place = |name: &str| header.iter().position(|column| *column == name);
    let needed = |column: &'static str| place(column).ok_or(DhError::NoColumn { column });
    let angle = |rad: &'static str, deg: &'static str| match (place(rad), place(deg)) {
        (Some(column), _) => Ok((rad, column, 1.0)),
        (None, Some(column)) => Ok((deg, column, std::f64::consts::PI / 180.0)),
        (None, None) => Err(DhError::NoColumn { column: rad }),
    };
    let (a, d) = (("a_m", needed("a_m")?, 1.0), ("d_m", needed("d_m")?, 1.0));
    let (alpha, theta) = (
        angle("alpha_rad", "alpha_deg")?,
        angle("theta_rad", "theta_deg")?,
    );
    let mass = place("mass_kg").map(|column| ("mass_kg", column, 1.0));
    let row = |(i, line): (usize, &str)| {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() != header.len() {
            return Err(DhError::Cells {
                row: i + 1,
                found: cells.len(),
                expected: header.len(),
            });
        }
        let number = |(column, place, unit): (&'static str, usize, f64)| {
            let text = cells.get(place).copied().unwrap_or("");
            let value = text
                .parse::<f64>()
                .ok()
                .filter(|value| value.abs() <= MAX_VALUE);
            value.map(|value| unit * value).ok_or(DhError::Cell {
                row: i + 1,
                column,
                found: format!("`{text}`"),
                more: "",
            })
        };
        Ok(DhRow {
            a_m: number(a)?,
            alpha_rad: number(alpha)?,
            d_m: number(d)?,
            theta_rad: number(theta)?,
            mass_kg: mass.map(number).transpose()?,
        })
    };
    lines.enumerate().map(row).collect()
}

/// Returns the text of a URDF with the links `base`, `link1` .. and `tool0`, the frame after the last row, and the joints `joint1` ..
/// without limits.
///
/// # Errors
/// [`DhError`] for numbers that are not finite or too great, masses that are not positive, or no rows.
pub fn urdf_of_dh(name: &str, convention: DhConvention, rows: &[DhRow]) -> Result<String, DhError> {
    if rows.is_empty() || rows.len() > MAX_ROWS {
        return Err(DhError::Rows { found: rows.len() });
    }
    for (i, row) in rows.iter().enumerate() {
        check(i + 1, row)?;
    }
    let name: String = name
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "_-.".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!-- From a Denavit-Hartenberg table, {} convention. Links without a given mass are balls of \
         {MASS_KG} kg: identify them. -->\n<robot name=\"{name}\">\n  <link name=\"base\"/>\n",
        match convention {
            DhConvention::Standard => "standard",
            DhConvention::Modified => "modified",
        }
    );
    let mut before = (Rotation3::identity(), Vector3::zeros());
    for (i, row) in rows.iter().enumerate() {
        let (about_x, along_x) = (
            Rotation3::from_axis_angle(&Vector3::x_axis(), row.alpha_rad),
            Vector3::new(row.a_m, 0.0, 0.0),
        );
        let (about_z, along_z) = (
            Rotation3::from_axis_angle(&Vector3::z_axis(), row.theta_rad),
            Vector3::new(0.0, 0.0, row.d_m),
        );
        // The frame of link i is that of its joint, which turns about z.
        let (origin, after) = match convention {
            DhConvention::Standard => {
                ((before.0 * about_z, before.1), (about_x, along_x + along_z))
            }
            DhConvention::Modified => (
                (
                    before.0 * about_x * about_z,
                    before.1 + before.0 * (along_x + about_x * along_z),
                ),
                (Rotation3::identity(), Vector3::zeros()),
            ),
        };
        let mass_kg = row.mass_kg.unwrap_or(MASS_KG);
        let (parent, link) = match i {
            0 => ("base".to_owned(), 1),
            _ => (format!("link{i}"), i + 1),
        };
        let [x, y, z] = after.1.into();
        let inertia = 0.4 * mass_kg * BALL_M * BALL_M;
        let _ = write!(
            text,
            "  <link name=\"link{link}\">\n    <inertial>\n      <origin xyz=\"{x:?} {y:?} {z:?}\"/>\n      <mass value=\"{mass_kg:?}\"/>\n      <inertia ixx=\"{inertia:?}\" \
             ixy=\"0\" ixz=\"0\" iyy=\"{inertia:?}\" iyz=\"0\" izz=\"{inertia:?}\"/>\n    </inertial>\n  </link>\n  <joint \
             name=\"joint{link}\" type=\"revolute\">\n    {}\n    <parent link=\"{parent}\"/>\n    <child link=\"link{link}\"/>\n    \
             <axis xyz=\"0 0 1\"/>\n  </joint>\n",
            origin_element(&origin)
        );
        before = after;
    }
    let _ = write!(
        text,
        "  <link name=\"tool0\"/>\n  <joint name=\"tool\" type=\"fixed\">\n    {}\n    <parent link=\"link{}\"/>\n    <child \
         link=\"tool0\"/>\n  </joint>\n</robot>\n",
        origin_element(&before),
        rows.len()
    );
    Ok(text)
}

fn origin_element((rotation, translation): &(Rotation3<f64>, Vector3<f64>)) -> String {
    let (roll, pitch, yaw) = rotation.euler_angles();
    let [x, y, z] = (*translation).into();
    format!("<origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>")
}

fn check(row: usize, of: &DhRow) -> Result<(), DhError> {
    let columns = [
        ("a_m", of.a_m),
        ("alpha_rad", of.alpha_rad),
        ("d_m", of.d_m),
        ("theta_rad", of.theta_rad),
        ("mass_kg", of.mass_kg.unwrap_or(MASS_KG)),
    ];
    for (column, value) in columns {
        let mass = column == "mass_kg";
        if !value.is_finite() || value.abs() > MAX_VALUE || mass && value <= 0.0 {
            return Err(DhError::Cell {
                row,
                column,
                found: format!("{value}"),
                more: if mass { ", above zero" } else { "" },
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Description, unlimited::with_default_limits};
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use supple_core::Vector;
    use supple_core::dynamics::{gravity, tip_pose};
    use supple_random::Random;

    /// The definition of both conventions, written out.
    fn tip(convention: DhConvention, rows: &[DhRow], q: &[f64]) -> Isometry3<f64> {
        let about = |axis: Vector3<f64>, angle: f64| {
            Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_scaled_axis(axis * angle),
            )
        };
        let along = |x: f64, z: f64| Isometry3::translation(x, 0.0, z);
        let step = |pose: Isometry3<f64>, (row, q): (&DhRow, &f64)| {
            let (rx, rz) = (
                about(Vector3::x(), row.alpha_rad),
                about(Vector3::z(), row.theta_rad + q),
            );
            match convention {
                DhConvention::Standard => {
                    pose * rz * along(0.0, row.d_m) * along(row.a_m, 0.0) * rx
                }
                DhConvention::Modified => {
                    pose * rx * along(row.a_m, 0.0) * rz * along(0.0, row.d_m)
                }
            }
        };
        rows.iter().zip(q).fold(Isometry3::identity(), step)
    }

    #[test]
    fn the_tip_is_where_the_table_says() {
        let mut random = Random::new(3);
        for convention in [DhConvention::Standard, DhConvention::Modified] {
            for _ in 0..20 {
                let rows: [DhRow; 4] = core::array::from_fn(|_| DhRow {
                    a_m: random.signed(),
                    alpha_rad: 3.0 * random.signed(),
                    d_m: random.signed(),
                    theta_rad: 3.0 * random.signed(),
                    mass_kg: None,
                });
                let urdf = urdf_of_dh("an arm", convention, &rows).expect("a table");
                let toml = "name = \"arm\"\nurdf = \"arm.urdf\"\ntip_frame = \"tool0\"\n";
                let arm = Description::from_text(toml, &with_default_limits(&urdf));
                let arm = arm.expect("a URDF").arm::<4>().expect("four joints");
                let q = Vector::<4>::from_fn(|_, _| 2.0 * random.signed());
                let (found, expected) = (tip_pose(&arm, &q), tip(convention, &rows, q.as_slice()));
                let point: [f64; 3] = found.translation.into();
                let apart = Vector3::from(point) - expected.translation.vector;
                assert!(apart.norm() < 1e-12, "{convention:?} {apart}");
            }
        }
    }

    /// A mass lies at the origin of the frame after its row, in both conventions.
    #[test]
    fn masses_lie_at_the_origins_of_the_frames() {
        let row = |a_m, alpha_rad, mass_kg| DhRow {
            a_m,
            alpha_rad,
            mass_kg: Some(mass_kg),
            ..DhRow::default()
        };
        // The first axis is horizontal in both: the arm reaches 0.5 m and 0.9 m to the side.
        let half = std::f64::consts::FRAC_PI_2;
        let massless = 1e-9;
        let standard = [
            row(0.0, half, massless),
            row(0.5, 0.0, 2.0),
            row(0.4, 0.0, 3.0),
        ];
        let modified = [
            row(0.0, half, massless),
            row(0.5, 0.0, 2.0),
            row(0.4, 0.0, 3.0),
        ];
        let torque_nm = |convention, rows: &[DhRow]| {
            let urdf = urdf_of_dh("a", convention, rows).expect("a table");
            let toml = "name = \"a\"\nurdf = \"a.urdf\"\ntip_frame = \"tool0\"\n";
            let arm = Description::from_text(toml, &with_default_limits(&urdf)).expect("a URDF");
            gravity(&arm.arm::<3>().expect("three joints"), &Vector::zeros())
        };
        let standard = torque_nm(DhConvention::Standard, &standard);
        assert!(
            (standard[1] - 9.81 * (2.0 * 0.5 + 3.0 * 0.9)).abs() < 1e-6,
            "{standard}"
        );
        let modified = torque_nm(DhConvention::Modified, &modified);
        assert!(
            (modified[0] - 9.81 * (2.0 * 0.5 + 3.0 * 0.9)).abs() < 1e-6,
            "{modified}"
        );
    }

    #[test]
    fn a_table_in_csv_is_read_and_errors_name_row_column_and_value() {
        let text = "# UR10e\na_m, alpha_deg, d_m, theta_deg, mass_kg\n0, 90, 0.1807, 0, 7.4\n-0.6127, 0, 0, 0, 13\n";
        let rows = dh_rows_of_csv(text).expect("a table");
        assert_eq!(rows.len(), 2);
        assert!((rows[0].alpha_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!(rows[1].mass_kg, Some(13.0));
        for (text, said) in [
            ("", "no column a_m"),
            ("a_m,d_m,theta_rad\n", "no column alpha_rad"),
            ("a_m,alpha_rad,d_m,theta_rad,r\n", "the column r"),
            (
                "a_m,alpha_rad,d_m,theta_rad\n0,0,0,0\n0,x,0,0\n",
                "row 2, alpha_rad: found `x`",
            ),
            (
                "a_m,alpha_rad,d_m,theta_rad\n0,0\n",
                "row 1 has 2 cells, the header 4",
            ),
            (
                "a_m,alpha_rad,d_m,theta_rad\n0,5,0,0,2,0\n",
                "row 1 has 6 cells",
            ),
            ("a_m,alpha_rad,alpha_deg,d_m,theta_rad\n", "alpha_rad twice"),
            ("a_m,alpha_rad,d_m,d_m,theta_rad\n", "d_m twice"),
            (
                "a_m,alpha_rad,d_m,theta_rad\n0,0,NaN,0\n",
                "row 1, d_m: found `NaN`",
            ),
        ] {
            let error = dh_rows_of_csv(text).expect_err(text).to_string();
            assert!(error.contains(said), "{error}");
        }
        let none = urdf_of_dh("a", DhConvention::Standard, &[]);
        assert_eq!(none, Err(DhError::Rows { found: 0 }));
        let weightless = DhRow {
            mass_kg: Some(0.0),
            ..DhRow::default()
        };
        let error = urdf_of_dh("a", DhConvention::Standard, &[weightless]).expect_err("no mass");
        assert!(
            error.to_string().contains("row 1, mass_kg: found 0"),
            "{error}"
        );
    }
}
