//! Tests of the motors that start-up accepts and refuses. Each refusal contains register, found value, expected value and
//! remedy.

use supple_damiao::inspection::{Expectation, RegisterReadings, TO_READ};
use supple_damiao::{Problem, Register, Value};

fn expectation() -> Expectation<'static> {
    Expectation {
        id: 3,
        reply_id: 0x13,
        gear_ratio: 40.0,
        position_range_rad: 12.5,
        velocity_range_rad_per_s: 10.0,
        torque_range_nm: 28.0,
        firmware_series: Some("51"),
        watchdog_s: 0.02,
        without_watchdog: false,
        fd: true,
    }
}

const GOOD: [(Register, Value); 14] = [
    (Register::ID, Value::Integer(3)),
    (Register::REPLY_ID, Value::Integer(0x13)),
    (Register::FIRMWARE, Value::Text(*b"5117")),
    (Register::GEAR_RATIO, Value::Float(40.01)),
    (Register::POSITION_RANGE, Value::Float(12.5)),
    (Register::VELOCITY_RANGE, Value::Float(10.0)),
    (Register::TORQUE_RANGE, Value::Float(28.0)),
    (Register::MODE, Value::Integer(1)),
    (Register::TIMEOUT, Value::Integer(400)),
    (Register::TORQUE_CONSTANT, Value::Float(0.0)),
    (Register::POLE_PAIRS, Value::Integer(14)),
    (Register::FLUX, Value::Float(0.0048)),
    (Register::SERIAL, Value::Text(*b"T005")),
    (Register::SHAFT_POSITION, Value::Float(0.25)),
];

fn readings(change: Option<(Register, Value)>) -> RegisterReadings {
    let mut readings = RegisterReadings::new();
    for (register, value) in GOOD {
        readings.insert(register, value.to_bytes());
    }
    if let Some((register, value)) = change {
        readings.insert(register, value.to_bytes());
    }
    readings
}

#[test]
fn a_matching_motor_is_accepted() {
    let found = expectation().check(&readings(None), Some(0.251)).unwrap();
    assert_eq!(found.ranges.torque().max(), 28.0);
    assert_eq!((found.write_mode, found.write_timeout), (false, None));
    assert!(found.firmware.reads_registers_in_operation());
}

#[test]
fn mode_and_watchdog_are_written_at_start_up() {
    let changed = readings(Some((Register::MODE, Value::Integer(2))));
    assert!(expectation().check(&changed, None).unwrap().write_mode);
    let changed = readings(Some((Register::TIMEOUT, Value::Integer(0))));
    let found = expectation().check(&changed, None).unwrap();
    assert_eq!(found.write_timeout, Some(400));
}

#[test]
fn a_missing_reading_of_any_register_is_refused_with_its_name() {
    for register in TO_READ {
        let optional = [
            Register::TORQUE_CONSTANT,
            Register::POLE_PAIRS,
            Register::FLUX,
            Register::SERIAL,
        ];
        let mut readings = RegisterReadings::new();
        for (known, value) in GOOD.iter().filter(|(known, _)| *known != register) {
            readings.insert(*known, value.to_bytes());
        }
        let found = expectation().check(&readings, None);
        match optional.contains(&register) {
            true => assert!(found.is_ok(), "{register}"),
            false => assert_eq!(
                found.unwrap_err().problem,
                Problem::RegisterNotRead(register)
            ),
        }
    }
}

#[test]
fn a_refusal_contains_register_found_and_expected_value_and_remedy() {
    for (change, words) in [
        (
            (Register::ID, Value::Integer(4)),
            ["register 8 (ESC_ID) is 4", "expected 3"],
        ),
        (
            (Register::REPLY_ID, Value::Integer(0)),
            ["register 7 (MST_ID) is 0", "expected 19"],
        ),
        (
            (Register::FIRMWARE, Value::Text(*b"5017")),
            ["register 14 (sw_ver) is 5017", "expected 51.."],
        ),
        (
            (Register::FIRMWARE, Value::Text(*b"5112")),
            ["5112 is older", "update the motor's firmware"],
        ),
        (
            (Register::FIRMWARE, Value::Text(*b"5141")),
            ["four motors", "update the motor's firmware"],
        ),
        (
            (Register::GEAR_RATIO, Value::Float(10.0)),
            ["register 20 (Gr) is 10", "expected 40"],
        ),
        (
            (Register::POSITION_RANGE, Value::Float(12.566)),
            ["register 21 (PMAX) is 12.56", "expected 12.5"],
        ),
        (
            (Register::VELOCITY_RANGE, Value::Float(8.0)),
            ["register 22 (VMAX) is 8", "expected 10"],
        ),
        (
            (Register::TORQUE_RANGE, Value::Float(54.0)),
            ["register 23 (TMAX) is 54", "expected 28"],
        ),
        (
            (Register::TORQUE_RANGE, Value::Float(f32::NAN)),
            ["register 23 (TMAX) is NaN", "expected 28"],
        ),
        (
            (Register::SHAFT_POSITION, Value::Float(6.5)),
            ["position is 0.2500 rad", "6.5000 rad in register 81"],
        ),
    ] {
        let refusal = expectation()
            .check(&readings(Some(change)), Some(0.25))
            .unwrap_err();
        let text = refusal.to_string();
        assert!(text.starts_with("motor 3 "), "{text}");
        for part in words {
            assert!(text.contains(part), "{text}: {part}");
        }
        assert!(text.contains("; "), "{text} has no remedy");
    }
}

#[test]
fn a_watchdog_that_stays_off_is_refused_unless_allowed() {
    let expectation = expectation();
    expectation
        .check_written(Register::TIMEOUT, 400, 400)
        .unwrap();
    let refused = expectation
        .check_written(Register::TIMEOUT, 400, 0)
        .unwrap_err();
    assert!(
        refused
            .to_string()
            .contains("register 9 (TIMEOUT) is 0 after 400 was written")
    );
    assert!(refused.to_string().contains("without_watchdog = true"));
    let allowed = Expectation {
        without_watchdog: true,
        ..expectation
    };
    allowed.check_written(Register::TIMEOUT, 400, 0).unwrap();
    assert!(allowed.check_written(Register::MODE, 1, 2).is_err());
}
