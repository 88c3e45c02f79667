//! Tests that shared memory is allocated at the start and belongs to this user.

use crate::support::{objects, state, system};
use std::fs::Permissions;
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;
use supple_ipc::{
    Backpressure, ControllerLink, Domain, OperatorClient, OperatorServer, PlantLink,
    TelemetryReader,
};
use tempfile::TempDir;

/// All pages of every object are allocated, so that no control cycle allocates one.
#[test]
fn all_pages_are_allocated_at_the_start() {
    let system = system("reserved");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let _controller = ControllerLink::new(&system.domain).expect("a controller");
    let _server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let _reader = TelemetryReader::new(&system.domain).expect("a reader");
    let _operator = OperatorClient::new(&system.domain).expect("an operator");
    plant.publish(&state(0)).expect("published");
    let names = objects(&system.domain);
    assert!(names.len() > 10, "{names:?}");
    for name in names {
        let about = std::fs::metadata(format!("/dev/shm/{name}")).expect("there");
        assert!(about.blocks() * 512 >= about.len(), "{name}: {about:?}");
    }
}

/// A file that the test created in /dev/shm; dropping this value removes the file.
struct RemovedOnDrop(PathBuf);

impl Drop for RemovedOnDrop {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Creates a file that belongs to another user; `None` if this user may not change the owner of a file.
fn create_file_of_another_user(name: &str, bytes: &[u8]) -> Option<RemovedOnDrop> {
    let file = RemovedOnDrop(PathBuf::from(format!("/dev/shm/{name}")));
    std::fs::write(&file.0, bytes).expect("written");
    match chown(&file.0, Some(65534), Some(65534)) {
        Ok(()) => Some(file),
        Err(error) => {
            println!("skipped: this user may not change the owner of a file: {error}");
            None
        }
    }
}

#[test]
fn files_of_another_user_with_our_prefix_are_ignored_and_kept() {
    let system = system("squatted");
    let begin = system.domain.object_prefix();
    let Some(empty) = create_file_of_another_user(&format!("{begin}not_ours"), b"") else {
        return;
    };
    let full = create_file_of_another_user(&format!("{begin}nor_this"), b"nonsense");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    assert!(plant.publish(&state(0)).expect("published"));
    assert_eq!(controller.receive().expect("read"), Some(state(0)));
    drop((plant, controller));
    assert!(empty.0.exists() && full.is_some_and(|full| full.0.exists()));
}

/// Environment variable that gives a child process of this test its folder.
const FOLDER: &str = "SUPPLE_TEST_SHARED_MEMORY_FOLDER";

/// A plant process that runs as another user and prints its shared-memory objects, or the error; not a test itself.
#[test]
#[ignore = "a process of the test below"]
fn plant_process() {
    let folder = std::env::var(FOLDER).expect("a folder");
    let domain = Domain::in_folder(std::path::Path::new(&folder), "planted").expect("a domain");
    match PlantLink::new(&domain) {
        Ok(_plant) => println!("objects {}", objects(&domain).join(" ")),
        Err(error) => println!("refused {error}"),
    }
}

/// Runs a plant as user 65534 and returns its output; `None` if this user may not start processes of other users.
fn plant_of_another_user(folder: &TempDir) -> Option<String> {
    let output = Command::new(std::env::current_exe().expect("this test"))
        .args([
            "--ignored",
            "--nocapture",
            "--exact",
            "shared_memory::plant_process",
        ])
        .env(FOLDER, folder.path())
        .uid(65534)
        .gid(65534)
        .output();
    let output = output.ok().filter(|output| output.status.success())?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = said
        .lines()
        .find(|line| line.contains("objects ") || line.contains("refused "));
    line.map(str::to_owned)
}

/// Another user has created the objects that a service needs, and all users can access them.
#[test]
fn object_of_another_user_is_never_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let owned = chown(folder.path(), Some(65534), Some(65534));
    let first = owned.ok().and_then(|()| plant_of_another_user(&folder));
    let Some(first) = first else {
        println!("skipped: this user may not start processes of other users");
        return;
    };
    let names: Vec<&str> = first
        .split(' ')
        .filter(|name| name.ends_with(".dynamic") || name.ends_with(".global_mgmt"))
        .collect();
    assert!(names.len() >= 3, "{first}");
    let planted: Vec<RemovedOnDrop> = names
        .iter()
        .map(|name| RemovedOnDrop(PathBuf::from(format!("/dev/shm/{name}"))))
        .collect();
    for file in &planted {
        std::fs::write(&file.0, [0; 4096]).expect("written");
        std::fs::set_permissions(&file.0, Permissions::from_mode(0o666)).expect("changed");
    }
    let second = plant_of_another_user(&folder).expect("it runs");
    for part in ["refused", "/dev/shm/planted_65534_", "user 0", "--prefix"] {
        assert!(second.contains(part), "{part}: {second}");
    }
    drop(planted);
    let third = plant_of_another_user(&folder).expect("it runs");
    assert!(third.contains("objects"), "{third}");
}
