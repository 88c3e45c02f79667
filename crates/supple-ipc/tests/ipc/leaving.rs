//! The last process that leaves removes all shared memory; a process that leaves earlier does not affect the others.

use crate::support;
use core::time::Duration;
use std::os::unix::fs::PermissionsExt;
use supple_ipc::message::TorqueCommand;
use supple_ipc::{
    Backpressure, ControllerLink, OperatorClient, OperatorServer, PlantLink, TelemetryReader,
};

const NONE: [&str; 0] = [];

#[test]
fn last_process_removes_all_objects() {
    let system = support::system("last");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let operator = OperatorClient::new(&system.domain).expect("an operator");
    let reader = TelemetryReader::new(&system.domain).expect("a reader");
    assert_ne!(support::objects(&system.domain), NONE);
    drop((operator, plant, server, reader));
    assert_ne!(
        support::objects(&system.domain),
        NONE,
        "one process is still connected"
    );
    drop(controller);
    assert_eq!(support::objects(&system.domain), NONE);
}

#[test]
fn a_process_that_leaves_does_not_affect_the_others() {
    let system = support::system("earlier");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    for cycle in 0..10 {
        drop(OperatorClient::new(&system.domain).expect("an operator"));
        drop(TelemetryReader::new(&system.domain).expect("a reader"));
        let mut state = support::state(0);
        state.cycle = cycle;
        plant.publish(&state).expect("published");
        let seen = controller.wait(Duration::from_secs(5));
        let seen = seen.expect("read").expect("a state");
        let output = support::answer(&seen.input(None).expect("four joints"));
        let mut command = TorqueCommand::new(&output, false);
        command.cycle = cycle;
        controller.answer(&command).expect("answered");
        let received = plant.answer(cycle, Duration::from_secs(5)).expect("read");
        assert!(received.answer.is_some());
    }
}

/// Each process that has ended leaves an empty folder, and every process that joins lists all folders, which delays it. Only
/// old and empty folders are removed: another folder may belong to a process that is joining.
#[test]
fn folders_of_ended_processes_are_removed() {
    let system = support::system("folders");
    let reader = TelemetryReader::new(&system.domain).expect("a reader");
    let nodes = system.domain.folder().join("nodes");
    let folder = |name: &str, age_s: u64| {
        let folder = nodes.join(name);
        std::fs::create_dir(&folder).expect("a folder");
        let opened = std::fs::File::open(&folder).expect("opened");
        let modified = opened.metadata().and_then(|found| found.modified());
        let before = modified.expect("a time") - Duration::from_secs(age_s);
        (folder, opened, before)
    };
    let (old, old_file, long_ago) = folder("1", 3600);
    let (new, ..) = folder("2", 0);
    let (used, used_file, _) = folder("3", 0);
    std::fs::write(used.join("details"), "").expect("a file");
    old_file.set_modified(long_ago).expect("the time is set");
    used_file.set_modified(long_ago).expect("the time is set");
    drop(OperatorClient::new(&system.domain).expect("an operator"));
    assert!(!old.exists() && new.exists() && used.join("details").exists());
    drop(reader);
}

/// Many clients join and leave a running system concurrently: no client is refused, and no object remains at the end.
#[test]
fn concurrent_join_and_leave_is_safe() {
    let system = support::system("at-once");
    let controller = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..25 {
                    drop(OperatorClient::new(&system.domain).expect("an operator"));
                }
            });
        }
    });
    drop(controller);
    assert_eq!(support::objects(&system.domain), NONE);
}

#[test]
fn only_the_owner_can_open_the_lock() {
    let system = support::system("lock");
    drop(PlantLink::new(&system.domain).expect("a plant"));
    let name = format!("{}.membership.lock", system.domain.prefix());
    let lock = std::fs::metadata(system.folder.join(name)).expect("a lock");
    assert_eq!(lock.permissions().mode() & 0o777, 0o600);
}
