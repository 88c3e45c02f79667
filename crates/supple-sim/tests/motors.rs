//! What the motors do with answers, and without them: never longer on the fallback than 100 ms, then they
//! brake, and braking only ever takes energy.

use supple_core::controller::{Controller, Request, State};
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
        request,
    };
    let output = step(&controller, &mut State::new(&controller), &input);
    TorqueCommand::new(&output, false)
}

fn motors() -> Motors<4> {
    Motors::new(1e-3)
}

#[test]
fn torque_is_made_as_soon_as_it_is_wanted_and_not_before() {
    let (hold, idle) = (answer(Some(Request::GravityHold)), answer(None));
    let mut motors = motors();
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.torque(Some(&idle)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    assert_eq!(motors.torque(Some(&hold)), hold.torque());
    assert_eq!(motors.drives(), Drives::Active);
    assert_eq!(motors.torque(Some(&idle)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
}

#[test]
fn the_fallback_acts_for_100_ms_and_then_the_motors_brake() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    motors.torque(Some(&hold)).expect("four joints");
    for _ in 0..FALLBACK_CYCLES {
        assert_eq!(motors.torque(None), hold.fallback_torque());
        assert_eq!(motors.drives(), Drives::Active);
    }
    assert_eq!(motors.torque(None), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    // The one who was lost has to have been idle before it gets torque again.
    assert_eq!(motors.torque(Some(&hold)), Ok(Vector::zeros()));
    assert_eq!(motors.drives(), Drives::Idle);
    motors.torque(Some(&answer(None))).expect("four joints");
    assert_eq!(motors.torque(Some(&hold)), hold.torque());
}

#[test]
fn an_answer_in_between_begins_the_100_ms_anew() {
    let hold = answer(Some(Request::GravityHold));
    let mut motors = motors();
    for _ in 0..5 {
        motors.torque(Some(&hold)).expect("four joints");
        for _ in 0..FALLBACK_CYCLES {
            assert_eq!(motors.torque(None), hold.fallback_torque());
        }
    }
    assert_eq!(motors.drives(), Drives::Active);
}

#[test]
fn an_answer_for_another_arm_is_refused() {
    let mut motors = Motors::<3>::new(1e-3);
    assert!(motors.torque(Some(&answer(None))).is_err());
}
