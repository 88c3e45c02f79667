//! Tests that the loop receives operator requests within a bounded number of cycles, whatever else is queued.

use crate::support::Bench;
use supple_core::controller::{Mode, Request, SetPoint};
use supple_core::math::Vector3;
use supple_ipc::message::{ArmState, Drives, OperatorReply, Outcome};

/// A cycle that no test reaches.
const NEVER: Option<u64> = Some(1_000_000);

/// Creates a loop in gravity hold with a full request queue.
fn held_with_a_full_queue() -> Bench {
    let mut bench = Bench::new(false);
    assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
    for k in 0..16 {
        assert!(bench.enqueue(10 + k / 8, 10 + k, &Request::GravityHold, NEVER));
    }
    bench.active_cycle();
    assert!(bench.enqueue(9, 9, &Request::GravityHold, NEVER));
    bench.active_cycle();
    let refused = bench.replies().pop().expect("a reply");
    assert_eq!((refused.sequence, refused.outcome()), (9, Outcome::Refused));
    assert!(
        refused.text.as_str().contains("too many requests"),
        "{refused:?}"
    );
    bench
}

#[test]
fn idle_precedes_sixteen_queued_requests() {
    let mut bench = held_with_a_full_queue();
    assert!(bench.enqueue(5, 7, &Request::Idle, None));
    let answer = bench.active_cycle();
    assert_eq!(
        (answer.mode(), answer.wants_torque()),
        (Some(Mode::Idle), false)
    );
    let replies = bench.replies();
    let mine = replies.iter().find(|reply| reply.sequence == 7);
    let mine = mine.expect("a reply");
    assert_eq!(
        (mine.outcome(), mine.mode()),
        (Outcome::Accepted, Some(Mode::Idle))
    );
}

/// The queue between helper and loop is also full: it refuses other requests, but not idle.
#[test]
fn idle_is_accepted_when_the_queue_refuses_other_requests() {
    let mut bench = held_with_a_full_queue();
    let others = (0..100).filter(|k| bench.enqueue(2, 100 + k, &Request::Reset, None));
    assert_eq!(others.count(), 16);
    assert!(bench.enqueue(5, 7, &Request::Idle, None));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::Idle));
}

#[test]
fn idle_channel_takes_effect_in_the_next_cycle_and_answers_all_requests() {
    let mut bench = held_with_a_full_queue();
    bench.idle().set_requested(3);
    for operator in 0..8 {
        assert!(bench.enqueue(operator, 50 + operator, &Request::Idle, None));
    }
    assert_eq!(bench.active_cycle().mode(), Some(Mode::Idle));
    let reply = bench.idle().reply().expect("a reply");
    assert_eq!((reply.sequence, reply.outcome()), (3, Outcome::Accepted));
    assert_eq!(
        (reply.cycle, reply.mode()),
        (bench.cycle - 1, Some(Mode::Idle))
    );
    let accepted = |reply: &&OperatorReply| (50..58).contains(&reply.sequence);
    assert_eq!(bench.replies().iter().filter(accepted).count(), 8);
    // Each request gets one reply.
    bench.active_cycle();
    assert_eq!(bench.idle().reply(), None);
    assert!(bench.enqueue(1, 90, &Request::GravityHold, None));
    assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
}

#[test]
fn deferred_idle_precedes_earlier_requests_for_the_same_cycle() {
    let mut bench = Bench::new(false);
    assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
    bench.active_cycle();
    for sequence in 2..6 {
        assert!(bench.enqueue(1, sequence, &Request::GravityHold, Some(10)));
    }
    assert!(bench.enqueue(1, 6, &Request::Idle, Some(10)));
    while bench.cycle < 10 {
        assert_eq!(bench.active_cycle().mode(), Some(Mode::GravityHold));
    }
    assert_eq!(bench.active_cycle().mode(), Some(Mode::Idle));
}

/// A person who guides the arm by hand must not be surprised by a motion that was scheduled before.
#[test]
fn gravity_hold_and_float_in_the_next_cycle_refuse_scheduled_requests() {
    for rest in [Request::GravityHold, Request::Float] {
        let mut bench = Bench::new(false);
        assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
        bench.active_cycle();
        assert!(bench.enqueue(1, 2, &Request::Reset, Some(20)));
        // A scheduled gravity hold is part of a schedule and does not refuse other requests.
        assert!(bench.enqueue(1, 3, &Request::GravityHold, Some(bench.cycle + 2)));
        for _ in 0..4 {
            bench.active_cycle();
        }
        let refused = |replies: Vec<OperatorReply>| -> Vec<u64> {
            let refused = replies.iter().filter(|r| r.outcome() == Outcome::Refused);
            refused.map(|reply| reply.sequence).collect()
        };
        assert_eq!(refused(bench.replies()), [0; 0]);
        assert!(bench.enqueue(2, 4, &rest, None));
        bench.active_cycle();
        assert_eq!(refused(bench.replies()), [2]);
    }
}

/// Of several set-points that arrive between two cycles, only the newest is executed.
#[test]
fn only_the_newest_of_several_set_points_is_executed() {
    let mut bench = Bench::new(false);
    let point = |at_cycle| {
        Request::SetPoint(SetPoint {
            position_m: Vector3::zeros(),
            velocity_m_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            at_cycle,
        })
    };
    bench.active_cycle();
    for sequence in 1..=12 {
        assert!(bench.enqueue(1, sequence, &point(100 + sequence), None));
    }
    assert!(bench.enqueue(2, 1, &point(200), None));
    for _ in 0..3 {
        bench.active_cycle();
    }
    let answered: Vec<(u64, u64)> = bench
        .replies()
        .iter()
        .map(|reply| (reply.operator, reply.sequence))
        .collect();
    assert_eq!(answered, [(1, 12), (2, 1)]);
}

#[test]
fn one_operator_can_use_at_most_half_of_the_queue() {
    let mut bench = Bench::new(false);
    bench.active_cycle();
    for sequence in 0..9 {
        assert!(bench.enqueue(1, sequence, &Request::GravityHold, NEVER));
    }
    bench.active_cycle();
    let replies = bench.replies();
    assert_eq!(replies.len(), 1);
    assert_eq!(replies[0].sequence, 8);
    assert!(
        replies[0].text.as_str().contains("this operator has"),
        "{replies:?}"
    );
    assert!(bench.enqueue(2, 20, &Request::GravityHold, NEVER));
    bench.active_cycle();
    assert_eq!(bench.replies(), []);
}

/// Without a plant the arm stays idle, and the operator gets a reply.
#[test]
fn idle_is_answered_without_a_plant() {
    let mut bench = Bench::new(false);
    bench.idle().set_requested(1);
    assert!(bench.run_iteration());
    let reply = bench.idle().reply().expect("a reply");
    assert_eq!(
        (reply.outcome(), reply.mode()),
        (Outcome::Accepted, Some(Mode::Idle))
    );
}

/// Idle takes effect while the plant sends no states: the loop continues without the plant.
#[test]
fn idle_takes_effect_while_the_plant_sends_no_states() {
    let mut bench = Bench::new(false);
    assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
    bench.active_cycle();
    bench.idle().set_requested(1);
    assert!(bench.run_iteration());
    let reply = bench.idle().reply().expect("a reply");
    assert_eq!(reply.outcome(), Outcome::Accepted);
    assert_eq!(reply.mode(), Some(Mode::Idle));
}

#[test]
fn loop_shuts_down_when_no_request_can_arrive() {
    for who in 0..2 {
        let mut bench = Bench::new(false);
        assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
        assert!(bench.active_cycle().wants_torque());
        match who {
            0 => bench.helper_queues = None,
            _ => bench.idle = None,
        }
        let answer = bench.active_cycle();
        assert_eq!(answer.mode(), Some(Mode::GravityHold));
        assert!(!answer.wants_torque(), "the drives must become idle");
        bench
            .plant
            .publish(&ArmState {
                drives: Drives::Idle as u8,
                ..bench.state(Drives::Active)
            })
            .expect("published");
        assert!(!bench.run_iteration(), "the loop has ended");
    }
}

#[test]
fn states_of_another_arm_are_discarded_and_counted() {
    let mut bench = Bench::new(false);
    assert!(bench.enqueue(1, 1, &Request::GravityHold, None));
    bench.active_cycle();
    for _ in 0..5 {
        let other = ArmState {
            dof: 7,
            ..bench.state(Drives::Active)
        };
        bench.plant.publish(&other).expect("published");
        assert!(bench.run_iteration());
        bench.plant.publish(&other).expect("published");
        let answer = bench.active_cycle();
        assert_eq!((answer.mode(), answer.fault), (Some(Mode::GravityHold), 0));
    }
    bench.announce();
    let last = bench.telemetry().pop();
    assert_eq!(last.expect("some").states_dropped, 10);
    assert_eq!(bench.helper_queues().states_dropped(), 10);
}
