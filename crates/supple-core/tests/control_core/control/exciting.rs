//! The modes of identification: a Fourier series of all joints, and a ramp on one.

use crate::support::configs::{four, friction, unlimited};
use crate::support::plant::{Plant, nothing};
use crate::support::rig::{Rig, bent, ramp};
use crate::support::{assert_close, size};
use supple_core::controller::{Breakaway, Mode, Refusal, Request};
use supple_core::dynamics::{crba, gravity};
use supple_core::ripple::Harmonic;
use supple_core::trajectory::Fourier;
use supple_core::{Config, RippleTable, Vector};

fn series() -> Fourier<4> {
    let mut series = Fourier::at_rest(bent(), 2.0);
    for k in 0..3 {
        let size = 0.06 / (1.0 + k as f64);
        series.sine_rad[k] = Vector::from([size, -size, 0.5 * size, size]);
        series.cosine_rad[k] = Vector::from([-0.5 * size, size, size, 0.0]);
    }
    let start = series.at(0.0).position_rad;
    series.centre_rad += bent::<4>() - start;
    series
}

fn open() -> Config<4> {
    let mut config = four();
    unlimited(&mut config);
    config.friction = friction();
    config.handover_s = 0.05;
    config
}

#[test]
fn excitation_torque_is_model_feedforward_plus_stiff_loop() {
    let config = open();
    let mut rig = Rig::holding(config, bent());
    let mut output = rig.accept(Request::Excite(series()));
    for k in 0..3000_u32 {
        assert_eq!((output.mode, output.fault), (Mode::Excite, None));
        let wanted = series().at(output.mode_time_s);
        let (q, qd) = (&output.position_rad, &output.velocity_rad_per_s);
        let gains = &config.move_gains;
        let loops = gains
            .stiffness_nm_per_rad
            .component_mul(&(wanted.position_rad - q))
            + gains
                .damping_nm_s_per_rad
                .component_mul(&(wanted.velocity_rad_per_s - qd));
        assert_close(&output.torques.joint_pd, &loops, 1e-8);
        let inertial = crba(&config.arm, q) * wanted.acceleration_rad_per_s2;
        assert_close(&output.torques.inertial, &inertial, 1e-9);
        assert_close(&output.torque_nm, &output.torques.total(), 1e-9);
        // The held roll joint moves as well.
        let late = series().at(1e-3 * f64::from(k.saturating_sub(3)));
        rig.q = late.position_rad;
        output = rig.cycle();
    }
}

#[test]
fn a_frictionless_arm_follows_the_series_and_holds_its_last_pose() {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    rig.drive(&mut plant, Some(Request::Excite(series())), nothing);
    for _ in 0..5000 {
        let output = rig.run(&mut plant);
        assert_eq!((output.mode, output.fault), (Mode::Excite, None));
        let wanted = series().at(output.mode_time_s).position_rad;
        assert!(size(&(output.position_rad - wanted)) < 2e-3);
    }
    assert!(size(&plant.qd) < 1e-4, "{}", plant.qd);
}

#[test]
fn a_series_beyond_limits_is_refused() {
    let mut rig = Rig::holding(four(), bent());
    let refused = |rig: &mut Rig<4>, series: Fourier<4>| {
        let output = rig.request(Request::Excite(series));
        assert_eq!(output.mode, Mode::GravityHold);
        output.refusal.expect("a refusal")
    };
    let mut far = series();
    far.centre_rad[0] += 0.1;
    assert!(matches!(
        refused(&mut rig, far),
        Refusal::Value { value, .. } if (value - 0.1).abs() < 1e-9
    ));
    let mut wide = series();
    wide.sine_rad[0][1] = 2.0;
    wide.angular_frequency_rad_per_s = 0.3;
    wide.centre_rad += bent::<4>() - wide.at(0.0).position_rad;
    let refusal = refused(&mut rig, wide);
    assert!(
        matches!(refusal, Refusal::BeyondJointStop { joint: 1, .. }),
        "{refusal}"
    );
    let mut fast = series();
    fast.angular_frequency_rad_per_s = 60.0;
    fast.ramp_s = 0.01;
    assert!(matches!(refused(&mut rig, fast), Refusal::TooFast { .. }));
    let mut broken = series();
    broken.cosine_rad[2][0] = f64::NAN;
    assert!(matches!(refused(&mut rig, broken), Refusal::Trajectory(_)));
    let mut short = series();
    short.duration_s = short.ramp_s;
    assert!(matches!(refused(&mut rig, short), Refusal::Trajectory(_)));
}

#[test]
fn a_ramp_grows_beside_gravity_while_the_other_joints_are_held() {
    let config = open();
    let mut rig = Rig::holding(config, bent());
    let mut output = rig.accept(Request::Breakaway(ramp()));
    for _ in 0..2000 {
        assert_eq!((output.mode, output.fault), (Mode::Breakaway, None));
        let torques = &output.torques;
        assert_close(&torques.gravity, &gravity(&config.arm, &rig.q), 1e-10);
        assert!((torques.friction[1] - 0.5 * output.mode_time_s).abs() < 1e-12);
        assert_eq!(torques.joint_pd[1], 0.0);
        rig.q = bent();
        rig.q[3] += 1e-3;
        let answer = config.move_gains.stiffness_nm_per_rad[3] * -1e-3;
        output = rig.cycle();
        let back = output.torques.joint_pd[3]
            + config.move_gains.damping_nm_s_per_rad[3] * output.velocity_rad_per_s[3];
        assert!((back - answer).abs() < 1e-9);
    }
}

/// An arm that gravity or friction keeps 30 mrad from the end of its move.
fn sagging() -> Rig<4> {
    let mut rig = Rig::holding(open(), bent() - Vector::from([0.0, 0.03, 0.0, 0.03]));
    rig.accept(Request::Move {
        target_rad: bent(),
        duration_s: 0.5,
    });
    rig.cycles(2000);
    rig
}

#[test]
fn a_ramp_begins_at_the_torque_that_held_the_arm() {
    let mut rig = sagging();
    let held = rig.cycle();
    let stiffness = open().move_gains.stiffness_nm_per_rad;
    assert!((held.torques.joint_pd[1] - 0.03 * stiffness[1]).abs() < 1e-6);
    let mut output = rig.accept(Request::Breakaway(ramp()));
    for _ in 0..1000 {
        assert_eq!(output.mode, Mode::Breakaway);
        let mut wanted = held.torque_nm;
        wanted[1] += 0.5 * output.mode_time_s;
        assert_close(&output.torque_nm, &wanted, 1e-5);
        output = rig.cycle();
    }
}

#[test]
fn a_series_begins_where_the_set_point_is_although_the_arm_sags() {
    let mut rig = sagging();
    let held = rig.cycle();
    let output = rig.accept(Request::Excite(series()));
    assert!(
        (output.torque_nm - held.torque_nm).amax() < 0.05,
        "{}",
        output.torque_nm
    );
    // Without a set-point, in gravity hold, the same distance is refused.
    rig.accept(Request::GravityHold);
    let refusal = rig.request(Request::Excite(series())).refusal;
    assert!(
        matches!(refusal, Some(Refusal::Value { .. })),
        "{refusal:?}"
    );
}

#[test]
fn breakaway_ends_in_gravity_hold_after_motion_or_at_the_torque_limit() {
    let mut rig = Rig::holding(four(), bent());
    rig.accept(Request::Breakaway(ramp()));
    rig.rest();
    for k in 1..=40 {
        rig.q[1] = bent::<4>()[1] + 1e-3 * f64::from(k);
        let mode = rig.cycle().mode;
        let expected = if k < 35 {
            Mode::Breakaway
        } else {
            Mode::GravityHold
        };
        assert_eq!(mode, expected, "{k} mrad");
    }
    let mut rig = Rig::holding(four(), bent());
    rig.accept(Request::Breakaway(ramp()));
    // 4 N m at 0.5 N m/s.
    assert_eq!(rig.cycles(7900).mode, Mode::Breakaway);
    assert_eq!(rig.cycles(200).mode, Mode::GravityHold);
}

#[test]
fn an_invalid_ramp_is_refused() {
    let wrong = [
        Breakaway { joint: 4, ..ramp() },
        Breakaway {
            rate_nm_per_s: 0.0,
            ..ramp()
        },
        Breakaway {
            rate_nm_per_s: f64::NAN,
            ..ramp()
        },
        Breakaway {
            stop_rad: 1.0,
            ..ramp()
        },
        Breakaway {
            limit_nm: -1.0,
            ..ramp()
        },
    ];
    for ramp in wrong {
        let mut rig = Rig::holding(four(), bent());
        let output = rig.request(Request::Breakaway(ramp));
        assert!(
            matches!(output.refusal, Some(Refusal::Value { .. })),
            "{ramp:?}"
        );
        assert_eq!(output.mode, Mode::GravityHold);
    }
}

#[test]
fn ripple_feedforward_cancels_the_motors_ripple() {
    let mut config = four();
    let line = Harmonic {
        harmonic: 3,
        sine_nm: 0.01,
        cosine_nm: -0.004,
        ..Harmonic::default()
    };
    config.ripple[1] = RippleTable::new(&[line]).expect("a table");
    let mut rig = Rig::holding(config, bent());
    let output = rig.rest();
    let motor_from_joint = config.joint_from_motor.try_inverse().expect("regular");
    let angle = motor_from_joint * bent::<4>();
    let mut motor = Vector::<4>::zeros();
    motor[1] = 0.01 * (3.0 * angle[1]).sin() - 0.004 * (3.0 * angle[1]).cos();
    let joint = motor_from_joint.transpose() * motor;
    assert_close(&output.torques.ripple, &-joint, 1e-9);
    // With their ripple the motors then give the commanded gravity torque.
    assert_close(&(output.torque_nm + joint), &output.torques.gravity, 1e-9);
    rig.request(Request::Idle);
    assert_eq!(rig.rest().torque_nm.norm(), 0.0);
}

/// The part of the command that cancels ripple does not reach the links, and the observer does not count it as external torque.
#[test]
fn the_observer_excludes_the_ripple_compensation() {
    let mut config = four();
    let line = Harmonic {
        harmonic: 3,
        sine_nm: 0.01,
        cosine_nm: -0.004,
        ..Harmonic::default()
    };
    config.ripple = [RippleTable::new(&[line]).expect("a table"); 4];
    let mut rig = Rig::holding(config, bent());
    let output = rig.rest();
    assert!(size(&output.torques.ripple) > 0.1);
    assert!(size(&output.external_torque_nm) < 1e-6);
}

/// A torque constant that varies with the angle is cancelled in proportion to the motor's torque.
#[test]
fn ripple_of_the_torque_constant_is_cancelled_with_the_torque() {
    let mut config = four();
    let line = Harmonic {
        harmonic: 6,
        sine_share: 0.02,
        cosine_share: 0.01,
        ..Harmonic::default()
    };
    config.ripple[1] = RippleTable::new(&[line]).expect("a table");
    let mut rig = Rig::holding(config, bent());
    let output = rig.rest();
    let motor_from_joint = config.joint_from_motor.try_inverse().expect("regular");
    let angle = 6.0 * (motor_from_joint * bent::<4>())[1];
    let commanded = config.joint_from_motor.tr_mul(&output.torque_nm);
    let mut motor = Vector::<4>::zeros();
    motor[1] = commanded[1] * (0.02 * angle.sin() + 0.01 * angle.cos());
    assert!(motor[1].abs() > 1e-4);
    let joint = motor_from_joint.transpose() * motor;
    assert_close(&output.torques.ripple, &-joint, 1e-9);
    assert_close(&(output.torque_nm + joint), &output.torques.gravity, 1e-9);
    assert!(
        RippleTable::new(&[Harmonic {
            sine_share: 0.3,
            ..line
        }])
        .is_none()
    );
}
