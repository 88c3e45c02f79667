//! The operator is heard, whatever else waits: by the loop, counted in its cycles.

use core::time::Duration;
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Vector};
use supple_ipc::message::{
    ArmState, Drives, OperatorReply, OperatorRequest, Outcome, PlantReport, TorqueCommand,
};
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_realtime::Stop;
use supple_rt::{ControlLoop, IdleOutside, Outside, idle_path, rings};
use tempfile::TempDir;

const SOON: Duration = Duration::from_secs(5);
/// A cycle that does not come in tests.
const NEVER: Option<u64> = Some(1_000_000);

struct Bench {
    control: ControlLoop<4>,
    link: ControllerLink,
    plant: PlantLink,
    outside: Option<Outside>,
    idle: Option<IdleOutside>,
    stop: Stop,
    home_rad: Vector<4>,
    cycle: u64,
    _folder: TempDir,
}

fn bench() -> Bench {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::within(&folder.path().join("run"), "heard").expect("a domain");
    let (inside, outside) = rings();
    let (idle_inside, idle) = idle_path();
    let description = Description::asset("wam4").expect("built in");
    let controller = Controller::new(description.config().expect("sound")).expect("sound");
    let mut control = ControlLoop::new(controller, inside, false);
    control.hear_idle(idle_inside);
    Bench {
        control,
        link: ControllerLink::new(&domain).expect("a controller"),
        plant: PlantLink::new(&domain).expect("a plant"),
        outside: Some(outside),
        idle: Some(idle),
        stop: Stop::default(),
        home_rad: description.home().expect("four joints"),
        cycle: 0,
        _folder: folder,
    }
}

impl Bench {
    fn state(&self) -> ArmState {
        ArmState::new::<4>(
            self.cycle,
            self.cycle * 1_000_000,
            &core::array::from_fn(|i| Some(self.home_rad[i])),
            None,
            Drives::Active,
            PlantReport::default(),
        )
    }

    fn turn(&mut self) -> bool {
        self.control.turn(&self.link, &self.stop).expect("a turn")
    }

    fn cycle(&mut self) -> TorqueCommand {
        self.plant.publish(&self.state()).expect("published");
        self.turn();
        let heard = self.plant.answer(self.cycle, SOON).expect("read");
        self.cycle += 1;
        heard.answer.expect("an answer")
    }

    fn hand_in(
        &mut self,
        operator: u64,
        sequence: u64,
        request: &Request<4>,
        at: Option<u64>,
    ) -> bool {
        let message = OperatorRequest::new(operator, sequence, at, request);
        self.outside.as_mut().expect("there").request(message)
    }

    fn replies(&mut self) -> Vec<OperatorReply> {
        let outside = self.outside.as_mut().expect("there");
        core::iter::from_fn(|| outside.reply()).collect()
    }

    /// In gravity hold, with every place of the queue taken.
    fn held_with_a_full_queue() -> Bench {
        let mut bench = bench();
        assert!(bench.hand_in(1, 1, &Request::GravityHold, None));
        assert_eq!(bench.cycle().mode(), Some(Mode::GravityHold));
        for k in 0..16 {
            assert!(bench.hand_in(10 + k / 8, 10 + k, &Request::GravityHold, NEVER));
        }
        bench.cycle();
        assert!(bench.hand_in(9, 9, &Request::GravityHold, NEVER));
        bench.cycle();
        let refused = bench.replies().pop().expect("a reply");
        assert_eq!((refused.sequence, refused.outcome()), (9, Outcome::Refused));
        assert!(
            refused.text.as_str().contains("too many requests"),
            "{refused:?}"
        );
        bench
    }
}

#[test]
fn idle_passes_sixteen_requests_that_wait() {
    let mut bench = Bench::held_with_a_full_queue();
    assert!(bench.hand_in(5, 7, &Request::Idle, None));
    let answer = bench.cycle();
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

/// The ring between helper and loop is full too: others are refused there, idle is not.
#[test]
fn idle_finds_a_place_where_others_find_none() {
    let mut bench = Bench::held_with_a_full_queue();
    let others = (0..100).filter(|k| bench.hand_in(2, 100 + k, &Request::Reset, None));
    assert_eq!(others.count(), 16);
    assert!(bench.hand_in(5, 7, &Request::Idle, None));
    assert_eq!(bench.cycle().mode(), Some(Mode::Idle));
}

#[test]
fn idle_on_its_own_way_is_heard_in_the_next_cycle_and_answers_all_who_asked() {
    let mut bench = Bench::held_with_a_full_queue();
    bench.idle.as_ref().expect("there").ask(3);
    for operator in 0..8 {
        assert!(bench.hand_in(operator, 50 + operator, &Request::Idle, None));
    }
    assert_eq!(bench.cycle().mode(), Some(Mode::Idle));
    let reply = bench
        .idle
        .as_mut()
        .expect("there")
        .reply()
        .expect("a reply");
    assert_eq!((reply.sequence, reply.outcome()), (3, Outcome::Accepted));
    assert_eq!(
        (reply.cycle, reply.mode()),
        (bench.cycle - 1, Some(Mode::Idle))
    );
    let accepted = |reply: &&OperatorReply| (50..58).contains(&reply.sequence);
    assert_eq!(bench.replies().iter().filter(accepted).count(), 8);
    // Asked once, answered once.
    bench.cycle();
    assert_eq!(bench.idle.as_mut().expect("there").reply(), None);
    assert!(bench.hand_in(1, 90, &Request::GravityHold, None));
    assert_eq!(bench.cycle().mode(), Some(Mode::GravityHold));
}

#[test]
fn idle_in_its_cycle_goes_before_what_came_earlier_for_the_same_cycle() {
    let mut bench = bench();
    assert!(bench.hand_in(1, 1, &Request::GravityHold, None));
    bench.cycle();
    for sequence in 2..6 {
        assert!(bench.hand_in(1, sequence, &Request::GravityHold, Some(10)));
    }
    assert!(bench.hand_in(1, 6, &Request::Idle, Some(10)));
    while bench.cycle < 10 {
        assert_eq!(bench.cycle().mode(), Some(Mode::GravityHold));
    }
    assert_eq!(bench.cycle().mode(), Some(Mode::Idle));
}

#[test]
fn one_operator_has_no_more_than_half_of_the_places() {
    let mut bench = bench();
    bench.cycle();
    for sequence in 0..9 {
        assert!(bench.hand_in(1, sequence, &Request::GravityHold, NEVER));
    }
    bench.cycle();
    let replies = bench.replies();
    assert_eq!(replies.len(), 1);
    assert_eq!(replies[0].sequence, 8);
    assert!(
        replies[0].text.as_str().contains("of this operator"),
        "{replies:?}"
    );
    assert!(bench.hand_in(2, 20, &Request::GravityHold, NEVER));
    bench.cycle();
    assert_eq!(bench.replies(), []);
}

/// An idle arm is kept so where there is no plant yet, and the operator hears it.
#[test]
fn idle_is_answered_before_there_is_a_plant() {
    let mut bench = bench();
    bench.idle.as_ref().expect("there").ask(1);
    assert!(bench.turn());
    let reply = bench
        .idle
        .as_mut()
        .expect("there")
        .reply()
        .expect("a reply");
    assert_eq!(
        (reply.outcome(), reply.mode()),
        (Outcome::Accepted, Some(Mode::Idle))
    );
}

/// Idle is heard where the plant has fallen silent: the loop goes on without it.
#[test]
fn idle_is_heard_while_the_plant_is_silent() {
    let mut bench = bench();
    assert!(bench.hand_in(1, 1, &Request::GravityHold, None));
    bench.cycle();
    bench.idle.as_ref().expect("there").ask(1);
    assert!(bench.turn());
    let reply = bench
        .idle
        .as_mut()
        .expect("there")
        .reply()
        .expect("a reply");
    assert_eq!(reply.outcome(), Outcome::Accepted);
    assert_eq!(reply.mode(), Some(Mode::Idle));
}

#[test]
fn where_nobody_can_be_heard_any_more_the_loop_leaves_in_order() {
    for who in 0..2 {
        let mut bench = bench();
        assert!(bench.hand_in(1, 1, &Request::GravityHold, None));
        assert!(bench.cycle().wants_torque());
        match who {
            0 => bench.outside = None,
            _ => bench.idle = None,
        }
        let answer = bench.cycle();
        assert_eq!(answer.mode(), Some(Mode::GravityHold));
        assert!(!answer.wants_torque(), "the drives are to be lowered");
        bench
            .plant
            .publish(&ArmState {
                drives: Drives::Idle as u8,
                ..bench.state()
            })
            .expect("published");
        assert!(!bench.turn(), "it has left");
    }
}

#[test]
fn states_of_another_arm_are_dropped_and_counted_and_end_nobody() {
    let mut bench = bench();
    assert!(bench.hand_in(1, 1, &Request::GravityHold, None));
    bench.cycle();
    for _ in 0..5 {
        let other = ArmState {
            dof: 7,
            ..bench.state()
        };
        bench.plant.publish(&other).expect("published");
        assert!(bench.turn());
        bench.plant.publish(&other).expect("published");
        let answer = bench.cycle();
        assert_eq!((answer.mode(), answer.fault), (Some(Mode::GravityHold), 0));
    }
    bench.plant.announce().expect("announced");
    assert!(bench.turn());
    let outside = bench.outside.as_mut().expect("there");
    let last = core::iter::from_fn(|| outside.telemetry()).last();
    assert_eq!(last.expect("some").states_dropped, 10);
    assert_eq!(outside.states_dropped(), 10);
}
