//! The order of the limits: torque in joints and motors, then rate, then a finite check.

use crate::support::configs::{four, rate_limited, seven};
use crate::support::property::{Outcome, check, per_joint};
use crate::support::rig::{Rig, bent};
use proptest::prelude::*;
use supple_core::config::Limits;
use supple_core::controller::{MotorGroups, Request, limit_torque};
use supple_core::{Config, Output, Vector};

/// Factor for the rounding errors of one or two products.
const ROUNDING: f64 = 1.0 + 1e-12;

/// Checks that a torque satisfies the joint limits and the motor limits.
fn within_torque_limits<const N: usize>(
    limits: &Limits<N>,
    motors: &MotorGroups<N>,
    torque: &Vector<N>,
) -> Outcome {
    let motor_torque_nm = motors.motor_torque_nm(torque);
    for i in 0..N {
        let (joint, motor) = (limits.joint_torque_nm[i], limits.motor_torque_nm[i]);
        prop_assert!(
            torque[i].abs() <= joint * ROUNDING,
            "joint {i}: {}",
            torque[i]
        );
        prop_assert!(
            motor_torque_nm[i].abs() <= motor * ROUNDING,
            "motor {i}: {}",
            motor_torque_nm[i]
        );
    }
    Ok(())
}

fn torque_limit<const N: usize>(config: Config<N>) {
    let motors = MotorGroups::new(&config.joint_from_motor);
    let limits = config.limits;
    let sizes = prop_oneof![Just(1.0), Just(30.0), Just(300.0), Just(1e300)];
    check(2000, (per_joint::<N>(1.0), sizes), |(direction, size)| {
        let demand = direction * size;
        let (torque, limited) = limit_torque(&limits, &motors, &demand);
        within_torque_limits(&limits, &motors, &torque)?;
        prop_assert_eq!(limited, torque != demand);
        if within_torque_limits(&limits, &motors, &demand).is_ok() {
            prop_assert!((torque - demand).norm() <= 1e-11 * demand.norm());
        }
        let (again, _) = limit_torque(&limits, &motors, &torque);
        prop_assert!((again - torque).norm() <= 1e-12 * torque.norm());
        for i in 0..N {
            // The limit reduces the magnitude and keeps the sign.
            prop_assert!(torque[i].abs() <= demand[i].abs());
            prop_assert!(torque[i] * demand[i] >= 0.0);
        }
        Ok(())
    });
}

#[test]
fn torque_limit_of_4_joints() {
    torque_limit(four());
}

#[test]
fn torque_limit_of_7_joints() {
    torque_limit(seven());
}

/// Pitch and roll share two motors and are scaled together, keeping their ratio; base and elbow are
/// unaffected.
#[test]
fn motors_that_share_joints_are_scaled_together() {
    let config = four();
    let motors = MotorGroups::new(&config.joint_from_motor);
    let demand = Vector::<4>::new(10.0, 70.0, 40.0, 5.0);
    let (torque, limited) = limit_torque(&config.limits, &motors, &demand);
    assert!(limited);
    assert_eq!((torque[0], torque[3]), (10.0, 5.0));
    assert!((torque[1] / torque[2] - 70.0 / 40.0).abs() < 1e-12);
    // With motor torques m2 and m3: 28.25 (m2 - m3) = 70, -16.8155 (m2 + m3) = 40, so that the third motor has the
    // larger torque.
    let motor_torque_nm = motors.motor_torque_nm(&torque);
    assert!(
        (motor_torque_nm[2].abs() - 1.8).abs() < 1e-12,
        "{motor_torque_nm}"
    );
    assert!(motor_torque_nm[1].abs() < 1.8);
    // By the published ratios: `tau = j2mp^T m`, with `j2mp` the inverse of `joint_from_motor`.
    let pitch_nm = 28.25 * (motor_torque_nm[1] - motor_torque_nm[2]);
    assert!((pitch_nm - torque[1]).abs() < 1e-9);
}

/// Motor torques are `m2jp^T tau`, where `m2jp` (`joint_from_motor`) gives joint angles from motor angles.
#[test]
fn motor_torques_give_the_same_power_as_joint_torques() {
    let config = seven();
    let motors = MotorGroups::new(&config.joint_from_motor);
    check(
        200,
        (per_joint::<7>(50.0), per_joint::<7>(50.0)),
        |(torque, motor_speed)| {
            let joint_speed = config.joint_from_motor * motor_speed;
            let (joint_power, motor_power) = (
                torque.dot(&joint_speed),
                motors.motor_torque_nm(&torque).dot(&motor_speed),
            );
            prop_assert!((joint_power - motor_power).abs() < 1e-9 * (1.0 + joint_power.abs()));
            Ok(())
        },
    );
}

/// Checks the limits in each cycle while the encoder angles jump at random. The torque limits are low, so that they
/// act; the limits of the supervision are too high to cause a fault.
fn check_limits_under_random_motion<const N: usize>(
    mut config: Config<N>,
    joint_torque: f64,
    motor_torque: f64,
    rate: f64,
) {
    config.limits.joint_torque_nm.fill(joint_torque);
    config.limits.motor_torque_nm.fill(motor_torque);
    config.limits.torque_rate_nm_per_s.fill(rate);
    config.limits.joint_speed_rad_per_s.fill(1e6);
    config.limits.tip_speed_m_per_s = 1e6;
    config.limits.tracking_error_m = 1e6;
    config.limits.joint_tracking_error_rad = 1e6;
    config.limits.start_error_m = 1e6;
    let offsets_rad = proptest::collection::vec(per_joint::<N>(0.3), 60);
    check(40, offsets_rad, |offsets_rad| {
        let mut rig = Rig::holding(config, bent());
        let mut last = rig.cycle();
        let (mut torque_limited_cycles, mut rate_limited_cycles) = (0, 0);
        for (k, offset_rad) in offsets_rad.into_iter().enumerate() {
            rig.q = bent::<N>() + offset_rad;
            let output = match k % 20 {
                3 => rig.request(rig.hold_tip_request()),
                9 => rig.request(Request::GravityHold),
                15 => rig.request(Request::Move {
                    target_rad: bent(),
                    duration_s: 0.5,
                }),
                _ => rig.cycle(),
            };
            prop_assert_eq!(output.fault, None);
            follows_from_last_torque(&rig, &last, &output)?;
            torque_limited_cycles += u32::from(output.torque_limited);
            rate_limited_cycles += u32::from(output.rate_limited);
            last = output;
        }
        prop_assert!(
            torque_limited_cycles + rate_limited_cycles > 5,
            "the torque limit acted in {torque_limited_cycles} cycles, the rate limit in {rate_limited_cycles}"
        );
        Ok(())
    });
}

/// Checks that a cycle's torque is the sum of the terms after the torque limit, approached from the last
/// cycle's torque at the rate limit.
fn follows_from_last_torque<const N: usize>(
    rig: &Rig<N>,
    last: &Output<N>,
    output: &Output<N>,
) -> Outcome {
    let config = rig.controller.config();
    let (limits, motors) = (&config.limits, rig.controller.motors());
    within_torque_limits(limits, motors, &output.torque_nm)?;
    let demand = output.torques.total();
    let (target, torque_limited) = limit_torque(limits, motors, &demand);
    prop_assert_eq!(output.torque_limited, torque_limited);
    let expected = rate_limited(config, &last.torque_nm, &target);
    let scale = 1.0 + target.norm();
    prop_assert!((output.torque_nm - expected).norm() <= 1e-9 * scale);
    prop_assert_eq!(output.rate_limited, output.torque_nm != target);
    for i in 0..N {
        let max = limits.torque_rate_nm_per_s[i] * config.period_s;
        let step = (output.torque_nm[i] - last.torque_nm[i]).abs();
        prop_assert!(step <= max * ROUNDING + 1e-13, "joint {i}: {step}");
    }
    Ok(())
}

#[test]
fn every_cycle_applies_the_torque_limit_then_the_rate_limit() {
    check_limits_under_random_motion(four(), 12.0, 1.8, 3000.0);
    check_limits_under_random_motion(four(), 80.0, 0.3, 2000.0);
    check_limits_under_random_motion(four(), 80.0, 1.8, 100.0);
    check_limits_under_random_motion(seven(), 10.0, 0.4, 1000.0);
}

/// Repeated or missing states do not allow a larger torque step.
#[test]
fn the_rate_limit_applies_once_per_step_whatever_the_cycle_number() {
    let mut config = four();
    config.limits.torque_rate_nm_per_s.fill(500.0);
    let mut rig = Rig::new(config, bent());
    rig.cycle();
    let mut last = rig.request(Request::GravityHold);
    for k in 0_u64..30 {
        let mut input = rig.input();
        input.cycle = match k % 3 {
            0 => input.cycle - 1,
            1 => input.cycle,
            _ => input.cycle + 1,
        };
        let output = rig.step(&input);
        assert_eq!(output.fault, None);
        let step = (output.torque_nm - last.torque_nm).amax();
        assert!(step <= 0.5 * ROUNDING, "{step}");
        last = output;
    }
}
