//! `supple learning`: switches the refinement of the model, and saves the learned terms.

use super::system_request::{SystemRequest, running, send_and_print};
use crate::cli::{LearningAction, SystemArgs};
use serde::Serialize;
use std::path::Path;
use supple_cli::console::{print_json, print_line};
use supple_cli::exit::Failure;
use supple_core::controller::LearningSwitch;
use supple_model::Description;

/// Result of `learning save`, in the form that `--json` prints.
#[derive(Serialize)]
struct SaveResult<'a> {
    folder: &'a Path,
    source: Option<&'a str>,
}

/// Runs `supple learning`.
///
/// # Errors
/// [`Failure`].
pub fn learning(action: &LearningAction) -> Result<(), Failure> {
    let (system, switch) = match action {
        LearningAction::On(system) => (system, LearningSwitch::On),
        LearningAction::Off(system) => (system, LearningSwitch::Off),
        LearningAction::Reset(system) => (system, LearningSwitch::Reset),
        LearningAction::Save { folder, system } => return save(system, folder),
    };
    send_and_print(system, &SystemRequest::Learning(switch))
}

/// Copies the description of the arm with the learned terms, which the controller stores.
fn save(system: &SystemArgs, folder: &Path) -> Result<(), Failure> {
    let (domain, ..) = running(system)?;
    let kept = domain.learned_folder().join("arm.toml");
    if !kept.exists() {
        return Err(Failure::NothingLearned);
    }
    let learned = Description::load(kept)?;
    learned.save(folder)?;
    let source = learned.settings().learned.as_ref();
    let source = source.and_then(|learned| learned.source.as_deref());
    match system.json {
        true => print_json(&SaveResult { folder, source }),
        false => {
            let folder = folder.display();
            let source = source.unwrap_or_default();
            print_line(&format!(
                "wrote arm.toml and arm.urdf to {folder}: {source}"
            ))
        }
    }
}
