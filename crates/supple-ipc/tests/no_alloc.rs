//! Tests that publishing and receiving on the shared-memory services allocate no memory.

#[path = "../../../tests/support/counting.rs"]
mod counting;
mod support;

use core::time::Duration;
use counting::count_allocations;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::*;
use supple_ipc::*;

#[test]
fn the_allocation_counter_counts_an_allocation() {
    assert_eq!(
        count_allocations(|| drop(std::hint::black_box(Box::new(1)))),
        2
    );
    assert_eq!(count_allocations(|| {}), 0);
}

#[test]
fn a_thousand_cycles_allocate_nothing() {
    let system = support::system("no-alloc");
    let plant = PlantLink::new(&system.domain).expect("a plant");
    let controller = ControllerLink::new(&system.domain).expect("a controller");
    let server = OperatorServer::new(&system.domain, Backpressure::Drop).expect("a controller");
    let mut reader = TelemetryReader::new(&system.domain).expect("a reader");
    let mut operator = OperatorClient::new(&system.domain).expect("an operator");
    let input = support::state(0).input::<4>(None).expect("four joints");
    let output = support::answer(&input);
    let state = support::state(0);
    let soon = Duration::from_secs(5);
    let mut cycle = |k: u64| {
        let mut state = state;
        state.cycle = k;
        plant.announce().expect("announced");
        assert_eq!(
            controller.wait_for_event(soon).expect("read"),
            WakeEvent::Announced
        );
        plant.publish(&state).expect("published");
        let received = controller.wait(soon).expect("read").expect("a state");
        let mut command = TorqueCommand::new(&output, false);
        command.cycle = received.cycle;
        controller.answer(&command).expect("answered");
        let received = plant.answer(k, soon).expect("read");
        assert!(received.answer.is_some());
        let timing = CycleTiming::default();
        let telemetry = Telemetry::new(k, &state, &input, &output, timing);
        server.publish(&telemetry).expect("published");
        assert!(reader.receive().expect("read").is_some());
        let sequence = operator
            .send::<4>(&Request::GravityHold, None)
            .expect("sent")
            .expect("a controller is connected");
        let request = server.request().expect("read").expect("a request");
        let reply = OperatorReply::new(&request, k, Mode::Idle, Outcome::Accepted, Text::EMPTY);
        server.reply(&reply).expect("replied");
        let reply = operator.receive().expect("read").expect("a reply");
        assert_eq!(reply.sequence, sequence);
        // Waits without a message are included, polling and blocking.
        assert!(controller.wait(Duration::ZERO).expect("read").is_none());
        if k.is_multiple_of(100) {
            let moment = Duration::from_micros(200);
            assert!(controller.wait(moment).expect("read").is_none());
            assert!(plant.answer(k, moment).expect("read").answer.is_none());
        }
    };
    // The first cycles connect both sides and are not counted.
    (0..4).for_each(&mut cycle);
    assert_eq!(count_allocations(|| (4..1004).for_each(&mut cycle)), 0);
}
