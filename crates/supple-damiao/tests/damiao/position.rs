//! Tests of unwrapping whole turns at start-up.

use core::f64::consts::TAU;
use supple_damiao::position::{JointAngle, PositionError};

/// Joint 1 of the OpenArm: -80 to 200 degrees.
const LOWER: f64 = -1.396;
const UPPER: f64 = 3.49;

#[test]
fn every_angle_is_found_from_any_turn() {
    for direction in [1.0, -1.0] {
        let map = JointAngle::new(direction, 0.3);
        for k in 0..=100 {
            let angle_rad = LOWER + (UPPER - LOWER) * f64::from(k) / 100.0;
            for turns in -3..=3 {
                let motor_rad = direction * (angle_rad - 0.3) + f64::from(turns) * TAU;
                let found = map.unwrapped(motor_rad, LOWER, UPPER, 0.02).unwrap();
                assert!((found.joint_rad(motor_rad) - angle_rad).abs() < 1e-12);
                // The next position differs by one step, not by a turn.
                assert!(
                    (found.joint_rad(motor_rad + direction * 1e-3) - angle_rad - 1e-3).abs()
                        < 1e-12
                );
            }
        }
    }
}

#[test]
fn an_angle_outside_the_limits_is_refused() {
    let map = JointAngle::new(1.0, 0.0);
    let refused = map.unwrapped(-1.6, LOWER, UPPER, 0.05).unwrap_err();
    assert!(matches!(refused, PositionError::Outside { .. }));
    assert!(refused.to_string().contains("correct the motor's zero"));
    assert!(map.unwrapped(LOWER - 0.03, LOWER, UPPER, 0.05).is_ok());
    assert!(matches!(
        map.unwrapped(f64::NAN, LOWER, UPPER, 0.05),
        Err(PositionError::Implausible { .. })
    ));
}

#[test]
fn limits_of_more_than_a_turn_are_ambiguous() {
    let map = JointAngle::new(1.0, 0.0);
    let refused = map.unwrapped(0.5, -3.5, 7.0, 0.0).unwrap_err();
    assert!(matches!(refused, PositionError::Ambiguous { .. }));
}
