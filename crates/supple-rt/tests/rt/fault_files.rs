//! Tests of the fault tables: recording never waits for the disk, and old tables are deleted.

use core::time::Duration;
use std::fs;
use std::sync::mpsc::sync_channel;
use supple_core::controller::CycleRecord;
use supple_core::math::Vector3;
use supple_core::{Controller, Input, State, step};
use supple_ipc::message::{ArmState, CycleTiming, Drives, PlantReport, Telemetry};
use supple_model::Description;
use supple_rt::{FaultFiles, FaultRecorder, KEPT_FILES};

/// Returns telemetry of one cycle, with or without a latched fault.
fn telemetry(step_number: u64, fault: u8) -> Telemetry {
    let description = Description::asset("wam4").expect("built in");
    let controller: Controller<4> =
        Controller::new(description.config().expect("valid")).expect("valid");
    let home = description.home::<4>().expect("four joints");
    let input = Input {
        cycle: 0,
        position_rad: core::array::from_fn(|i| Some(home[i])),
        tip_force_n: Some(Vector3::zeros()),
        drives_active: true,
        request: None,
    };
    let output = step(&controller, &mut State::new(&controller), &input);
    let state = ArmState::new(
        0,
        0,
        &input.position_rad,
        None,
        Drives::Active,
        PlantReport::default(),
    );
    let record = CycleRecord {
        fault,
        ..CycleRecord::new(step_number, &input, &output)
    };
    Telemetry::of(&record, &state, CycleTiming::default())
}

/// A job that blocks the writer thread simulates a disk that does not answer.
#[test]
fn recording_does_not_wait_for_a_hanging_disk_and_counts_dropped_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let faults = folder.path().join("faults");
    let files = FaultFiles::start(faults.clone()).expect("a thread");
    let (unblock, blocked) = sync_channel::<()>(0);
    let (started, has_started) = sync_channel(1);
    assert!(files.writer().submit(move || {
        started.send(()).expect("the test receives");
        blocked.recv().expect("the test unblocks it");
    }));
    has_started.recv().expect("it starts");
    let mut recorder = FaultRecorder::new(files);
    let without_fault = telemetry(0, 0);
    for step in 0..5 {
        recorder.add(&telemetry(step, 1));
        recorder.add(&without_fault);
    }
    // Five faults were recorded; two tables wait for the disk.
    assert_eq!(recorder.files().dropped(), 3);
    assert!(!faults.exists());
    unblock.send(()).expect("the disk is still blocked");
    recorder.finish(Duration::from_secs(60));
    let names = fs::read_dir(&faults).expect("there").count();
    assert_eq!(names, 2);
}

#[test]
fn only_the_newest_tables_and_other_files_are_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    for step in 0..30 {
        fs::write(path.join(format!("fault-1-{step}.csv")), "old").expect("written");
    }
    let others = ["fault-1-2.txt", "fault-x-2.csv", "fault-.csv", "notes.csv"];
    for other in others {
        fs::write(path.join(other), "kept").expect("written");
    }
    let files = FaultFiles::start(path.to_owned()).expect("a thread");
    let mut recorder = FaultRecorder::new(files);
    recorder.add(&telemetry(77, 1));
    recorder.finish(Duration::from_secs(60));
    let mut names: Vec<String> = fs::read_dir(path)
        .expect("readable")
        .map(|entry| entry.expect("an entry").file_name())
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.retain(|name| !others.contains(&name.as_str()));
    assert_eq!(names.len(), KEPT_FILES);
    let newest = format!("fault-{}-77.csv", std::process::id());
    assert!(names.contains(&newest), "{names:?}");
    assert!(others.iter().all(|other| path.join(other).exists()));
}
