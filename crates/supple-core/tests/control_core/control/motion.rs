//! Motion faults: each occurs exactly when its limit is exceeded.

use super::faults::latched;
use crate::support::configs::four;
use crate::support::rig::{Rig, bent};
use supple_core::controller::{Fault, Mode, Request, SafeAction};
use supple_core::{Output, Vector};

#[test]
fn joint_position() {
    let limits = four().limits;
    for joint in 0..4 {
        for limit_rad in [
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
        ] {
            let mut q = bent::<4>();
            q[joint] = limit_rad - 0.03 * limit_rad.signum();
            let mut config = four();
            config.limits.joint_tracking_error_rad = f64::MAX;
            let mut rig = Rig::holding(config, q);
            for _ in 0..299 {
                rig.q[joint] += 1e-4 * limit_rad.signum();
                rig.cycle();
            }
            rig.q[joint] = limit_rad;
            rig.rest();
            assert_eq!(
                rig.state.mode(),
                Mode::GravityHold,
                "at the stop, not beyond"
            );
            rig.q[joint] = if limit_rad > 0.0 {
                limit_rad.next_up()
            } else {
                limit_rad.next_down()
            };
            let output = rig.cycle();
            let expected = Fault::JointPosition {
                joint,
                value_rad: rig.q[joint],
                limit_rad,
            };
            assert_eq!(output.fault, Some(expected));
            rig.q[joint] = limit_rad;
            latched(rig, &output, SafeAction::Stop);
        }
    }
}

/// Drives `rig` along `path` until a fault; calls `on_cycle` in every cycle.
fn until_fault(
    rig: &mut Rig<4>,
    path: impl Fn(f64) -> Vector<4>,
    mut on_cycle: impl FnMut(&Output<4>),
) -> Output<4> {
    for k in 0..20_000 {
        rig.q = path(1e-3 * f64::from(k));
        let output = rig.cycle();
        on_cycle(&output);
        if output.fault.is_some() {
            return output;
        }
    }
    panic!("no fault");
}

#[test]
fn joint_speed() {
    for joint in 0..4 {
        for sign in [1.0, -1.0] {
            let mut config = four();
            config.limits.joint_speed_rad_per_s[joint] = 0.6;
            let mut rig = Rig::holding(config, bent());
            let (start, mut limit_kept) = (rig.q, true);
            let path = |t: f64| {
                let mut q = start;
                q[joint] += sign * 0.5 * t * t;
                q
            };
            let output = until_fault(&mut rig, path, |output| {
                if output.fault.is_none() {
                    limit_kept &= output.velocity_rad_per_s[joint].abs() <= 0.6;
                }
            });
            let value_rad_per_s = output.velocity_rad_per_s[joint].abs();
            let expected = Fault::JointSpeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s: 0.6,
            };
            assert_eq!(output.fault, Some(expected));
            assert!(limit_kept && value_rad_per_s > 0.6 && value_rad_per_s < 0.601);
            latched(rig, &output, SafeAction::Stop);
        }
    }
}

#[test]
fn tip_speed() {
    let mut config = four();
    config.limits.tip_speed_m_per_s = 0.3;
    let mut rig = Rig::holding(config, bent());
    let start = rig.q;
    let path = |t: f64| start + Vector::<4>::new(0.5 * t * t, 0.0, 0.0, 0.0);
    let mut limit_kept = true;
    let output = until_fault(&mut rig, path, |output| {
        if output.fault.is_none() {
            limit_kept &= output.tip_velocity_m_per_s.norm() <= 0.3;
        }
    });
    let value_m_per_s = output.tip_velocity_m_per_s.norm();
    let Some(Fault::TipSpeed {
        value_m_per_s: value,
        limit_m_per_s,
    }) = output.fault
    else {
        panic!("{:?}", output.fault);
    };
    assert!((value - value_m_per_s).abs() < 1e-15 && limit_m_per_s == 0.3);
    assert!(limit_kept && value > 0.3 && value < 0.301);
    latched(rig, &output, SafeAction::Stop);
}

#[test]
fn tracking_error() {
    let mut config = four();
    config.limits.tracking_error_m = 0.1;
    for probing in [false, true] {
        let mut rig = Rig::new(config, bent());
        rig.bring_to(if probing { Mode::Probe } else { Mode::Track });
        let start = rig.q;
        let path = |t: f64| start + Vector::<4>::new(0.2 * t, 0.0, 0.0, 0.0);
        let mut last = 0.0;
        let output = until_fault(&mut rig, path, |output| {
            if let Some(reference) = output.reference {
                last = (reference.position - output.tip_position_m).norm();
                assert!(last <= 0.1);
            }
        });
        let Some(Fault::TrackingError { value_m, limit_m }) = output.fault else {
            panic!("{:?}", output.fault);
        };
        assert!(limit_m == 0.1 && value_m > 0.1 && value_m < last + 1e-3);
        latched(rig, &output, SafeAction::Stop);
    }
}

/// No fault with the held roll joint at its set-point; a fault if it is pushed beyond the limit.
#[test]
fn joint_tracking_error_of_a_held_joint() {
    let mut config = four();
    config.limits.joint_tracking_error_rad = 0.1;
    for sign in [1.0, -1.0] {
        for mode in [Mode::GravityHold, Mode::Track] {
            let mut rig = Rig::new(config, bent());
            rig.bring_to(mode);
            let path = |t: f64| bent() + Vector::<4>::new(0.0, 0.0, sign * 0.2 * t, 0.0);
            let output = until_fault(&mut rig, path, |output| {
                let away = output.position_rad[2].abs();
                assert_eq!(output.fault.is_some(), away > 0.1, "{away}");
            });
            let expected = Fault::JointTrackingError {
                joint: 2,
                value_rad: rig.q[2].abs(),
                limit_rad: 0.1,
            };
            assert_eq!(output.fault, Some(expected));
            go_back(&mut rig);
            latched(rig, &output, SafeAction::Stop);
        }
    }
}

/// A joint that is blocked in a move faults when its reference is too far ahead.
#[test]
fn joint_tracking_error_on_a_move() {
    let mut config = four();
    config.limits.joint_tracking_error_rad = 0.1;
    for joint in [0, 1, 3] {
        let mut rig = Rig::holding(config, bent());
        let mut target_rad = bent::<4>();
        target_rad[joint] += 0.5;
        rig.accept(Request::Move {
            target_rad,
            duration_s: 1.0,
        });
        let mut last = 0.0;
        let output = until_fault(
            &mut rig,
            |_| bent(),
            |output| {
                if output.fault.is_none() {
                    let x = output.mode_time_s;
                    last = 0.5 * (10.0 * x.powi(3) - 15.0 * x.powi(4) + 6.0 * x.powi(5));
                    assert!(last <= 0.1, "{last} rad behind");
                }
            },
        );
        let Some(Fault::JointTrackingError {
            joint: named,
            value_rad,
            limit_rad,
        }) = output.fault
        else {
            panic!("{:?}", output.fault);
        };
        assert_eq!((named, limit_rad), (joint, 0.1));
        assert!(value_rad > 0.1 && value_rad < last + 2e-3);
        latched(rig, &output, SafeAction::Stop);
    }
}

/// Moves the arm back to its pose within its speed limit.
fn go_back(rig: &mut Rig<4>) {
    let from = rig.q;
    for k in 1..=400 {
        rig.q = from + (bent() - from) * (f64::from(k) / 400.0);
        rig.cycle();
    }
}

/// An angle beyond twenty times the speed limit times the time since the last state counts as a
/// lost encoder.
#[test]
fn encoder_jump() {
    for joint in 0..4 {
        for sign in [1.0, -1.0] {
            for cycles in [1_u32, 3] {
                let limit = 20.0 * 2.0 * 1e-3 * f64::from(cycles);
                let jump = |share: f64| {
                    let mut rig = Rig::holding(four(), bent());
                    rig.cycle += u64::from(cycles) - 1;
                    rig.q[joint] += sign * share * limit;
                    let output = rig.cycle();
                    (rig, output)
                };
                let (_, accepted) = jump(0.999);
                let taken = !matches!(accepted.fault, Some(Fault::EncoderJump { .. }));
                assert!(taken, "{:?}", accepted.fault);
                let (mut rig, output) = jump(1.001);
                let Some(Fault::EncoderJump {
                    joint: named,
                    value_rad,
                    limit_rad,
                }) = output.fault
                else {
                    panic!("{:?}", output.fault);
                };
                assert_eq!(named, joint);
                assert!((limit_rad - limit).abs() < 1e-12);
                assert!((value_rad - 1.001 * limit).abs() < 1e-9);
                rig.q = bent();
                latched(rig, &output, SafeAction::Brake);
            }
        }
    }
}

#[test]
fn impossible_angle_removes_torque() {
    for joint in 0..4 {
        for wild in [-40.0, -0.5, 0.1, 3.0, 1e300] {
            let mut rig = Rig::holding(four(), bent());
            let speed_limit = rig.controller.config().limits.joint_speed_rad_per_s[joint];
            let before = rig.q[joint];
            rig.q[joint] += wild;
            let output = rig.cycle();
            let Some(Fault::EncoderJump {
                joint: found,
                limit_rad,
                ..
            }) = output.fault
            else {
                panic!("{wild} rad on joint {joint}: {:?}", output.fault);
            };
            assert_eq!(found, joint);
            assert!(limit_rad < 0.1 * speed_limit, "{limit_rad}");
            assert_eq!(output.fallback_torque_nm.norm(), 0.0);
            // Whether the angle stays there or returns: no torque is computed from it.
            for q in [rig.q[joint], before] {
                rig.q[joint] = q;
                let later = rig.rest();
                assert_eq!(later.torque_nm.norm(), 0.0);
                assert_eq!(later.fault, output.fault);
            }
        }
    }
}

/// In motion the jump is measured from the predicted angle.
#[test]
fn an_encoder_jump_is_measured_from_the_predicted_angle() {
    let mut rig = Rig::holding(four(), bent());
    for _ in 0..200 {
        rig.q[0] -= 1.5e-3;
        assert_eq!(rig.cycle().fault, None);
    }
    // 0.04 rad are accepted, about an angle 0.0015 rad further on.
    for (jump, accepted) in [
        (-0.041, true),
        (-0.042, false),
        (0.038, true),
        (0.039, false),
    ] {
        let mut rig = rig.clone();
        rig.q[0] += jump;
        let fault = rig.cycle().fault;
        let seen = matches!(fault, Some(Fault::EncoderJump { joint: 0, .. }));
        assert_eq!(seen, !accepted, "{jump}: {fault:?}");
    }
}

/// A joint at its maximum speed moves a twentieth of the accepted jump per cycle.
#[test]
fn motion_at_the_speed_limit_is_no_encoder_jump() {
    let mut rig = Rig::holding(four(), bent());
    for k in 0..600 {
        let speed = (4.0 * 1e-3 * f64::from(k)).min(1.95);
        rig.q[0] -= speed * 1e-3;
        assert_eq!(rig.cycle().fault, None);
    }
}
