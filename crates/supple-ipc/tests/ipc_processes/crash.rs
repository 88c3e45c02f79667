//! Tests that a killed process can be replaced without a restart of the other processes.

use crate::support;
use core::time::Duration;
use std::process::{Child, Command, Stdio};
use supple_ipc::message::{ArmState, TorqueCommand};
use supple_ipc::{ControllerLink, Domain, PlantLink};

const FOLDER: &str = "SUPPLE_IPC_TEST_FOLDER";
const PREFIX: &str = "SUPPLE_IPC_TEST_PREFIX";

/// The controller process that [`a_killed_controller_is_replaced`] starts and kills; not a test itself.
#[test]
#[ignore = "started by another test"]
fn controller_process() {
    let folder = std::env::var(FOLDER).expect("started by the test");
    let prefix = std::env::var(PREFIX).expect("started by the test");
    let domain = Domain::in_folder(folder.as_ref(), &prefix).expect("a domain");
    let controller = ControllerLink::new(&domain).expect("a controller");
    loop {
        if let Some(state) = controller.wait(Duration::from_secs(1)).expect("read") {
            let output = support::answer(&state.input(None).expect("four joints"));
            let command = TorqueCommand::new(&output, false);
            controller.answer(&command).expect("answered");
        }
    }
}

fn start(system: &support::System) -> Child {
    Command::new(std::env::current_exe().expect("this test"))
        .args([
            "--ignored",
            "--nocapture",
            "--exact",
            "crash::controller_process",
        ])
        .env(FOLDER, &system.folder)
        .env(PREFIX, system.domain.prefix())
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts")
}

/// Runs cycles until an answer arrives and returns its cycle; panics after 2000.
fn until_answered(plant: &PlantLink, from: u64) -> u64 {
    for cycle in from..from + 2000 {
        let state = ArmState {
            cycle,
            ..support::state(0)
        };
        plant.publish(&state).expect("published");
        let received = plant.answer(cycle, Duration::from_millis(10));
        if received.expect("read").answer.is_some() {
            return cycle;
        }
    }
    panic!("no answer arrived");
}

#[test]
fn a_killed_controller_is_replaced() {
    let system = support::system("crash");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let mut cycle = 0;
    for _ in 0..3 {
        let mut child = start(&system);
        cycle = until_answered(&plant, cycle) + 1;
        child.kill().expect("SIGKILL");
        child.wait().expect("the process ended");
        let state = ArmState {
            cycle,
            ..support::state(0)
        };
        plant
            .publish(&state)
            .expect("publishing without a live reader succeeds");
        let received = plant.answer(cycle, Duration::from_millis(5));
        assert_eq!(received.expect("read").answer, None);
        cycle += 1;
    }
    // The last controller was killed too; the last process that leaves removes the objects of the controller.
    drop(plant);
    assert_eq!(support::objects(&system.domain), [""; 0]);
}

/// A controller may be killed at any moment of its start; the next one finds the system usable.
#[test]
fn a_controller_killed_while_it_joins_is_replaced() {
    let system = support::system("joining");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    for tenths_ms in 0..120 {
        let mut child = start(&system);
        supple_realtime::pause(Duration::from_micros(100 * tenths_ms));
        child.kill().expect("SIGKILL");
        child.wait().expect("the process ended");
        plant.publish(&support::state(0)).expect("published");
        plant.answer(0, Duration::ZERO).expect("read");
    }
    let mut child = start(&system);
    until_answered(&plant, 0);
    child.kill().expect("SIGKILL");
    child.wait().expect("the process ended");
    drop(plant);
    assert_eq!(support::objects(&system.domain), [""; 0]);
}

/// A process that is killed between creating an object and setting its size leaves an object of size zero.
#[test]
fn objects_of_size_zero_do_not_block_a_join() {
    let system = support::system("no-size");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let names = support::objects(&system.domain);
    drop(plant);
    assert!(!names.is_empty());
    for name in names {
        std::fs::write(format!("/dev/shm/{name}"), []).expect("made");
    }
    let (sender, receiver) = std::sync::mpsc::channel();
    let domain = system.domain.clone();
    std::thread::spawn(move || sender.send(PlantLink::new(&domain).map(drop)));
    let joined = receiver.recv_timeout(Duration::from_secs(30));
    joined.expect("joining ends in time").expect("a plant");
    assert_eq!(support::objects(&system.domain), [""; 0]);
}
