//! Tests that every faulty condition of a motor becomes the corresponding fault within two cycles, and that the fault stays.

use supple_damiao::guard::{MotorFault, MotorGuard};
use supple_damiao::temperature::{MIN_SHARE, TemperatureLevel, TemperatureLimits};
use supple_damiao::{Feedback, Ranges, Register, Status, Value};

fn thermal() -> TemperatureLimits {
    TemperatureLimits::new(70.0, 80.0, 95.0).unwrap()
}

fn guard() -> MotorGuard {
    MotorGuard::new(3, Ranges::new(12.5, 10.0, 28.0).unwrap(), thermal(), 1e-3)
}

fn feedback() -> Feedback {
    Feedback {
        status: Status::Enabled,
        motor: 3,
        position: 0x8000,
        velocity: 0x800,
        torque: 0x800,
        mosfet_celsius: 40,
        winding_celsius: 35,
    }
}

/// Returns the number of cycles until the fault, counted from the first cycle of the condition, and the fault.
fn until_fault(
    guard: &mut MotorGuard,
    condition: Option<Feedback>,
    answers: u32,
) -> (u32, MotorFault) {
    for _ in 0..5 {
        guard.cycle(Some(&feedback()), 1).unwrap();
    }
    for cycle in 1..=10 {
        if let Err(fault) = guard.cycle(condition.as_ref(), answers) {
            return (cycle, fault);
        }
    }
    panic!("no fault in 10 cycles");
}

#[test]
fn every_error_code_is_a_fault_in_its_cycle() {
    for code in (0..16).filter(|code| *code != 1) {
        let status = Status::from_code(code);
        let condition = Feedback {
            status,
            ..feedback()
        };
        let (cycles, fault) = until_fault(&mut guard(), Some(condition), 1);
        assert_eq!(cycles, 1);
        let expected = match status {
            Status::Disabled => MotorFault::Disabled,
            error => MotorFault::Error(error),
        };
        assert_eq!(fault, expected);
    }
}

#[test]
fn a_silent_motor_is_a_fault_in_the_second_cycle() {
    let (cycles, fault) = until_fault(&mut guard(), None, 0);
    assert_eq!((cycles, fault), (2, MotorFault::Silent { cycles: 2 }));
    // A single lost reply is tolerated, and the age of the feedback is known.
    let mut guard = guard();
    guard.cycle(Some(&feedback()), 1).unwrap();
    guard.cycle(None, 0).unwrap();
    assert_eq!(guard.age_cycles(), 1);
    guard.cycle(Some(&feedback()), 1).unwrap();
    assert_eq!(guard.age_cycles(), 0);
    guard.cycle(None, 0).unwrap();
}

/// Missing replies do not hide a later fault.
#[test]
fn an_error_after_silence_is_reported() {
    let mut guard = guard();
    for _ in 0..10 {
        let _ = guard.cycle(None, 0);
    }
    let over = Feedback {
        status: Status::OverVoltage,
        ..feedback()
    };
    assert_eq!(
        guard.cycle(Some(&over), 1),
        Err(MotorFault::Error(Status::OverVoltage))
    );
}

#[test]
fn a_fault_stays() {
    let mut guard = guard();
    let condition = Feedback {
        status: Status::Overload,
        ..feedback()
    };
    let (_, fault) = until_fault(&mut guard, Some(condition), 1);
    for _ in 0..10 {
        assert_eq!(guard.cycle(Some(&feedback()), 1), Err(fault));
    }
    assert_eq!(guard.fault(), Some(fault));
}

#[test]
fn a_jump_of_the_position_is_a_fault() {
    // 10 rad/s for 1 ms are 26 steps; rounding adds two.
    for (steps, jumps) in [(28, false), (29, true), (2000, true)] {
        let condition = Feedback {
            position: 0x8000 + steps,
            ..feedback()
        };
        let mut guard = guard();
        guard.cycle(Some(&feedback()), 1).unwrap();
        let found = guard.cycle(Some(&condition), 1);
        assert_eq!(
            matches!(found, Err(MotorFault::PositionJump { .. })),
            jumps,
            "{steps}"
        );
    }
}

#[test]
fn two_motors_with_one_id_are_a_fault() {
    let (cycles, fault) = until_fault(&mut guard(), Some(feedback()), 2);
    assert_eq!((cycles, fault), (1, MotorFault::TwoAnswers));
    let other = Feedback {
        motor: 4,
        ..feedback()
    };
    let (cycles, fault) = until_fault(&mut guard(), Some(other), 1);
    assert_eq!(
        (cycles, fault),
        (1, MotorFault::ForeignFeedback { found: 4 })
    );
}

#[test]
fn rising_temperature_causes_warning_then_derating_then_fault() {
    let mut guard = guard();
    let mut last_share = 1.0;
    for celsius in 0..95 {
        let condition = Feedback {
            winding_celsius: celsius,
            mosfet_celsius: 20,
            ..feedback()
        };
        guard.cycle(Some(&condition), 1).unwrap();
        let expected = match celsius {
            0..70 => TemperatureLevel::Normal,
            70..80 => TemperatureLevel::Warning,
            _ => TemperatureLevel::Derating,
        };
        assert_eq!(guard.heat(), expected, "{celsius}");
        assert!(guard.torque_share() <= last_share && guard.torque_share() >= MIN_SHARE);
        assert_eq!(guard.torque_share() < 1.0, celsius > 80);
        last_share = guard.torque_share();
    }
    let condition = Feedback {
        mosfet_celsius: 95,
        ..feedback()
    };
    assert_eq!(
        guard.cycle(Some(&condition), 1),
        Err(MotorFault::Hot { celsius: 95 })
    );
    assert_eq!(guard.torque_share(), MIN_SHARE);
    assert!(TemperatureLimits::new(80.0, 80.0, 95.0).is_none());
}

#[test]
fn a_register_that_changed_is_a_fault() {
    let mut guard = guard();
    let (was, is) = (Value::Integer(400), Value::Integer(0));
    guard.register(Register::TIMEOUT, was, was).unwrap();
    let fault = guard.register(Register::TIMEOUT, was, is).unwrap_err();
    assert_eq!(
        fault.to_string(),
        "register 9 (TIMEOUT) changed from 400 to 0"
    );
    assert_eq!(guard.cycle(Some(&feedback()), 1), Err(fault));
}
