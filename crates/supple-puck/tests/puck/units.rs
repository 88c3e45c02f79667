//! Conversions between SI units and counts: rounding, saturation, rejected values.

use crate::property::config;
use proptest::prelude::*;
use supple_puck::force_torque::Quantity;
use supple_puck::safety::{SafetyLimits, SafetyMode, SpeedLimit};
use supple_puck::status::{MotorMode, Role, RoleType, Stat};
use supple_puck::*;

#[test]
fn torques_round_to_nearest_with_halves_away_from_zero() {
    let scale = TorqueScale::new(1.0).unwrap();
    let units = |torque_nm| scale.puck_torque(torque_nm).unwrap().units();
    let torques = [0.0, 0.49, 0.5, 1.49, 1.5, 2.5, 8190.5, 8191.4, 9e9];
    let expected = [0, 0, 1, 1, 2, 3, 8191, 8191, 8191];
    assert_eq!(torques.map(units), expected);
    assert_eq!(torques.map(|t| units(-t)), expected.map(|u| -u));
    assert_eq!(units(f64::MAX), 8191);
    assert_eq!(units(0.499_999_999_999_999_94), 0);
}

#[test]
fn nonfinite_values_are_rejected_and_not_saturated() {
    let scale = TorqueScale::new(2700.0).unwrap();
    for torque_nm in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(scale.puck_torque(torque_nm).is_err());
        assert!(Quantity::Force.counts([0.0, torque_nm, 0.0]).is_err());
        assert!(SpeedLimit::from_m_per_s(torque_nm).is_err());
        assert!(PositionScale::new(4096).unwrap().counts(torque_nm).is_err());
        assert!(TorqueScale::new(torque_nm).is_err());
    }
    assert!(TorqueScale::new(0.0).is_err() && TorqueScale::new(-1.0).is_err());
    assert!(PositionScale::new(0).is_err());
}

/// Maximum torques of the arm's motors, at about 20 % of the breaking load of their cables.
#[test]
fn puck_units_convert_to_the_published_torque_limits() {
    for (units_per_nm, units, torque_nm) in [
        (2700.0, 4860, 1.8),
        (2700.0, 4320, 1.6),
        (6500.0, 3900, 0.6),
    ] {
        let scale = TorqueScale::new(units_per_nm).unwrap();
        let found = scale.torque_nm(PuckTorque::saturating(units));
        assert!((found - torque_nm).abs() < 1e-12);
    }
}

#[test]
fn a_revolution_is_4096_counts() {
    let scale = PositionScale::new(4096).unwrap();
    let revolution = Counts::new(4096).unwrap();
    assert!((scale.rad(revolution) - std::f64::consts::TAU).abs() < 1e-12);
    assert!(scale.counts(std::f64::consts::TAU * 512.0).is_err());
    assert_eq!(
        scale.counts(-std::f64::consts::TAU * 512.0),
        Ok(Counts::MIN)
    );
}

#[test]
fn speed_limits_are_rounded_down_but_never_to_zero() {
    let value = |speed| SpeedLimit::from_m_per_s(speed).map(SpeedLimit::value);
    assert_eq!(value(1.0), Ok(0x1000));
    assert_eq!(value(0.5), Ok(2048));
    assert_eq!(value(1.0 - 1e-9), Ok(0x0fff));
    assert_eq!(value(1.0 / 4096.0), Ok(1));
    for rejected in [0.0, 1e-4, -1.0, 8.0] {
        assert!(value(rejected).is_err(), "{rejected}");
    }
    assert_eq!(SpeedLimit::from_value(0), Ok(None));
}

#[test]
fn safety_limits_default_to_those_of_the_module() {
    let limits = SafetyLimits::default();
    assert_eq!(limits.validate(), Ok(()));
    let settings = limits.settings().map(|(name, value)| (name, value.get()));
    assert_eq!(
        settings,
        [
            (Property::VL1, 2048),
            (Property::VL2, 4096),
            (Property::TL1, 4731),
            (Property::TL2, 5204),
        ]
    );
    let no_speed_fault = SafetyLimits {
        speed_fault: None,
        ..limits
    };
    assert_eq!(no_speed_fault.validate(), Ok(()));
    assert_eq!(
        no_speed_fault.settings()[1],
        (Property::VL2, Value::Wide(0))
    );
    let swapped = SafetyLimits {
        speed_warning: limits.speed_fault,
        speed_fault: limits.speed_warning,
        ..limits
    };
    assert_eq!(
        swapped.validate().unwrap_err().to_string(),
        "speed warning is 1 m/s, it must not be above the fault at 0.5 m/s"
    );
    for (torque_warning, torque_fault) in [(5, 4), (-2, 4), (-2, -1)] {
        let limits = SafetyLimits {
            torque_warning: PuckTorque::saturating(torque_warning),
            torque_fault: PuckTorque::saturating(torque_fault),
            ..limits
        };
        assert!(limits.validate().is_err());
    }
}

#[test]
fn the_host_can_only_lower_the_mode_of_the_safety_module() {
    use SafetyMode::{Active, EStop, Idle};
    for (mode, requested, after) in [
        (EStop, Idle, EStop),
        (EStop, Active, EStop),
        (Idle, Active, Idle),
        (Idle, EStop, EStop),
        (Active, Idle, Idle),
        (Active, EStop, EStop),
        (Active, Active, Active),
    ] {
        assert_eq!(mode.after_request(requested), after);
    }
}

#[test]
fn statuses_and_modes_have_the_documented_numbers() {
    assert_eq!(Stat::from_value(2), Ok(Stat::Ready));
    assert_eq!(MotorMode::from_value(2), Ok(MotorMode::Torque));
    assert_eq!(
        Stat::from_value(3).unwrap_err().to_string(),
        "STAT is 3, expected 0 (reset), 1 (error) or 2 (ready)"
    );
    assert!(MotorMode::from_value(6).is_err() && SafetyMode::from_value(-1).is_err());
}

#[test]
fn roles_contain_type_and_options() {
    assert_eq!(Role::ARM_MOTOR.role_type(), Ok(RoleType::Tater));
    assert!(Role::ARM_MOTOR.magnetic_encoder_serial());
    assert!(!Role::ARM_MOTOR.joint_encoder());
    assert!(Role::ARM_MOTOR_WITH_JOINT_ENCODER.joint_encoder());
    assert_eq!(Role::SAFETY.kind(), Some(PuckKind::Safety));
    assert_eq!(Role::FORCE.kind(), Some(PuckKind::ForceTorque));
    assert_eq!(Role(5).kind(), Some(PuckKind::Motor));
    assert_eq!([Role(1).kind(), Role(4).kind(), Role(7).kind()], [None; 3]);
    // Each option bit changes exactly one query.
    for bit in 6..15 {
        let role = Role(1 << bit);
        let answers = [
            role.temperature_select(),
            role.clock_20_mhz(),
            role.magnetic_encoder_serial(),
            role.magnetic_encoder_hall(),
            role.magnetic_encoder(),
            role.strain(),
            role.tactile(),
            role.imu(),
            role.joint_encoder(),
        ];
        assert_eq!(answers, core::array::from_fn(|index| index + 6 == bit));
    }
}

proptest! {
    #![proptest_config(config(1000, 20_260_302))]

    #[test]
    fn torques_are_within_half_a_unit_and_symmetric_about_zero(
        scale in 500.0..25_000.0,
        fraction in -1.0..1.0f64,
    ) {
        let torque_nm = fraction * 8191.0 / scale;
        let scale = TorqueScale::new(scale).unwrap();
        let found = scale.puck_torque(torque_nm).unwrap();
        let error = (scale.torque_nm(found) - torque_nm) * scale.units_per_nm();
        prop_assert!(error.abs() <= 0.5 + 1e-9);
        let opposite = scale.puck_torque(-torque_nm).unwrap();
        prop_assert_eq!(opposite.units(), -found.units());
    }

    #[test]
    fn counts_round_trip_through_radians(
        counts in Counts::MIN.get()..=Counts::MAX.get(),
        per_revolution in 1..1_600_000,
    ) {
        let scale = PositionScale::new(per_revolution).unwrap();
        let counts = Counts::new(counts).unwrap();
        prop_assert_eq!(scale.counts(scale.rad(counts)), Ok(counts));
    }

    #[test]
    fn sensor_counts_are_within_half_a_count_and_saturate(value in -300.0..300.0f64) {
        for quantity in [Quantity::Force, Quantity::Torque, Quantity::Acceleration] {
            let exact = value * quantity.counts_per_unit();
            let [found, ..] = quantity.counts([value; 3]).unwrap();
            let clamped = exact.clamp(-32768.0, 32767.0);
            prop_assert!((f64::from(found) - clamped).abs() <= 0.5);
        }
    }
}
