//! Whoever is the last to leave a system leaves nothing behind; whoever leaves earlier disturbs nobody.

mod support;

use core::time::Duration;
use std::os::unix::fs::PermissionsExt;
use supple_ipc::message::TorqueCommand;
use supple_ipc::{ControllerLink, Full, Operator, OutsideLink, PlantLink, TelemetryReader};

const NONE: [&str; 0] = [];

#[test]
fn the_last_leaves_nothing() {
    let system = support::system("last");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let outside = OutsideLink::new(&system.domain, Full::Lose).expect("a controller");
    let operator = Operator::new(&system.domain).expect("an operator");
    let reader = TelemetryReader::new(&system.domain).expect("a reader");
    assert_ne!(support::objects(&system.domain), NONE);
    drop((operator, plant, outside, reader));
    assert_ne!(support::objects(&system.domain), NONE, "one is still there");
    drop(controller);
    assert_eq!(support::objects(&system.domain), NONE);
}

#[test]
fn who_leaves_earlier_disturbs_nobody() {
    let system = support::system("earlier");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    for cycle in 0..10 {
        drop(Operator::new(&system.domain).expect("an operator"));
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
        let heard = plant.answer(cycle, Duration::from_secs(5)).expect("read");
        assert!(heard.answer.is_some());
    }
}

/// Many that come and go at once, of a system that runs: nobody is refused, and nothing is left in the end.
#[test]
fn coming_and_going_at_once_is_safe() {
    let system = support::system("at-once");
    let controller = OutsideLink::new(&system.domain, Full::Lose).expect("a controller");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..25 {
                    drop(Operator::new(&system.domain).expect("an operator"));
                }
            });
        }
    });
    drop(controller);
    assert_eq!(support::objects(&system.domain), NONE);
}

#[test]
fn the_lock_is_the_owners_alone() {
    let system = support::system("lock");
    drop(PlantLink::new(&system.domain).expect("a plant"));
    let name = format!("{}.turn.lock", system.domain.prefix());
    let lock = std::fs::metadata(system.folder.join(name)).expect("a lock");
    assert_eq!(lock.permissions().mode() & 0o777, 0o600);
}
