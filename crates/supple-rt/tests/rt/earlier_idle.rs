//! Idle overrides what is scheduled for a cycle that is not after it, however late that request arrives: a program that
//! starts a system schedules gravity hold for the first cycle, and an operator who was quicker has the last word.

use crate::support::Bench;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Drives, OperatorReply, Outcome};

/// The one reply to request `sequence` since the last call.
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

/// Idle is accepted while the plant has sent nothing yet.
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

/// What waits for a later cycle is dropped as by any other request of idle; a later request is carried out.
#[test]
fn idle_before_the_first_state_refuses_what_was_queued_before() {
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
    // Requests for a cycle after it, and at once, are carried out.
    bench.request(&Request::GravityHold, Some(5));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
    bench.request(&Request::Idle, None);
    bench.active_cycle();
    bench.request(&Request::GravityHold, None);
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
}

/// Without idle a request that comes late is carried out.
#[test]
fn a_request_for_an_earlier_cycle_is_carried_out_without_idle() {
    let mut bench = Bench::new(false);
    for _ in 0..4 {
        bench.active_cycle();
    }
    bench.request(&Request::GravityHold, Some(0));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
}

/// A plant that was started anew counts from zero: what is scheduled in its cycles is carried out.
#[test]
fn a_plant_that_counts_anew_is_not_bound_to_the_old_cycles() {
    let mut bench = Bench::new(false);
    bench.cycle = 1000;
    bench.active_cycle();
    bench.idle().set_requested(1);
    bench.active_cycle();
    bench.cycle = 0;
    bench.active_cycle();
    // The controller has latched a fault for the cycles out of order.
    bench.request(&Request::Reset, None);
    bench.active_cycle();
    bench.request(&Request::GravityHold, Some(bench.cycle + 2));
    let modes: Vec<_> = (0..4).map(|_| bench.active_cycle().mode()).collect();
    assert_eq!(modes.last(), Some(&Some(Mode::GravityHold)), "{modes:?}");
}
