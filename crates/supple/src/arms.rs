//! Built-in arms and others.

use crate::console::{remark, say, say_json};
use crate::exit::Failure;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use supple_model::{Description, assets};

/// Warnings that were said.
static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// A built-in arm by its name, or one from a file. A built-in name wins; `./wam4` is a path. What its URDF
/// holds and is not read is said on standard error, or refused where `strict` is set.
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

/// One from a file, as [`find`].
///
/// # Errors
/// [`Failure::Model`].
pub fn load(path: &Path, strict: bool) -> Result<Description, Failure> {
    let description = Description::load(path)?.strict_if(strict)?;
    let mut said = SAID.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    for warning in description.warnings() {
        let line = format!("warning: {warning}");
        // A command may load an arm more than once.
        if said.insert(line.clone()) {
            remark(&line);
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

/// Lists the built-in arms.
///
/// # Errors
/// [`Failure`] where an arm is not sound or standard output cannot be written.
pub fn list(as_json: bool) -> Result<(), Failure> {
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
        return say_json(&lines);
    }
    for line in lines {
        say(&format!(
            "{:8} {} joints: {}",
            line.name,
            line.joints.len(),
            line.joints.join(", ")
        ))?;
    }
    Ok(())
}
