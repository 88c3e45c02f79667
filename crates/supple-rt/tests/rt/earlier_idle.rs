//! Tests that an accepted idle request overrides every request for its cycle or an earlier one, however late that request
//! arrives. Example: a program that starts a system schedules gravity hold for the first cycle, but an operator has already
//! requested idle.

use crate::support::Bench;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, OperatorReply, Outcome};

/// Returns the only reply to request `sequence` since the last call.
fn reply_to(bench: &mut Bench, sequence: u64) -> OperatorReply {
    let replies = bench.replies();
    let mut found = replies.iter().filter(|reply| reply.sequence == sequence);
    let reply = *found.next().unwrap_or_else(|| panic!("none: {replies:?}"));
    assert!(found.next().is_none(), "{replies:?}");
    reply
}

fn assert_refused(bench: &mut Bench, sequence: u64) {
    let reply = reply_to(bench, sequence);
    assert_eq!(
        (reply.outcome(), reply.mode()),
        (Outcome::Refused, Some(Mode::Idle))
    );
    assert!(reply.text.as_str().contains("idle"), "{reply:?}");
}

/// Requests idle, which is accepted before the plant has sent a state.
fn idle_before_the_first_state(bench: &mut Bench) {
    bench.idle().set_requested(1);
    assert!(bench.run_iteration());
    let reply = bench.idle().reply().expect("a reply");
    assert_eq!((reply.cycle, reply.outcome()), (0, Outcome::Accepted));
}

#[test]
fn idle_before_the_first_state_overrides_the_first_cycle() {
    for virtual_time in [false, true] {
        let mut bench = Bench::new(virtual_time);
        idle_before_the_first_state(&mut bench);
        bench.request(&Request::GravityHold, Some(0));
        for _ in 0..3 {
            let (answer, _) = bench.cycle(Drives::Active);
            assert_eq!(answer.mode(), Some(Mode::Idle));
            assert!(!answer.wants_torque());
        }
        assert_refused(&mut bench, 1);
    }
}

/// Idle refuses requests that wait for a later cycle; a request that is sent after idle is executed.
#[test]
fn idle_before_the_first_state_refuses_requests_that_were_queued_before() {
    let mut bench = Bench::new(false);
    bench.request(&Request::GravityHold, Some(5));
    idle_before_the_first_state(&mut bench);
    assert_refused(&mut bench, 1);
    bench.request(&Request::GravityHold, Some(8));
    for cycle in 0..12 {
        let held = bench.active_cycle().mode() == Some(Mode::GravityHold);
        assert_eq!(held, cycle >= 8, "cycle {cycle}");
    }
}

#[test]
fn a_request_that_arrives_after_idle_for_an_earlier_cycle_is_refused() {
    let mut bench = Bench::new(false);
    for _ in 0..4 {
        bench.active_cycle();
    }
    bench.idle().set_requested(1);
    bench.active_cycle();
    assert_eq!(bench.idle().reply().expect("a reply").cycle, 4);
    for (sequence, at_cycle) in [(1, 0), (2, 4)] {
        bench.request(&Request::GravityHold, Some(at_cycle));
        assert_eq!(bench.active_cycle().mode(), Some(Mode::Idle));
        assert_refused(&mut bench, sequence);
    }
    // Requests for a cycle after idle, and for the next cycle, are executed.
    bench.request(&Request::GravityHold, Some(5));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
    bench.request(&Request::Idle, None);
    bench.active_cycle();
    bench.request(&Request::GravityHold, None);
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
}

/// Without an idle request, a request that arrives after its cycle is executed.
#[test]
fn a_request_for_an_earlier_cycle_is_executed_without_idle() {
    let mut bench = Bench::new(false);
    for _ in 0..4 {
        bench.active_cycle();
    }
    bench.request(&Request::GravityHold, Some(0));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
}

/// A restarted plant counts its cycles from zero: requests for its cycles are executed.
#[test]
fn an_earlier_idle_does_not_override_requests_after_a_restart_of_the_plant() {
    let mut bench = Bench::new(false);
    bench.cycle = 1000;
    bench.active_cycle();
    bench.idle().set_requested(1);
    bench.active_cycle();
    bench.cycle = 0;
    bench.active_cycle();
    // The controller has latched a fault because the cycles are out of order.
    bench.request(&Request::Reset, None);
    bench.active_cycle();
    bench.request(&Request::GravityHold, Some(bench.cycle + 2));
    let modes: Vec<_> = (0..4).map(|_| bench.active_cycle().mode()).collect();
    assert_eq!(modes.last(), Some(&Some(Mode::GravityHold)), "{modes:?}");
}
