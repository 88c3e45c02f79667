//! What the motors do with answers, and without them: never longer on the fallback than 100 ms, then they
//! brake, and braking only ever takes energy.

use supple_core::controller::{Controller, Mode, Request, State};
use supple_core::drive_guard::DriveGuard;
use supple_core::{Input, Vector, step};
use supple_ipc::message::{Drives, TorqueCommand};
use supple_model::Description;
use supple_sim::Motors;

const FALLBACK_CYCLES: usize = 100;

fn answer(request: Option<Request<4>>) -> TorqueCommand {
    let description = Description::asset("wam4").expect("built in");
    let controller = Controller::new(description.config().expect("sound")).expect("sound");
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
    Motors::new(1e-3, DriveGuard::new(&config.expect("sound")))
}

fn home() -> [Option<f64>; 4] {
    let home = Description::asset("wam4").expect("built in").home::<4>();
    home.expect("four joints").data.0[0].map(Some)
}

#[test]
fn torque_is_made_as_soon_as_it_is_wanted_and_not_before() {
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
    // The one who was lost has to have been idle before it gets torque again.
    assert_eq!(motors.torque(&home(), Some(&hold)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    motors
        .torque(&home(), Some(&answer(None)))
        .expect("four joints");
    assert_eq!(motors.torque(&home(), Some(&hold)), hold.torque());
}

#[test]
fn an_answer_in_between_begins_the_100_ms_anew() {
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
    let mut motors = Motors::<3>::new(1e-3, DriveGuard::new(&config.expect("sound")));
    assert!(motors.torque(&[Some(0.0); 3], Some(&answer(None))).is_err());
}

/// Whatever mode a controller is in when the drives come to life, if it is not gravity hold they do not.
#[test]
fn drives_come_to_life_in_gravity_hold_alone() {
    let hold = answer(Some(Request::GravityHold));
    for mode in [Mode::Move, Mode::Track, Mode::Excite, Mode::Fault] {
        let mut motors = motors();
        let at_work = TorqueCommand {
            mode: mode as u8,
            ..hold
        };
        assert_eq!(motors.torque(&home(), Some(&at_work)), Ok(Vector::zeros()));
        assert_eq!(motors.drives(), Drives::Idle, "{mode:?}");
        motors.torque(&home(), Some(&hold)).expect("four joints");
        assert_eq!(motors.drives(), Drives::Active, "{mode:?}");
    }
}

/// Torques of somebody who is not the controller: not finite, beyond the limits, at once.
#[test]
fn a_torque_is_limited_again_and_one_that_is_no_number_is_no_answer() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    motors.torque(&home(), Some(&hold)).expect("four joints");
    let mut wild = hold;
    wild.torque_nm[3] = f64::NAN;
    assert_eq!(motors.torque(&home(), Some(&wild)), hold.fallback_torque());
    wild.torque_nm = [-1e6; 7];
    let before = hold.fallback_torque::<4>().expect("four joints");
    let sent = motors.torque(&home(), Some(&wild)).expect("four joints");
    assert!(
        (sent - before).amax() <= 1.0 + 1e-9,
        "the rate limit: 1 N m a cycle"
    );
    for _ in 0..500 {
        let sent = motors.torque(&home(), Some(&wild)).expect("four joints");
        assert!(sent.amax() <= 101.7 + 1e-9, "{sent}");
    }
}

/// The guard ends torque by its own eyes: where a joint moves on in a controller's fault, and where one is far too
/// fast.
#[test]
fn an_arm_that_does_not_stop_in_a_fault_is_braked() {
    let hold = answer(Some(Request::GravityHold));
    let fault = TorqueCommand {
        mode: Mode::Fault as u8,
        fault: 6,
        ..hold
    };
    for (speed_rad_per_s, command, within) in [(1.0, fault, 251..=300), (9.0, hold, 1..=40)] {
        let mut motors = motors();
        let mut angles = home();
        for _ in 0..100 {
            motors.torque(&angles, Some(&hold)).expect("four joints");
        }
        let ended = (1..1000).find(|_| {
            angles[0] = angles[0].map(|angle| angle + speed_rad_per_s * 1e-3);
            motors.torque(&angles, Some(&command)).expect("four joints");
            motors.drives() == Drives::Idle
        });
        assert!(
            ended.is_some_and(|cycle| within.contains(&cycle)),
            "{ended:?}"
        );
        assert!(motors.ended_by().is_some());
    }
}
