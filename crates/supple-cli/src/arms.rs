//! Loads arm descriptions, built in or from files; `supple arms`.

use crate::arguments::{ArmsArgs, ArmsCommand};
use crate::console::{print_json, print_line, print_status};
use crate::exit::Failure;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use supple_model::{
    Description, DhConvention, Paths, UrdfName, assets, dh_rows_of_csv,
    unlimited::with_default_limits, urdf_of_dh,
};

/// The arm of a command or a process that is given none.
pub const DEFAULT_ARM: &str = "wam4";

/// Maximum size of a Denavit-Hartenberg table \[bytes\].
const MAX_TABLE_BYTES: u64 = 1 << 16;

/// Warnings that have been printed.
static PRINTED_WARNINGS: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Loads a built-in arm by name, or an arm from a file. A built-in name takes precedence; write `./wam4` for a path. Settings
/// that a controller needs and that the arm's TOML lacks are derived. URDF content that supple does not read causes a warning on
/// standard error, or an error if `strict` is set.
///
/// # Errors
/// [`Failure::UnknownArm`] or [`Failure::Model`].
pub fn find(name_or_path: &str, strict: bool) -> Result<Description, Failure> {
    if assets().contains(&name_or_path) {
        return completed(Description::asset(name_or_path)?);
    }
    if let Some(urdf) = UrdfName::parse(name_or_path) {
        let description = Description::from_urdf(&urdf)?.strict_if(strict)?;
        print_warnings(&description);
        return completed(description);
    }
    let meant_as_path = name_or_path.contains(std::path::MAIN_SEPARATOR)
        || name_or_path.ends_with(".toml")
        || Path::new(name_or_path).exists();
    if meant_as_path {
        return load(Path::new(name_or_path), strict);
    }
    Err(Failure::UnknownArm {
        found: name_or_path.to_owned(),
        known: assets().join(", "),
    })
}

/// Returns the name of an arm for a process in another folder: the name of a built-in arm, or the absolute path of another arm
/// with the tip of its URDF.
pub fn absolute(name_or_path: &str) -> String {
    let path = |path: &str| match Path::new(path).canonicalize() {
        Ok(path) => path.display().to_string(),
        Err(_) => path.to_owned(),
    };
    if assets().contains(&name_or_path) {
        return name_or_path.to_owned();
    }
    match UrdfName::parse(name_or_path) {
        Some(mut urdf) => {
            urdf.path = path(&urdf.path);
            urdf.to_text()
        }
        None => path(name_or_path),
    }
}

/// Loads an arm from a file; prints warnings as [`find`] does.
///
/// # Errors
/// [`Failure::Model`].
pub fn load(path: &Path, strict: bool) -> Result<Description, Failure> {
    let description = Description::load(path)?.strict_if(strict)?;
    print_warnings(&description);
    completed(description)
}

/// Derives the settings that the arm's TOML lacks, and reports their number on standard error.
fn completed(description: Description) -> Result<Description, Failure> {
    let completed = description.completed()?;
    let estimates = completed.derived.iter();
    let estimates = estimates
        .filter(|derived| derived.key.ends_with("armature_kg_m2"))
        .count();
    let derived = completed.derived.len();
    if derived > 0 {
        let description = &completed.description;
        let mut line = format!(
            "{}: {derived} settings derived from the arm; `supple new` writes them with their reasons",
            description.name()
        );
        if estimates > 0 {
            line += &format!("; the rotor inertias of {estimates} joints are estimates");
        }
        print_once(&line);
        let paths = description.paths();
        if paths != Paths::PAPER {
            print_once(&format!(
                "{}: the paper's paths are placed about a point {:.3} m from the base's vertical axis, {:.3} m \
                 high, at {:.2} rad, {} times the paper's size",
                description.name(),
                paths.radius_m,
                paths.height_m,
                paths.azimuth_rad,
                paths.scale
            ));
        }
    }
    Ok(completed.description)
}

fn print_warnings(description: &Description) {
    for warning in description.warnings() {
        print_once(&format!("warning: {warning}"));
    }
}

/// Prints a line unless it has been printed: a command may load an arm more than once.
fn print_once(line: &str) {
    let mut printed = PRINTED_WARNINGS
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    if printed.insert(line.to_owned()) {
        print_status(line);
    }
}

#[derive(Serialize)]
struct Line {
    name: String,
    joints: Vec<String>,
    source: Option<String>,
}

/// Runs `supple arms`.
///
/// # Errors
/// [`Failure`] if an arm description is invalid, a file exists or cannot be written, or standard output cannot be
/// written.
pub fn run(args: &ArmsArgs) -> Result<(), Failure> {
    match &args.command {
        None => list(args.json),
        Some(ArmsCommand::Copy {
            arm,
            folder,
            all_joints_active,
            force,
        }) => copy(arm, folder, *all_joints_active, *force),
        Some(ArmsCommand::FromDh {
            table,
            urdf,
            convention,
            force,
        }) => from_dh(table, urdf, *convention, *force),
    }
}

fn from_dh(
    table: &Path,
    urdf: &Path,
    convention: DhConvention,
    force: bool,
) -> Result<(), Failure> {
    let text = supple_files::read_text(table, MAX_TABLE_BYTES)
        .map_err(|error| Failure::file("read", table, error))?;
    let of_table = |error| Failure::DhTable {
        file: table.to_owned(),
        error,
    };
    let rows = dh_rows_of_csv(&text).map_err(of_table)?;
    let stem = urdf.file_stem().map(|stem| stem.to_string_lossy());
    let written = urdf_of_dh(stem.as_deref().unwrap_or("arm"), convention, &rows);
    let written = written.map_err(of_table)?;
    if urdf.exists() && !force {
        let path = urdf.to_owned();
        return Err(Failure::Exists { path });
    }
    let written = with_default_limits(&written);
    supple_files::write_atomic(urdf, written.as_bytes())
        .map_err(|error| Failure::file("write", urdf, error))?;
    print_line(&format!(
        "{0}: {1} joints; for `identify` use it with --arm {0} --tip tool0. Its limits are placeholders: replace them before a controller \
         uses it",
        urdf.display(),
        rows.len()
    ))
}

fn copy(arm: &str, folder: &Path, all_joints_active: bool, force: bool) -> Result<(), Failure> {
    let mut description = find(arm, false)?;
    if all_joints_active {
        description = description.with_all_joints_active()?;
    }
    let existing = ["arm.toml", "arm.urdf"].map(|name| folder.join(name));
    if let (false, Some(path)) = (force, existing.into_iter().find(|path| path.exists())) {
        return Err(Failure::Exists { path });
    }
    description.save(folder)?;
    print_line(&format!(
        "{0}/arm.toml and {0}/arm.urdf; use it with --arm {0}",
        folder.display()
    ))
}

fn list(as_json: bool) -> Result<(), Failure> {
    let lines = assets()
        .iter()
        .map(|name| {
            let arm = Description::asset(name)?;
            Ok(Line {
                name: arm.name().to_owned(),
                joints: arm.joint_names().to_vec(),
                source: arm.settings().source.clone(),
            })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    if as_json {
        return print_json(&lines);
    }
    for line in lines {
        print_line(&format!(
            "{:8} {} joints: {}",
            line.name,
            line.joints.len(),
            line.joints.join(", ")
        ))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::absolute;

    #[test]
    fn an_absolute_name_keeps_the_tip() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().canonicalize().expect("there");
        let file = folder.join("robot.urdf");
        std::fs::write(&file, "<robot/>").expect("written");
        let detour = folder.join(".").join("robot.urdf");
        assert_eq!(
            absolute(&format!("{}#hand,repair", detour.display())),
            format!("{}#hand,repair", file.display())
        );
        assert_eq!(
            absolute(&folder.join(".").display().to_string()),
            folder.display().to_string()
        );
        assert_eq!(absolute("wam4"), "wam4");
    }
}
