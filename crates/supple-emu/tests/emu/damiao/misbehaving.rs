//! Tests that start-up refuses each misbehaviour, or that it becomes the corresponding fault within two cycles.

use super::host::{Host, MS, host};
use supple_bus::{Bus, BusFault, Event};
use supple_core::Vector;
use supple_damiao::guard::{MotorFault, MotorGuard};
use supple_damiao::position::{JointAngle, PositionError};
use supple_damiao::temperature::TemperatureLimits;
use supple_damiao::{Problem, Register, Status};
use supple_emu::damiao::Misbehaviour;

fn misbehaving(specs: &[&str]) -> Host<7> {
    let mut host = host::<7>("openarm", |_| {}, None);
    let parsed: Vec<Misbehaviour> = specs.iter().map(|spec| spec.parse().unwrap()).collect();
    host.bus.0.misbehave(&parsed).unwrap();
    host
}

/// Starts motors with these misbehaviours and returns the refusal; asserts that no motor has torque.
fn refusal(specs: &[&str]) -> (u8, Problem) {
    let mut host = misbehaving(specs);
    let refusal = host.start().expect_err("a refusal");
    assert!(refusal.to_string().contains("; "));
    assert_eq!(host.emulated().motor_torque_nm(), Vector::<7>::zeros());
    (refusal.motor, refusal.problem)
}

#[test]
fn bad_motors_are_refused_at_the_start() {
    assert_eq!(refusal(&["silent:motor=4"]), (4, Problem::Silent));
    assert_eq!(refusal(&["enabled:motor=2"]), (2, Problem::AlreadyEnabled));
    assert_eq!(
        refusal(&["error:motor=5,code=B"]),
        (5, Problem::MotorError(Status::MosfetHot))
    );
    assert_eq!(
        refusal(&["same-id:motor=6,with=5"]),
        (5, Problem::TwoAnswers)
    );
    // Joints 4 and 5 have motors of other types.
    let (motor, problem) = refusal(&["swapped:motor=4,with=5"]);
    let expected = Problem::NumberMismatch {
        register: Register::GEAR_RATIO,
        found: 10.0,
        expected: 40.0,
    };
    assert_eq!((motor, problem), (4, expected));
    let (motor, problem) = refusal(&["register:motor=3,number=22,value=8"]);
    let expected = Problem::NumberMismatch {
        register: Register::VELOCITY_RANGE,
        found: 8.0,
        expected: 10.0,
    };
    assert_eq!((motor, problem), (3, expected));
    let (motor, problem) = refusal(&["register:motor=1,number=14,value=6441"]);
    assert!(
        motor == 1 && matches!(problem, Problem::UnsupportedFirmware(_)),
        "{problem}"
    );
    let (motor, problem) = refusal(&["no-watchdog:motor=7"]);
    let expected = Problem::WriteIgnored {
        register: Register::TIMEOUT,
        found: 0,
        expected: 400,
    };
    assert_eq!((motor, problem), (7, expected));
    // The reply id shows a motor that replies with the id of another motor.
    let (motor, problem) = refusal(&["register:motor=2,number=7,value=0"]);
    assert_eq!(
        (motor, problem),
        (
            2,
            Problem::ReplyIdMismatch {
                found: 0,
                expected: 0x12
            }
        )
    );
}

#[test]
fn a_wrong_mode_and_an_ignored_write_are_set_right() {
    let mut host = misbehaving(&[
        "register:motor=3,number=10,value=2",
        "first-write-ignored:motor=4",
    ]);
    host.start().unwrap();
    host.hold(50, MS);
    for motor in host.emulated().motors() {
        assert_eq!(motor.register(Register::MODE), [1, 0, 0, 0]);
        assert_eq!(motor.register(Register::TIMEOUT), 400u32.to_le_bytes());
    }
}

/// A whole turn is unwrapped; a zero position that puts the angle outside the limits is refused.
#[test]
fn a_whole_turn_is_unwrapped_and_a_wrong_zero_is_refused() {
    let angle = |spec: &str| {
        let mut host = misbehaving(&[spec]);
        host.cycle(&Vector::zeros(), 0.0, 3 * MS);
        let limits = host.description.config::<7>().unwrap().limits;
        let (lower, upper) = (limits.position_lower_rad[1], limits.position_upper_rad[1]);
        let motor_rad = host.feedback[1].unwrap().position_rad(&host.ranges[1]);
        let found = JointAngle::new(1.0, 0.0).unwrapped(motor_rad, lower, upper, 0.0);
        found.map(|map| map.joint_rad(motor_rad))
    };
    for spec in [
        "zero:motor=2,offset-rad=6.2831853",
        "zero:motor=2,offset-rad=-6.2831853",
    ] {
        assert!((angle(spec).unwrap() - 0.3).abs() < 1e-3);
    }
    assert!(matches!(
        angle("zero:motor=2,offset-rad=-0.6"),
        Err(PositionError::Outside { .. })
    ));
}

/// Returns the number of cycles from the misbehaviour to the fault of the motor's guard, and the fault.
fn fault_of(spec: &str, motor: usize) -> (u32, MotorFault) {
    let mut host = misbehaving(&[spec]);
    host.start().unwrap();
    let thermal = TemperatureLimits::new(70.0, 80.0, 95.0).unwrap();
    let mut guard = MotorGuard::new(motor as u8 + 1, host.ranges[motor], thermal, 1e-3);
    let mut begun: Option<u32> = None;
    for cycle in 0..400 {
        host.hold(1, MS);
        let begun_now = host.emulated().injections_begun() > 0;
        begun = begun.or(begun_now.then_some(cycle));
        let feedback = host.feedback[motor].filter(|_| host.answers[motor] > 0);
        if let Err(fault) = guard.cycle(feedback.as_ref(), host.answers[motor]) {
            return (cycle - begun.expect("the misbehaviour has begun"), fault);
        }
    }
    panic!("{spec}: no fault")
}

#[test]
fn a_misbehaviour_in_a_run_becomes_its_fault_within_two_cycles() {
    for (code, status) in [
        ('8', Status::OverVoltage),
        ('9', Status::UnderVoltage),
        ('A', Status::OverCurrent),
        ('B', Status::MosfetHot),
        ('C', Status::WindingHot),
        ('D', Status::CommunicationLost),
        ('E', Status::Overload),
        ('5', Status::Unknown(5)),
    ] {
        let (cycles, fault) = fault_of(&format!("error:motor=3,code={code},at-s=0.05"), 2);
        assert_eq!(fault, MotorFault::Error(status));
        assert!(cycles <= 2, "{code}: {cycles}");
    }
    for (spec, motor, expected) in [
        (
            "silent:motor=1,at-s=0.05",
            0,
            MotorFault::Silent { cycles: 2 },
        ),
        ("reappears:motor=6,at-s=0.05", 5, MotorFault::Disabled),
        (
            "hot:motor=4,celsius=96,at-s=0.05",
            3,
            MotorFault::Hot { celsius: 96 },
        ),
        (
            "same-id:motor=7,with=6,at-s=0.05",
            5,
            MotorFault::TwoAnswers,
        ),
    ] {
        let (cycles, fault) = fault_of(spec, motor);
        match (fault, expected) {
            // The motor cools or heats slightly until its feedback.
            (MotorFault::Hot { celsius }, MotorFault::Hot { .. }) => {
                assert!((94..=97).contains(&celsius))
            }
            _ => assert_eq!(fault, expected, "{spec}"),
        }
        assert!(cycles <= 2, "{spec}: {cycles}");
    }
    let (cycles, fault) = fault_of("register:motor=2,number=21,value=6.25,at-s=0.05", 1);
    assert!(
        cycles <= 2 && matches!(fault, MotorFault::PositionJump { .. }),
        "{fault}"
    );
}

/// Every third reply is lost: never two in a row, so there is no fault, and the age of the state is known.
#[test]
fn single_lost_replies_are_tolerated() {
    let mut host = misbehaving(&["reply-lost:motor=2,every=3,at-s=0.01"]);
    host.start().unwrap();
    let thermal = TemperatureLimits::new(70.0, 80.0, 95.0).unwrap();
    let mut guard = MotorGuard::new(2, host.ranges[1], thermal, 1e-3);
    let mut lost = 0;
    for _ in 0..200 {
        host.hold(1, MS);
        let feedback = host.feedback[1].filter(|_| host.answers[1] > 0);
        guard.cycle(feedback.as_ref(), host.answers[1]).unwrap();
        lost += guard.age_cycles();
    }
    assert!((55..=70).contains(&lost), "{lost}");
}

/// The ids of two motors of one type are exchanged: every register matches, but a torque at one joint moves the encoder of
/// the other joint.
#[test]
fn a_small_motion_reveals_exchanged_ids_of_equal_motors() {
    for swapped in [false, true] {
        let specs: &[&str] = match swapped {
            true => &["swapped:motor=5,with=7"],
            false => &[],
        };
        // In the hanging pose, gravity moves neither joint.
        let mut host = host::<7>("openarm", |_| {}, Some(Vector::zeros()));
        let parsed: Vec<Misbehaviour> = specs.iter().map(|spec| spec.parse().unwrap()).collect();
        host.bus.0.misbehave(&parsed).unwrap();
        host.start().unwrap();
        host.hold(20, MS);
        let before_rad = host.joints_rad();
        let true_before_rad = host.emulated().truth().position_rad;
        for _ in 0..60 {
            let mut torque_nm = supple_core::dynamics::gravity(&host.arm, &host.joints_rad());
            torque_nm[4] += 0.8;
            host.cycle(&torque_nm, 0.1, MS);
        }
        let moved_rad = host.joints_rad() - before_rad;
        let truly_rad = host.emulated().truth().position_rad - true_before_rad;
        assert!(moved_rad[4] > 0.02, "{moved_rad}");
        // The encoder with the id of joint 5 moves in both cases; only the model, or another measurement, reveals the exchange.
        let found = if truly_rad[4].abs() > truly_rad[6].abs() {
            4
        } else {
            6
        };
        assert_eq!(found, if swapped { 6 } else { 4 });
    }
}

#[test]
fn a_bus_off_recovers_and_a_wedged_adapter_sends_no_frames() {
    let mut host = misbehaving(&["bus-off:at-s=0.02"]);
    host.start().unwrap();
    let until_ns = host.bus.now_ns() + 300 * MS;
    let mut faults = Vec::new();
    while let Some(event) = host.bus.receive_until(until_ns).unwrap() {
        if let Event::Fault(fault) = event {
            faults.push(fault);
        }
    }
    assert_eq!(faults, [BusFault::BusOff, BusFault::Restarted]);
    let mut host = misbehaving(&["wedged:at-s=0.02"]);
    host.start().unwrap();
    host.hold(40, MS);
    assert_eq!(host.answers, [0; 7]);
    let lost = |motor: &supple_emu::damiao::Motor| motor.status() == Status::CommunicationLost;
    assert!(host.emulated().motors().iter().all(lost));
}

#[test]
fn invalid_specifications_are_rejected_with_the_reason() {
    for (text, words) in [
        ("flat:motor=1", "the kind `flat` does not exist"),
        ("silent", "motor is missing"),
        ("silent:motor=0", "motors count from 1"),
        ("error:motor=1,code=1", "from 2 to F"),
        ("hot:motor=1,celsius=x", "celsius=x is not valid"),
        ("silent:motor=1,at-s=-1", "at-s=-1 must be"),
        ("silent:motor=1,code=B", "no key `code`"),
        (
            "register:motor=1,number=99,value=1",
            "register 99 is not known",
        ),
    ] {
        let error = text.parse::<Misbehaviour>().unwrap_err().to_string();
        assert!(error.contains(words) && error.contains(text), "{error}");
    }
    let mut host = host::<7>("openarm", |_| {}, None);
    let beyond: Misbehaviour = "silent:motor=8".parse().unwrap();
    assert!(host.bus.0.misbehave(&[beyond]).is_err());
}
