//! Publishing and receiving allocate nothing, on the real services.

#[path = "../../../tests/support/counting.rs"]
mod counting;
mod support;

use core::time::Duration;
use counting::counted;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::*;
use supple_ipc::*;

#[test]
fn the_counter_counts() {
    assert_eq!(counted(|| drop(std::hint::black_box(Box::new(1)))), 2);
    assert_eq!(counted(|| {}), 0);
}

#[test]
fn a_thousand_cycles_allocate_nothing() {
    let system = support::system("no-alloc");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let outside = OutsideLink::new(&system.domain, Full::Lose).expect("a controller");
    let mut reader = TelemetryReader::new(&system.domain).expect("a reader");
    let mut operator = Operator::new(&system.domain).expect("an operator");
    let input = support::state(0).input::<4>(None).expect("four joints");
    let output = support::answer(&input);
    let state = support::state(0);
    let soon = Duration::from_secs(5);
    let mut cycle = |k: u64| {
        let mut state = state;
        state.cycle = k;
        plant.announce().expect("announced");
        assert_eq!(controller.wake(soon).expect("read"), Woken::Announced);
        plant.publish(&state).expect("published");
        let received = controller.wait(soon).expect("read").expect("a state");
        let mut command = TorqueCommand::new(&output, false);
        command.cycle = received.cycle;
        controller.answer(&command).expect("answered");
        let heard = plant.answer(k, soon).expect("read");
        assert!(heard.answer.is_some());
        let timing = CycleTiming::default();
        let telemetry = Telemetry::new(k, &state, &input, &output, timing);
        outside.publish(&telemetry).expect("published");
        assert!(reader.receive().expect("read").is_some());
        let sequence = operator
            .send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .expect("there is a controller");
        let request = outside.request().expect("read").expect("a request");
        let reply = OperatorReply::new(&request, k, Mode::Idle, Outcome::Accepted, Text::EMPTY);
        outside.reply(&reply).expect("replied");
        let reply = operator.receive().expect("read").expect("a reply");
        assert_eq!(reply.sequence, sequence);
        // Waits in vain as well, with and without sleep.
        assert!(controller.wait(Duration::ZERO).expect("read").is_none());
        if k.is_multiple_of(100) {
            let moment = Duration::from_micros(200);
            assert!(controller.wait(moment).expect("read").is_none());
            assert!(plant.answer(k, moment).expect("read").answer.is_none());
        }
    };
    // Both sides meet at the first.
    (0..4).for_each(&mut cycle);
    assert_eq!(counted(|| (4..1004).for_each(&mut cycle)), 0);
}
