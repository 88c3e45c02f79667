//! Creates a separate system for each test.

#![allow(dead_code, reason = "each test program uses only some of these items")]

use std::path::PathBuf;
use supple_core::Input;
use supple_core::math::Vector3;
use supple_core::{Controller, Output, State, step};
use supple_ipc::Domain;
use supple_ipc::message::{ArmState, Drives, PlantReport};
use supple_model::Description;
use tempfile::TempDir;

pub struct System {
    pub domain: Domain,
    pub folder: PathBuf,
    _guard: TempDir,
}

/// Creates a system with a prefix that no other test uses at the same time.
pub fn system(prefix: &str) -> System {
    let guard = tempfile::Builder::new()
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700))
        .tempdir()
        .expect("a folder");
    let prefix = format!("{prefix}-{}", std::process::id());
    System {
        domain: Domain::in_folder(guard.path(), &prefix).expect("a domain"),
        folder: guard.path().to_owned(),
        _guard: guard,
    }
}

/// Returns a state of the 4-joint arm in its home pose.
pub fn state(cycle: u64) -> ArmState {
    let home = Description::asset("wam4").expect("built in");
    let home = home.home::<4>().expect("four joints");
    let position_rad = core::array::from_fn(|i| Some(home[i]));
    let force = Some(Vector3::new(0.1, -0.2, 0.3));
    let plant = PlantReport {
        missed: 3,
        wake_ns: 1200,
        ..PlantReport::default()
    };
    ArmState::new::<4>(
        cycle,
        cycle * 1_000_000,
        &position_rad,
        force,
        Drives::Active,
        plant,
    )
}

/// Computes the first output of a controller of the 4-joint arm.
pub fn answer(input: &Input<4>) -> Output<4> {
    let description = Description::asset("wam4").expect("built in");
    let controller = Controller::new(description.config().expect("valid")).expect("valid");
    step(&controller, &mut State::new(&controller), input)
}

/// Lists the shared-memory objects of a system.
pub fn objects(domain: &Domain) -> Vec<String> {
    let names = std::fs::read_dir("/dev/shm").expect("shared memory");
    let names = names.map(|entry| entry.expect("an entry").file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    names
        .filter(|name| name.starts_with(&domain.object_prefix()))
        .collect()
}
