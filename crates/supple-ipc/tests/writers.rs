//! Who else writes a service is not heard: readers take the messages of whoever holds the writer's lock.

mod support;

use core::time::Duration;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::*;
use supple_ipc::message::{ArmState, TorqueCommand};
use supple_ipc::{ControllerLink, PlantLink};
use support::{System, answer, state, system};

const SOON: Duration = Duration::from_secs(5);
const MOMENT: Duration = Duration::from_millis(1);

/// A program that takes a free place of a service, as the library lets it, and knows nothing of locks.
struct Stranger<T: core::fmt::Debug + ZeroCopySend + 'static> {
    publisher: Publisher<ipc::Service, T, ()>,
}

impl<T: core::fmt::Debug + Copy + ZeroCopySend + 'static> Stranger<T> {
    fn new(system: &System, service: &str) -> Self {
        let mut config = Config::default();
        let root = Path::new(system.folder.as_os_str().as_encoded_bytes()).expect("a path");
        config.global.set_root_path(&root);
        let objects = system.domain.objects();
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
            .expect("it is there");
        let publisher = service.publisher_builder().create();
        Stranger {
            publisher: publisher.expect("there is a place"),
        }
    }

    fn send(&self, message: T) {
        let sample = self.publisher.loan_uninit().expect("memory");
        let reached = sample.write_payload(message).send().expect("sent");
        assert_eq!(reached, 1, "it would be read");
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
fn torques_of_a_stranger_are_dropped_and_counted() {
    let system = system("strange-torque");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let stranger = Stranger::new(&system, "torque_command");
    for cycle in 0..50 {
        plant.publish(&state(cycle)).expect("published");
        // Before the controller, with a torque of its own, as nobody, and with a guess.
        for writer in [0, 1 + cycle] {
            stranger.send(TorqueCommand {
                writer,
                torque_nm: [20.0; 7],
                ..command(cycle)
            });
        }
        controller.answer(&command(cycle)).expect("answered");
        let heard = plant.answer(cycle, SOON).expect("read");
        assert_eq!(heard.answer, Some(command(cycle)));
        assert_eq!(heard.late, 0);
        let after = plant.answer(cycle, Duration::ZERO).expect("read");
        assert_eq!(after.answer, None);
    }
    // Without the controller nobody answers.
    plant.publish(&state(50)).expect("published");
    stranger.send(command(50));
    let heard = plant.answer(50, MOMENT).expect("read");
    assert_eq!(heard.answer, None);
    assert_eq!(plant.foreign(), 101);
}

#[test]
fn states_of_a_stranger_are_dropped_and_counted() {
    let system = system("strange-state");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let stranger = Stranger::new(&system, "arm_state");
    for cycle in 0..50 {
        stranger.send(ArmState {
            writer: cycle,
            position_rad: [1.0; 7],
            ..state(cycle)
        });
        plant.publish(&state(cycle)).expect("published");
        let received = controller.wait(SOON).expect("read");
        assert_eq!(received, Some(state(cycle)));
        assert_eq!(controller.receive().expect("read"), None);
    }
    stranger.send(state(50));
    assert_eq!(controller.wait(MOMENT).expect("read"), None);
    assert_eq!(controller.foreign(), 51);
}

/// What one of them has sent is not taken for the other's, in either order.
#[test]
fn a_controller_in_the_place_of_another_is_heard() {
    let system = system("next-writer");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    for cycle in 0..5 {
        let controller = ControllerLink::new(&system.domain).expect("the only controller");
        plant.publish(&state(cycle)).expect("published");
        assert_eq!(controller.wait(SOON).expect("read"), Some(state(cycle)));
        controller.answer(&command(cycle)).expect("answered");
        let heard = plant.answer(cycle, SOON).expect("read");
        assert_eq!(heard.answer, Some(command(cycle)));
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
        // Beyond the arm's own joints nothing is meant.
        let mut beyond = command(0);
        beyond.torque_nm[4] = nonsense;
        assert!(beyond.is_usable::<4>());
    }
}
