//! Tests of the control loop with a scripted plant on the shared-memory services: its answers equal those of `step`, it
//! allocates no memory, requests take effect in their cycle, and on shutdown the drives become idle.

#[path = "../../../tests/support/counting.rs"]
mod counting;
mod support;

use counting::count_allocations;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_core::{Input, Output, State, step};
use supple_ipc::message::{
    ArmState, Drives, OperatorReply, OperatorRequest, Outcome, TorqueCommand,
};
use support::{Bench, controller};

#[test]
fn answers_equal_those_of_step_bit_for_bit() {
    let mut bench = Bench::new(true);
    let (controller, mut state) = (controller(), State::new(&controller()));
    bench.request(&Request::GravityHold, Some(3));
    for cycle in 0..50 {
        let (answer, _) = bench.cycle(Drives::Active);
        let input = Input {
            cycle,
            position_rad: core::array::from_fn(|i| Some(bench.home_rad[i])),
            tip_force_n: Some(Vector3::zeros()),
            drives_active: true,
            request: (cycle == 3).then_some(Request::GravityHold),
        };
        let output: Output<4> = step(&controller, &mut state, &input);
        assert_eq!(answer, TorqueCommand::new(&output, false));
    }
    let telemetry = bench.telemetry();
    let steps: Vec<u64> = telemetry.iter().map(|t| t.step()).collect();
    assert_eq!(steps, (0..50).collect::<Vec<_>>());
    let mode = |k: usize| telemetry[k].record().mode();
    assert_eq!(
        (mode(2), mode(3)),
        (Some(Mode::Idle), Some(Mode::GravityHold))
    );
}

#[test]
fn announcements_do_not_change_the_answers() {
    let (mut announced, mut plain) = (Bench::new(false), Bench::new(false));
    for cycle in 0..200 {
        for bench in [&mut announced, &mut plain] {
            if cycle == 3 {
                bench.request(&Request::GravityHold, None);
            }
            // The arm moves, so that a warm-up step that changes the state would change the answers.
            bench.home_rad[1] += 1e-4;
        }
        if cycle % 3 > 0 {
            announced.announce();
            // The announcement sends all telemetry once: of the last step, and of a step that was not announced.
            let sent = 1 + usize::from(cycle % 3 == 1 && cycle > 1);
            assert_eq!(announced.telemetry().len(), sent);
        }
        let (with, _) = announced.cycle(Drives::Active);
        let (without, _) = plain.cycle(Drives::Active);
        assert_eq!(with, without);
    }
    // Without announcements, telemetry is sent one step later.
    assert_eq!(plain.telemetry().len(), 199);
}

#[test]
fn a_thousand_cycles_with_requests_and_a_fault_allocate_nothing() {
    let mut bench = Bench::new(false);
    for _ in 0..4 {
        bench.cycle(Drives::Active);
    }
    let allocations = count_allocations(|| {
        for k in 0..1000_u64 {
            match k {
                100 => bench.request(&Request::GravityHold, None),
                200 => bench.request(&Request::Idle, Some(bench.cycle + 50)),
                // A request that is refused in idle has a refusal text.
                300 | 301 => bench.request(&Request::Reset, None),
                // The cycles use the channel for idle requests, and include a state of another arm.
                400 => bench.idle().set_requested(1),
                500 => {
                    let other = ArmState {
                        dof: 7,
                        ..bench.state(Drives::Active)
                    };
                    bench.plant.publish(&other).expect("published");
                }
                // Missing cycles cause a fault with its text.
                900 => bench.cycle += 3,
                _ => {}
            }
            if k % 7 > 0 {
                bench.announce();
            }
            bench.cycle(Drives::Active);
            if k % 50 == 0 {
                while bench.helper_queues().telemetry().is_some() {}
            }
        }
    });
    assert_eq!(allocations, 0);
    bench.announce();
    let last = bench.telemetry().pop().expect("some").record();
    assert!(
        last.fault_text.as_str().contains("no new arm state"),
        "{last:?}"
    );
    let outcomes: Vec<Outcome> = bench.replies().iter().map(OperatorReply::outcome).collect();
    let (yes, no) = (Outcome::Accepted, Outcome::Refused);
    assert_eq!(outcomes, [yes, yes, no, no]);
}

#[test]
fn late_loop_steps_through_every_state_and_answers_the_newest() {
    let mut bench = Bench::new(false);
    bench.request(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    for _ in 0..9 {
        bench
            .plant
            .publish(&bench.state(Drives::Active))
            .expect("published");
        bench.cycle += 1;
    }
    let (answer, _) = bench.cycle(Drives::Active);
    assert_eq!(answer.cycle, 10);
    assert_eq!((answer.mode(), answer.fault), (Some(Mode::GravityHold), 0));
    bench.announce();
    assert_eq!(bench.telemetry().len(), 11);
}

#[test]
fn missing_states_fault_as_stale_and_torques_stay_gravity() {
    let mut bench = Bench::new(false);
    bench.request(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    for _ in 0..3 {
        assert!(bench.run_iteration());
    }
    let last = bench.telemetry().pop().expect("some").record();
    assert_eq!(last.mode(), Some(Mode::Fault));
    assert!(
        last.fault_text.as_str().contains("no new arm state"),
        "{last:?}"
    );
    assert_eq!(last.torques.damping.as_slice(), [0.0; 7]);
    assert_eq!(last.torques.joint_pd.as_slice(), [0.0; 7]);
}

#[test]
fn in_virtual_time_missing_states_cause_no_step() {
    let mut bench = Bench::new(true);
    bench.request(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    for _ in 0..3 {
        assert!(bench.run_iteration());
    }
    assert_eq!(bench.telemetry().len(), 1);
    let (answer, _) = bench.cycle(Drives::Active);
    assert_eq!((answer.mode(), answer.fault), (Some(Mode::GravityHold), 0));
}

#[test]
fn queued_requests_are_refused_on_idle_or_fault() {
    for by_fault in [false, true] {
        let mut bench = Bench::new(true);
        bench.request(&Request::GravityHold, None);
        bench.request(&Request::GravityHold, Some(100));
        bench.cycle(Drives::Active);
        match by_fault {
            true => bench.cycle += 5,
            false => bench.request(&Request::Idle, None),
        }
        bench.cycle(Drives::Active);
        let replies = bench.replies();
        let dropped = replies
            .iter()
            .find(|r| r.sequence == 2 && r.outcome() == Outcome::Refused);
        let text = dropped.expect("dropped").text;
        let mode = if by_fault { "fault" } else { "idle" };
        assert!(text.as_str().contains(&format!("to mode {mode}")), "{text}");
        bench.cycle = 100;
        bench.cycle(Drives::Active);
        assert!(bench.replies().iter().all(|r| r.sequence != 2));
    }
}

/// An operator who activates the drives again does not expect a motion that was scheduled before.
#[test]
fn queued_motions_are_refused_when_the_drives_become_inactive() {
    let mut bench = Bench::new(true);
    bench.request(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    let motion = Request::Move {
        target_rad: bench.home_rad,
        duration_s: 1.0,
    };
    bench.request(&motion, Some(6));
    bench.request(&Request::GravityHold, Some(6));
    bench.cycle(Drives::Active);
    bench.cycle(Drives::Idle);
    let refused: Vec<u64> = (bench.replies().iter())
        .filter(|reply| reply.outcome() == Outcome::Refused)
        .map(|reply| reply.sequence)
        .collect();
    assert_eq!(refused, [2]);
    while bench.cycle < 10 {
        let answer = bench.active_cycle();
        assert_eq!(answer.mode(), Some(Mode::GravityHold), "{}", bench.cycle);
    }
}

#[test]
fn request_for_another_arm_is_refused_with_a_text() {
    let mut bench = Bench::new(true);
    let message = OperatorRequest::new::<7>(1, 9, None, &Request::GravityHold);
    assert!(bench.helper_queues().request(message));
    let (answer, _) = bench.cycle(Drives::Active);
    assert_eq!(answer.mode(), Some(Mode::Idle));
    let reply = bench.replies().pop().expect("a reply");
    assert_eq!((reply.sequence, reply.outcome()), (9, Outcome::Refused));
    assert!(reply.text.as_str().contains("7 joints"), "{reply:?}");
}

#[test]
fn shutdown_ends_when_the_drives_are_idle() {
    let mut bench = Bench::new(false);
    bench.request(&Request::GravityHold, None);
    let (answer, goes_on) = bench.cycle(Drives::Active);
    assert!(answer.wants_torque() && goes_on);
    bench.stop.request_shutdown();
    for _ in 0..3 {
        let (answer, goes_on) = bench.cycle(Drives::Active);
        assert_eq!(answer.mode(), Some(Mode::GravityHold));
        assert!(!answer.wants_torque() && goes_on);
        assert_ne!(
            answer.torque_nm, [0.0; 7],
            "the controller holds the arm until the motors brake"
        );
    }
    let (_, goes_on) = bench.cycle(Drives::Idle);
    assert!(!goes_on);
}

#[test]
fn shutdown_times_out_if_the_drives_stay_active_or_the_plant_is_gone() {
    let mut stubborn = Bench::new(false);
    stubborn.request(&Request::GravityHold, None);
    stubborn.cycle(Drives::Active);
    stubborn.stop.request_shutdown();
    let left = (0..1000).position(|_| !stubborn.cycle(Drives::Active).1);
    assert_eq!(left, Some(249));
    let mut gone = Bench::new(false);
    gone.cycle(Drives::Active);
    gone.stop.request_shutdown();
    let left = (0..100).position(|_| !gone.run_iteration());
    assert_eq!(left, Some(12));
}
