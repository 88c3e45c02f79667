//! Behaviour of the drives with and without answers: the fallback torque acts for at most 100 ms, then the motors
//! brake, and braking only dissipates energy.

use supple_core::controller::codes::fault_kind;
use supple_core::controller::{Controller, Mode, Request, State};
use supple_core::drive_guard::{DriveCommand, DriveGuard};
use supple_core::{Input, Vector, step};
use supple_ipc::message::{Drives, TorqueCommand};
use supple_model::Description;
use supple_sim::Motors;

const FALLBACK_CYCLES: usize = 100;

fn answer(request: Option<Request<4>>) -> TorqueCommand {
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
    TorqueCommand::new(&output, false)
}

fn motors() -> Motors<4> {
    let config = Description::asset("wam4").expect("built in").config();
    Motors::new(1e-3, DriveGuard::new(&config.expect("valid")))
}

fn home() -> [Option<f64>; 4] {
    let home = Description::asset("wam4").expect("built in").home::<4>();
    home.expect("four joints").data.0[0].map(Some)
}

#[test]
fn drives_are_active_exactly_while_torque_is_requested() {
    let (hold, idle) = (answer(Some(Request::GravityHold)), answer(None));
    let mut motors = motors();
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.torque(&home(), Some(&idle)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.torque(&home(), Some(&hold)), hold.torque());
    assert_eq!(motors.drives(), Drives::Active);
    assert_eq!(motors.torque(&home(), Some(&idle)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
}

#[test]
fn the_fallback_acts_for_100_ms_and_then_the_motors_brake() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    motors.torque(&home(), Some(&hold)).expect("four joints");
    for _ in 0..FALLBACK_CYCLES {
        assert_eq!(motors.torque(&home(), None), hold.fallback_torque());
        assert_eq!(motors.drives(), Drives::Active);
    }
    assert_eq!(motors.torque(&home(), None), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    // After a loss of answers the controller must be idle before its torque is applied again.
    assert_eq!(motors.torque(&home(), Some(&hold)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    motors
        .torque(&home(), Some(&answer(None)))
        .expect("four joints");
    assert_eq!(motors.torque(&home(), Some(&hold)), hold.torque());
}

#[test]
fn an_answer_restarts_the_100_ms_of_fallback() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    for _ in 0..5 {
        motors.torque(&home(), Some(&hold)).expect("four joints");
        for _ in 0..FALLBACK_CYCLES {
            assert_eq!(motors.torque(&home(), None), hold.fallback_torque());
        }
    }
    assert_eq!(motors.drives(), Drives::Active);
}

#[test]
fn an_answer_for_another_arm_is_refused() {
    let config = Description::asset("wam3").expect("built in").config();
    let mut motors = Motors::<3>::new(1e-3, DriveGuard::new(&config.expect("valid")));
    assert!(motors.torque(&[Some(0.0); 3], Some(&answer(None))).is_err());
}

#[test]
fn drives_become_active_only_in_gravity_hold() {
    let hold = answer(Some(Request::GravityHold));
    for mode in [Mode::Move, Mode::Track, Mode::Excite, Mode::Fault] {
        let mut motors = motors();
        let command = TorqueCommand {
            mode: mode as u8,
            ..hold
        };
        assert_eq!(motors.torque(&home(), Some(&command)), Ok(Vector::zeros()));
        assert_eq!(motors.drives(), Drives::Idle, "{mode:?}");
        motors.torque(&home(), Some(&hold)).expect("four joints");
        assert_eq!(motors.drives(), Drives::Active, "{mode:?}");
    }
}

/// A faulty controller sends a torque that is not finite, then torques far beyond the limits.
#[test]
fn excessive_torque_is_limited_and_nan_counts_as_missing_answer() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    motors.torque(&home(), Some(&hold)).expect("four joints");
    let mut excessive = hold;
    excessive.torque_nm[3] = f64::NAN;
    assert_eq!(
        motors.torque(&home(), Some(&excessive)),
        hold.fallback_torque()
    );
    excessive.torque_nm = [-1e6; 7];
    let before = hold.fallback_torque::<4>().expect("four joints");
    let sent = motors
        .torque(&home(), Some(&excessive))
        .expect("four joints");
    assert!(
        (sent - before).amax() <= 1.0 + 1e-9,
        "the rate limit: 1 N m per cycle"
    );
    for _ in 0..500 {
        let sent = motors
            .torque(&home(), Some(&excessive))
            .expect("four joints");
        // The largest torque limit of the arm's joints.
        assert!(sent.amax() <= 101.7 + 1e-9, "{sent}");
    }
}

/// The guard ends the torque from the encoders alone: if a joint still moves 250 ms after a fault of the controller, or
/// if a joint exceeds twice its speed limit.
#[test]
fn an_arm_that_does_not_stop_in_a_fault_or_is_too_fast_is_braked() {
    let hold = answer(Some(Request::GravityHold));
    let fault = TorqueCommand {
        mode: Mode::Fault as u8,
        fault: fault_kind::JOINT_SPEED,
        ..hold
    };
    for (speed_rad_per_s, command, expected_cycles) in
        [(1.0, fault, 251..=300), (9.0, hold, 1..=40)]
    {
        let mut motors = motors();
        let mut angles = home();
        for _ in 0..100 {
            motors.torque(&angles, Some(&hold)).expect("four joints");
        }
        let braked_in = (1..1000).find(|_| {
            angles[0] = angles[0].map(|angle| angle + speed_rad_per_s * 1e-3);
            motors.torque(&angles, Some(&command)).expect("four joints");
            motors.drives() == Drives::Idle
        });
        assert!(
            braked_in.is_some_and(|cycle| expected_cycles.contains(&cycle)),
            "{braked_in:?}"
        );
        assert!(motors.last_guard_reason().is_some());
    }
}

/// The torque at activation is limited too, if the controller is faulty: that of its answer, and the fallback torque if
/// no further answer follows.
#[test]
fn the_first_torque_is_limited_like_any_other() {
    let mut excessive = answer(Some(Request::GravityHold));
    excessive.torque_nm = [-1e6; 7];
    excessive.fallback_torque_nm = [1e6; 7];
    let limits = Description::asset("wam4").expect("built in").config::<4>();
    let limits = limits.expect("valid").limits.joint_torque_nm;
    for answered in [true, false] {
        let mut motors = motors();
        for cycle in 0..50 {
            let command = (answered || cycle == 0).then_some(&excessive);
            let sent = motors.torque(&home(), command).expect("four joints");
            for (torque_nm, limit_nm) in sent.iter().zip(&limits) {
                assert!(torque_nm.abs() <= limit_nm + 1e-9, "cycle {cycle}: {sent}");
            }
        }
        assert_eq!(motors.drives(), Drives::Active);
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
