//! Behaviour of the drives with and without answers, in the loop that every arm has: the fallback torque acts until the
//! motors brake, 10 ms after the last answer, and braking only dissipates energy.

use core::time::Duration;
use supple_core::Vector;
use supple_core::controller::codes::fault_kind;
use supple_core::controller::{Controller, Mode, Request, State};
use supple_core::drive_guard::{DriveCommand, DriveGuard};
use supple_core::{Input, step};
use supple_drive::{Answer, ArmReport, Command, Drives, Link, LoopError, LossReason, Stage};
use supple_ipc::message::TorqueCommand;
use supple_model::Description;
use supple_plant::{Plant, PlantConfig};
use supple_sim::{SimulatedArm, Simulation, simulation};

/// Cycles without an answer until the motors brake.
const ANSWER_CYCLES: usize = 10;

/// A link whose answers the test gives.
#[derive(Default)]
struct Scripted {
    command: Option<Command<4>>,
    report: Option<ArmReport<4>>,
}

impl Link<4> for Scripted {
    fn announce(&mut self) -> Result<(), LoopError> {
        Ok(())
    }

    fn publish(&mut self, report: &ArmReport<4>) -> Result<(), LoopError> {
        self.report = Some(*report);
        Ok(())
    }

    fn answer(&mut self, _: u64, _: u64) -> Result<Answer<4>, LoopError> {
        Ok(Answer {
            command: self.command,
            late: 0,
        })
    }
}

struct Motors(Simulation<4, Scripted>);

impl Motors {
    fn new() -> Motors {
        Motors::with_time(true)
    }

    fn with_time(virtual_time: bool) -> Motors {
        let description = Description::asset("wam4").expect("built in");
        let plant = PlantConfig::from_description(&description).expect("valid");
        let home = description.home::<4>().expect("four joints");
        let plant = Plant::new(plant, home, Vector::zeros()).expect("valid");
        let arm = SimulatedArm::new(plant, virtual_time, 0.75);
        let config = description.config().expect("valid");
        Motors(simulation(arm, Scripted::default(), &config).expect("no bus is needed"))
    }

    /// Runs a cycle with an answer; returns the joint torques that the motors received.
    fn cycle(&mut self, command: Option<&Command<4>>) -> Vector<4> {
        self.0.link_mut().command = command.copied();
        self.0.run().expect("it runs");
        self.0.drive().applied_nm()
    }

    fn drives(&self) -> Drives {
        self.0.drives()
    }

    fn loss(&self) -> Option<LossReason> {
        self.0.guard().last_loss().map(|(loss, _)| loss)
    }
}

fn answer(request: Option<Request<4>>) -> Command<4> {
    let description = Description::asset("wam4").expect("built in");
    let controller = Controller::new(description.config().expect("valid")).expect("valid");
    let home = description.home::<4>().expect("four joints");
    let input = Input {
        cycle: 0,
        position_rad: core::array::from_fn(|i| Some(home[i])),
        tip_force_n: None,
        drives_active: true,
        request,
    };
    let output = step(&controller, &mut State::new(&controller), &input);
    let command = TorqueCommand::new(&output, false);
    Command {
        torque_nm: command.torque().expect("four joints"),
        fallback_torque_nm: command.fallback_torque().expect("four joints"),
        wants_torque: command.wants_torque(),
        mode: command.mode(),
        fault: command.fault != 0,
        codes: [command.mode, command.fault],
    }
}

fn home() -> [Option<f64>; 4] {
    let home = Description::asset("wam4").expect("built in").home::<4>();
    home.expect("four joints").data.0[0].map(Some)
}

#[test]
fn drives_are_active_exactly_while_torque_is_requested() {
    let (hold, idle) = (answer(Some(Request::GravityHold)), answer(None));
    let mut motors = Motors::new();
    assert_eq!(motors.drives(), Drives::Idle);
    motors.cycle(Some(&idle));
    assert_eq!(motors.drives(), Drives::Idle);
    let torque_nm = motors.cycle(Some(&hold));
    assert_eq!(torque_nm, hold.torque_nm);
    assert_eq!(motors.drives(), Drives::Active);
    motors.cycle(Some(&idle));
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.loss(), Some(LossReason::TorqueNotWanted));
    // No loss is latched.
    motors.cycle(Some(&idle));
    motors.cycle(Some(&hold));
    assert_eq!(motors.drives(), Drives::Active);
}

#[test]
fn the_fallback_acts_until_the_motors_brake_as_on_a_real_arm() {
    let (hold, idle) = (answer(Some(Request::GravityHold)), answer(None));
    let mut motors = Motors::new();
    motors.cycle(Some(&hold));
    for _ in 0..ANSWER_CYCLES {
        let torque_nm = motors.cycle(None);
        assert_eq!(torque_nm, hold.fallback_torque_nm);
        assert_eq!(motors.drives(), Drives::Active);
    }
    motors.cycle(None);
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.loss(), Some(LossReason::NoAnswer));
    // After a loss of answers the controller must be idle before its torque is applied again.
    for _ in 0..5 {
        motors.cycle(Some(&hold));
        assert_eq!(motors.drives(), Drives::Idle);
        assert_eq!(motors.0.guard().stage(), Stage::Resting);
    }
    motors.cycle(Some(&idle));
    motors.cycle(Some(&hold));
    assert_eq!(motors.drives(), Drives::Active);
}

#[test]
fn an_answer_restarts_the_time_of_the_fallback() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = Motors::new();
    for _ in 0..5 {
        motors.cycle(Some(&hold));
        for _ in 0..ANSWER_CYCLES {
            motors.cycle(None);
        }
    }
    assert_eq!(motors.drives(), Drives::Active);
}

#[test]
fn drives_become_active_only_in_gravity_hold() {
    let hold = answer(Some(Request::GravityHold));
    for mode in [Mode::Move, Mode::Track, Mode::Excite, Mode::Fault] {
        let mut motors = Motors::new();
        let command = Command {
            mode: Some(mode),
            ..hold
        };
        motors.cycle(Some(&command));
        assert_eq!(motors.drives(), Drives::Idle, "{mode:?}");
        motors.cycle(Some(&hold));
        assert_eq!(motors.drives(), Drives::Active, "{mode:?}");
    }
}

/// A faulty controller sends a torque that is not finite, then torques far beyond the limits.
#[test]
fn excessive_torque_is_limited_and_nan_counts_as_missing_answer() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = Motors::new();
    motors.cycle(Some(&hold));
    let mut excessive = hold;
    excessive.torque_nm[3] = f64::NAN;
    let torque_nm = motors.cycle(Some(&excessive));
    assert_eq!(torque_nm, hold.fallback_torque_nm);
    assert_eq!(motors.0.counters().unusable, 1);
    assert_eq!(motors.0.counters().missed, 1);
}

/// The guard ends the torque from the encoders alone: an arm that a faulty controller drives beyond twice a speed limit,
/// or that still moves in a fault, is braked.
#[test]
fn an_arm_that_does_not_stop_in_a_fault_or_is_too_fast_is_braked() {
    let hold = answer(Some(Request::GravityHold));
    for fault in [false, true] {
        let mut motors = Motors::new();
        for _ in 0..100 {
            motors.cycle(Some(&hold));
        }
        let mut push = hold;
        push.torque_nm[0] += 20.0;
        push.fault = fault;
        push.codes[1] = if fault { fault_kind::JOINT_SPEED } else { 0 };
        let braked_in = (1..2000).find(|_| {
            motors.cycle(Some(&push));
            motors.drives() == Drives::Idle
        });
        assert!(braked_in.is_some(), "fault: {fault}");
        match (fault, motors.loss()) {
            (true, Some(LossReason::NotStopped(_))) | (false, Some(LossReason::Overspeed(_))) => {}
            (_, other) => panic!("fault: {fault}: {other:?}"),
        }
    }
}

/// The torque at activation is limited too, if the controller is faulty: that of its answer, and the fallback torque if
/// no further answer follows.
#[test]
fn the_first_torque_is_limited_like_any_other() {
    let mut excessive = answer(Some(Request::GravityHold));
    excessive.torque_nm = Vector::repeat(-1e6);
    excessive.fallback_torque_nm = Vector::repeat(1e6);
    let limits = Description::asset("wam4").expect("built in").config::<4>();
    let limits = limits.expect("valid").limits.joint_torque_nm;
    for answered in [true, false] {
        let mut motors = Motors::new();
        for cycle in 0..8 {
            let command = (answered || cycle == 0).then_some(&excessive);
            let sent = motors.cycle(command);
            for (torque_nm, limit_nm) in sent.iter().zip(&limits) {
                assert!(torque_nm.abs() <= limit_nm + 1e-9, "cycle {cycle}: {sent}");
            }
        }
    }
}

/// If the answer at activation is missing, the guard checks the activation with the first answer that arrives.
#[test]
fn activation_without_an_answer_is_checked_with_the_next_answer() {
    let config = Description::asset("wam4").expect("built in").config::<4>();
    let command = |mode| DriveCommand {
        torque_nm: Vector::zeros(),
        mode: Some(mode),
        fault: false,
    };
    for (mode, accepted) in [(Mode::GravityHold, true), (Mode::Track, false)] {
        let mut guard = DriveGuard::new(config.as_ref().expect("valid"));
        guard.observe(&home(), 1);
        assert_eq!(guard.check_command(None, true), Ok(()));
        assert_eq!(
            guard.check_command(Some(&command(mode)), true).is_ok(),
            accepted
        );
    }
}

/// After skipped periods the guard divides the motion since the last angles by the whole time since then.
#[test]
fn skipped_periods_do_not_count_as_speed() {
    let config = Description::asset("wam4").expect("built in").config::<4>();
    let mut guard = DriveGuard::new(config.as_ref().expect("valid"));
    let hold = DriveCommand {
        torque_nm: Vector::zeros(),
        mode: Some(Mode::GravityHold),
        fault: false,
    };
    let mut angles = home();
    let mut cycle = |guard: &mut DriveGuard<4>, periods: u64| {
        angles[0] = angles[0].map(|angle| angle + 1.5e-3 * periods as f64);
        guard.observe(&angles, periods);
        guard.check_command(Some(&hold), true)
    };
    for _ in 0..200 {
        assert_eq!(cycle(&mut guard, 1), Ok(()));
    }
    assert_eq!(cycle(&mut guard, 30), Ok(()));
    for _ in 0..50 {
        assert_eq!(cycle(&mut guard, 1), Ok(()));
    }
}

/// A loop that wakes late skips periods; the arm moves on meanwhile. Else the controller would see it move by one period in
/// several, as after a collision.
#[test]
fn the_arm_moves_in_skipped_periods() {
    let mut motors = Motors::with_time(false);
    let hold = answer(Some(Request::GravityHold));
    for cycle in 0..30 {
        if cycle % 10 == 5 {
            supple_realtime::pause(Duration::from_millis(5));
        }
        motors.cycle(Some(&hold));
        let plant_cycle = motors.0.drive().plant().measurement().cycle;
        assert_eq!(plant_cycle, motors.0.cycle_number());
    }
    assert!(motors.0.cycle_number() >= 40, "no periods were skipped");
}
