//! Tests that readers accept only messages of the process that holds the writer lock.

use crate::support::{System, answer, state, system};
use core::time::Duration;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::*;
use supple_ipc::message::{ArmState, TorqueCommand};
use supple_ipc::{ControllerLink, PlantLink};

const TIMEOUT: Duration = Duration::from_secs(5);
const SHORT_TIMEOUT: Duration = Duration::from_millis(1);

/// A program that uses a free writer slot of a service, which iceoryx2 allows, and ignores the writer lock.
struct ForeignWriter<T: core::fmt::Debug + ZeroCopySend + 'static> {
    publisher: Publisher<ipc::Service, T, ()>,
}

impl<T: core::fmt::Debug + Copy + ZeroCopySend + 'static> ForeignWriter<T> {
    fn new(system: &System, service: &str) -> Self {
        let mut config = Config::default();
        let root = Path::new(system.folder.as_os_str().as_encoded_bytes()).expect("a path");
        config.global.set_root_path(&root);
        let objects = system.domain.object_prefix();
        config.global.prefix = FileName::new(objects.as_bytes()).expect("a name");
        config
            .defaults
            .publish_subscribe
            .subscriber_expired_connection_buffer = 8;
        let node = NodeBuilder::new().config(&config);
        let node = node.create::<ipc::Service>().expect("a node");
        let service = node
            .service_builder(&service.try_into().expect("a name"))
            .publish_subscribe::<T>()
            .open()
            .expect("the service exists");
        let publisher = service.publisher_builder().create();
        ForeignWriter {
            publisher: publisher.expect("a free slot"),
        }
    }

    fn send(&self, message: T) {
        let sample = self.publisher.loan_uninit().expect("memory");
        let reached = sample.write_payload(message).send().expect("sent");
        assert_eq!(reached, 1, "the reader is connected");
    }
}

fn command(cycle: u64) -> TorqueCommand {
    let output = answer(&state(0).input(None).expect("four joints"));
    TorqueCommand {
        cycle,
        ..TorqueCommand::new(&output, false)
    }
}

#[test]
fn torques_of_a_foreign_writer_are_rejected_and_counted() {
    let system = system("foreign-torque");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let foreign = ForeignWriter::new(&system, "torque_command");
    for cycle in 0..50 {
        plant.publish(&state(cycle)).expect("published");
        // The foreign writer sends another torque before the controller's answer, with writer id zero and with a guessed id.
        for writer in [0, 1 + cycle] {
            foreign.send(TorqueCommand {
                writer,
                torque_nm: [20.0; 7],
                ..command(cycle)
            });
        }
        controller.answer(&command(cycle)).expect("answered");
        let received = plant.answer(cycle, TIMEOUT).expect("read");
        assert_eq!(received.answer, Some(command(cycle)));
        assert_eq!(received.late, 0);
        let after = plant.answer(cycle, Duration::ZERO).expect("read");
        assert_eq!(after.answer, None);
    }
    // A foreign command does not replace a missing answer of the controller.
    plant.publish(&state(50)).expect("published");
    foreign.send(command(50));
    let received = plant.answer(50, SHORT_TIMEOUT).expect("read");
    assert_eq!(received.answer, None);
    assert_eq!(plant.foreign(), 101);
}

#[test]
fn states_of_a_foreign_writer_are_rejected_and_counted() {
    let system = system("foreign-state");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let foreign = ForeignWriter::new(&system, "arm_state");
    for cycle in 0..50 {
        foreign.send(ArmState {
            writer: cycle,
            position_rad: [1.0; 7],
            ..state(cycle)
        });
        plant.publish(&state(cycle)).expect("published");
        let received = controller.wait(TIMEOUT).expect("read");
        assert_eq!(received, Some(state(cycle)));
        assert_eq!(controller.receive().expect("read"), None);
    }
    foreign.send(state(50));
    assert_eq!(controller.wait(SHORT_TIMEOUT).expect("read"), None);
    assert_eq!(controller.foreign(), 51);
}

/// Neither messages of an earlier controller nor messages of its replacement count as foreign.
#[test]
fn a_replacement_controller_is_accepted() {
    let system = system("next-writer");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    for cycle in 0..5 {
        let controller = ControllerLink::new(&system.domain).expect("the only controller");
        plant.publish(&state(cycle)).expect("published");
        assert_eq!(controller.wait(TIMEOUT).expect("read"), Some(state(cycle)));
        controller.answer(&command(cycle)).expect("answered");
        let received = plant.answer(cycle, TIMEOUT).expect("read");
        assert_eq!(received.answer, Some(command(cycle)));
    }
    assert_eq!(plant.foreign(), 0);
}

#[test]
fn a_command_that_is_not_finite_or_of_another_arm_is_not_usable() {
    assert!(command(0).is_usable::<4>());
    assert!(!command(0).is_usable::<3>());
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for joint in 0..4 {
            let mut torque = command(0);
            torque.torque_nm[joint] = nonsense;
            assert!(!torque.is_usable::<4>());
            let mut fallback = command(0);
            fallback.fallback_torque_nm[joint] = nonsense;
            assert!(!fallback.is_usable::<4>());
        }
        // Entries beyond the arm's joints are ignored.
        let mut beyond = command(0);
        beyond.torque_nm[4] = nonsense;
        assert!(beyond.is_usable::<4>());
    }
}
