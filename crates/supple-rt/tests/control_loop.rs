//! The loop against a scripted plant, on the real services: its answers are those of `step`, it allocates
//! nothing, requests are heard in their cycle, and it leaves in order.

#[path = "../../../tests/support/counting.rs"]
mod counting;

use core::time::Duration;
use counting::counted;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_core::{Controller, Input, Output, State, Vector, step};
use supple_ipc::message::{
    ArmState, Drives, OperatorReply, OperatorRequest, Outcome, PlantReport, Telemetry,
    TorqueCommand,
};
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_realtime::Stop;
use supple_rt::{ControlLoop, IdleOutside, Outside, idle_path, rings};
use tempfile::TempDir;

const SOON: Duration = Duration::from_secs(5);

/// A loop with everything around it in the test's hands.
struct Bench {
    control: ControlLoop<4>,
    link: ControllerLink,
    plant: PlantLink,
    outside: Outside,
    idle: IdleOutside,
    stop: Stop,
    home_rad: Vector<4>,
    cycle: u64,
    sequence: u64,
    _folder: TempDir,
}

fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

fn controller() -> Controller<4> {
    Controller::new(description().config().expect("sound")).expect("sound")
}

fn bench(virtual_time: bool) -> Bench {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::within(&folder.path().join("run"), "loop").expect("a domain");
    let (inside, outside) = rings();
    let (idle_inside, idle) = idle_path();
    let mut control = ControlLoop::new(controller(), inside, virtual_time);
    control.hear_idle(idle_inside);
    Bench {
        control,
        link: ControllerLink::new(&domain).expect("a controller"),
        plant: PlantLink::new(&domain).expect("a plant"),
        outside,
        idle,
        stop: Stop::default(),
        home_rad: description().home().expect("four joints"),
        cycle: 0,
        sequence: 0,
        _folder: folder,
    }
}

impl Bench {
    /// The arm at rest at home.
    fn state(&self, drives: Drives) -> ArmState {
        ArmState::new::<4>(
            self.cycle,
            self.cycle * 1_000_000,
            &core::array::from_fn(|i| Some(self.home_rad[i])),
            Some(Vector3::zeros()),
            drives,
            PlantReport::default(),
        )
    }

    /// The plant announces a state.
    fn announce(&mut self) {
        self.plant.announce().expect("announced");
        assert!(self.control.turn(&self.link, &self.stop).expect("a turn"));
    }

    /// One cycle from end to end; the loop's answer and whether it goes on.
    fn cycle(&mut self, drives: Drives) -> (TorqueCommand, bool) {
        self.plant.publish(&self.state(drives)).expect("published");
        let goes_on = self.control.turn(&self.link, &self.stop).expect("a turn");
        let heard = self.plant.answer(self.cycle, SOON).expect("read");
        self.cycle += 1;
        (heard.answer.expect("an answer"), goes_on)
    }

    fn ask(&mut self, request: &Request<4>, at_cycle: Option<u64>) {
        self.sequence += 1;
        let message = OperatorRequest::new(1, self.sequence, at_cycle, request);
        assert!(self.outside.request(message));
    }

    fn replies(&mut self) -> Vec<OperatorReply> {
        core::iter::from_fn(|| self.outside.reply()).collect()
    }

    fn telemetry(&mut self) -> Vec<Telemetry> {
        core::iter::from_fn(|| self.outside.telemetry()).collect()
    }
}

#[test]
fn its_answers_are_those_of_step_to_the_last_bit() {
    let mut bench = bench(true);
    let (controller, mut state) = (controller(), State::new(&controller()));
    bench.ask(&Request::GravityHold, Some(3));
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
    let steps: Vec<u64> = telemetry.iter().map(|t| t.step).collect();
    assert_eq!(steps, (0..50).collect::<Vec<_>>());
    let mode = |k: usize| telemetry[k].mode();
    assert_eq!(
        (mode(2), mode(3)),
        (Some(Mode::Idle), Some(Mode::GravityHold))
    );
}

#[test]
fn what_it_does_when_a_state_is_announced_changes_no_answer() {
    let (mut announced, mut plain) = (bench(false), bench(false));
    for cycle in 0..200 {
        for bench in [&mut announced, &mut plain] {
            if cycle == 3 {
                bench.ask(&Request::GravityHold, None);
            }
            // An arm that moves: a step that was not forgotten would be seen.
            bench.home_rad[1] += 1e-4;
        }
        if cycle % 3 > 0 {
            announced.announce();
            // All is told then, and nothing twice: of the last step, and of one before which nobody announced.
            let told = 1 + usize::from(cycle % 3 == 1 && cycle > 1);
            assert_eq!(announced.telemetry().len(), told);
        }
        let (with, _) = announced.cycle(Drives::Active);
        let (without, _) = plain.cycle(Drives::Active);
        assert_eq!(with, without);
    }
    // Whoever does not announce hears of a step one step later.
    assert_eq!(plain.telemetry().len(), 199);
}

#[test]
fn a_thousand_cycles_with_requests_and_a_fault_allocate_nothing() {
    let mut bench = bench(false);
    for _ in 0..4 {
        bench.cycle(Drives::Active);
    }
    let allocations = counted(|| {
        for k in 0..1000_u64 {
            match k {
                100 => bench.ask(&Request::GravityHold, None),
                200 => bench.ask(&Request::Idle, Some(bench.cycle + 50)),
                // Refused in idle: words are made.
                300 | 301 => bench.ask(&Request::Reset, None),
                // On the way for idle, and states of another arm.
                400 => bench.idle.ask(1),
                500 => {
                    let other = ArmState {
                        dof: 7,
                        ..bench.state(Drives::Active)
                    };
                    bench.plant.publish(&other).expect("published");
                }
                // Two cycles are left out: a fault, with words.
                900 => bench.cycle += 3,
                _ => {}
            }
            if k % 7 > 0 {
                bench.announce();
            }
            bench.cycle(Drives::Active);
            if k % 50 == 0 {
                while bench.outside.telemetry().is_some() {}
            }
        }
    });
    assert_eq!(allocations, 0);
    bench.announce();
    let last = bench.telemetry().pop().expect("some");
    assert!(
        last.fault_text.as_str().contains("no new arm state"),
        "{last:?}"
    );
    let outcomes: Vec<Outcome> = bench.replies().iter().map(OperatorReply::outcome).collect();
    let (yes, no) = (Outcome::Accepted, Outcome::Refused);
    assert_eq!(outcomes, [yes, yes, no, no]);
}

#[test]
fn a_loop_that_lags_steps_over_every_state_and_answers_the_newest() {
    let mut bench = bench(false);
    bench.ask(&Request::GravityHold, None);
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
fn a_plant_that_falls_silent_is_found_stale_and_torques_stay_gravity() {
    let mut bench = bench(false);
    bench.ask(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    for _ in 0..3 {
        assert!(
            bench
                .control
                .turn(&bench.link, &bench.stop)
                .expect("a turn")
        );
    }
    let last = bench.telemetry().pop().expect("some");
    assert_eq!(last.mode(), Some(Mode::Fault));
    assert!(
        last.fault_text.as_str().contains("no new arm state"),
        "{last:?}"
    );
    assert_eq!(last.terms.damping, [0.0; 7]);
    assert_eq!(last.terms.joint_pd, [0.0; 7]);
}

#[test]
fn in_virtual_time_silence_means_nothing() {
    let mut bench = bench(true);
    bench.ask(&Request::GravityHold, None);
    bench.cycle(Drives::Active);
    for _ in 0..3 {
        assert!(
            bench
                .control
                .turn(&bench.link, &bench.stop)
                .expect("a turn")
        );
    }
    assert_eq!(bench.telemetry().len(), 1);
    let (answer, _) = bench.cycle(Drives::Active);
    assert_eq!((answer.mode(), answer.fault), (Some(Mode::GravityHold), 0));
}

#[test]
fn what_waits_is_dropped_when_the_arm_is_let_go_of_or_a_fault_comes() {
    for by_fault in [false, true] {
        let mut bench = bench(true);
        bench.ask(&Request::GravityHold, None);
        bench.ask(&Request::GravityHold, Some(100));
        bench.cycle(Drives::Active);
        match by_fault {
            true => bench.cycle += 5,
            false => bench.ask(&Request::Idle, None),
        }
        bench.cycle(Drives::Active);
        let replies = bench.replies();
        let dropped = replies
            .iter()
            .find(|r| r.sequence == 2 && r.outcome() == Outcome::Refused);
        let words = dropped.expect("dropped").text;
        let mode = if by_fault { "fault" } else { "idle" };
        assert!(
            words.as_str().contains(&format!("to mode {mode}")),
            "{words}"
        );
        bench.cycle = 100;
        bench.cycle(Drives::Active);
        assert!(bench.replies().iter().all(|r| r.sequence != 2));
    }
}

#[test]
fn a_request_for_another_arm_is_refused_in_words() {
    let mut bench = bench(true);
    let message = OperatorRequest::new::<7>(1, 9, None, &Request::GravityHold);
    assert!(bench.outside.request(message));
    let (answer, _) = bench.cycle(Drives::Active);
    assert_eq!(answer.mode(), Some(Mode::Idle));
    let reply = bench.replies().pop().expect("a reply");
    assert_eq!((reply.sequence, reply.outcome()), (9, Outcome::Refused));
    assert!(reply.text.as_str().contains("7 joints"), "{reply:?}");
}

#[test]
fn it_leaves_from_gravity_hold_when_the_drives_are_idle() {
    let mut bench = bench(false);
    bench.ask(&Request::GravityHold, None);
    let (answer, goes_on) = bench.cycle(Drives::Active);
    assert!(answer.wants_torque() && goes_on);
    bench.stop.ask();
    for _ in 0..3 {
        let (answer, goes_on) = bench.cycle(Drives::Active);
        assert_eq!(answer.mode(), Some(Mode::GravityHold));
        assert!(!answer.wants_torque() && goes_on);
        assert_ne!(
            answer.torque_nm, [0.0; 7],
            "it holds until the motors brake"
        );
    }
    let (_, goes_on) = bench.cycle(Drives::Idle);
    assert!(!goes_on);
}

#[test]
fn it_leaves_a_plant_that_does_not_lower_its_drives_and_one_that_is_gone() {
    let mut stubborn = bench(false);
    stubborn.ask(&Request::GravityHold, None);
    stubborn.cycle(Drives::Active);
    stubborn.stop.ask();
    let left = (0..1000).position(|_| !stubborn.cycle(Drives::Active).1);
    assert_eq!(left, Some(249));
    let mut gone = bench(false);
    gone.cycle(Drives::Active);
    gone.stop.ask();
    let left = (0..100).position(|_| !gone.control.turn(&gone.link, &gone.stop).expect("a turn"));
    assert_eq!(left, Some(12));
}
