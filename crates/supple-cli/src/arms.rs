//! Loads arm descriptions, built in or from files; `supple arms`.

use crate::arguments::{ArmsArgs, ArmsCommand};
use crate::console::{print_json, print_line, print_status};
use crate::exit::Failure;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use supple_model::{Description, assets};

/// Warnings that were already printed.
static PRINTED_WARNINGS: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Loads a built-in arm by name, or an arm from a file. A built-in name takes precedence; write `./wam4` for a path.
/// Unread URDF content is reported on standard error, or is an error if `strict` is set.
///
/// # Errors
/// [`Failure::UnknownArm`] or [`Failure::Model`].
pub fn find(name_or_path: &str, strict: bool) -> Result<Description, Failure> {
    if assets().contains(&name_or_path) {
        return Ok(Description::asset(name_or_path)?);
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

/// Loads an arm from a file. Warnings as for [`find`].
///
/// # Errors
/// [`Failure::Model`].
pub fn load(path: &Path, strict: bool) -> Result<Description, Failure> {
    let description = Description::load(path)?.strict_if(strict)?;
    let mut printed = PRINTED_WARNINGS
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    for warning in description.warnings() {
        let line = format!("warning: {warning}");
        // A command may load an arm more than once.
        if printed.insert(line.clone()) {
            print_status(&line);
        }
    }
    Ok(description)
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
    }
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
