//! Every fault: it occurs exactly at its limit, reports its cause, stays until a reset, and starts
//! the safe action.

use crate::support::configs::{four, stop_limited, three, unlimited};
use crate::support::rig::{Rig, bent};
use supple_core::config::{Gains, Role};
use supple_core::controller::{Fault, Mode, Request, SafeAction, limit_torque};
use supple_core::dynamics::gravity;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Body, Config, Input, Joint, Output, Pose, Trajectory, Vector};

/// Checks that the fault is latched with its cause, that the safe action runs, and that a reset
/// leaves it.
#[track_caller]
pub fn latched(mut rig: Rig<4>, first: &Output<4>, action: SafeAction) {
    let fault = first.fault.expect("a fault");
    assert_eq!((first.mode, fault.safe_action()), (Mode::Fault, action));
    assert_eq!(
        first.torques.handover.norm(),
        0.0,
        "a fault is not blended in"
    );
    assert!(!fault.to_string().is_empty() && !fault.name().is_empty());
    // With valid states at rest the fault stays latched.
    let output = rig.rest();
    assert_eq!((output.mode, output.fault), (Mode::Fault, Some(fault)));
    match action {
        SafeAction::Brake => {
            assert_eq!(output.torque_nm, Vector::<4>::zeros());
            assert_eq!(first.fallback_torque_nm, Vector::<4>::zeros());
            assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
        }
        SafeAction::Stop => {
            let config = rig.controller.config();
            let held = gravity(&config.arm, &rig.q);
            let total = output.torques.total();
            let rest = total - held - output.torques.joint_pd - output.torques.soft_stop;
            assert!(rest.norm() < 1e-6, "{rest} beside gravity");
            let (allowed, _) = limit_torque(&config.limits, rig.controller.motors(), &total);
            assert!((output.torque_nm - allowed).norm() < 1e-9);
        }
    }
    // A second fault does not replace the first cause.
    let cycle = rig.cycle - 2;
    let output = rig.clone().step(&Input {
        cycle,
        ..rig.input()
    });
    assert_eq!((output.mode, output.fault), (Mode::Fault, Some(fault)));
    let expected = match action {
        SafeAction::Stop => Mode::GravityHold,
        SafeAction::Brake => Mode::Idle,
    };
    let output = rig.request(Request::Reset);
    assert_eq!((output.mode, output.fault), (expected, None));
    assert_eq!(output.refusal, None);
    assert_eq!(rig.rest().mode, expected);
}

#[test]
fn measurements_that_are_not_finite_fault() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for joint in 0..4 {
            let mut rig = Rig::holding(four(), bent());
            let mut input = rig.input();
            input.position_rad[joint] = Some(bad);
            let output = rig.step(&input);
            let expected = Fault::MeasurementNotFinite { joint: Some(joint) };
            assert_eq!(output.fault, Some(expected));
            latched(rig, &output, SafeAction::Brake);
        }
        for axis in 0..3 {
            let mut rig = Rig::holding(four(), bent());
            let mut force = Vector3::zeros();
            force[axis] = bad;
            let mut input = rig.input();
            input.tip_force_n = Some(force);
            let output = rig.step(&input);
            let expected = Fault::MeasurementNotFinite { joint: None };
            assert_eq!(output.fault, Some(expected));
            latched(rig, &output, SafeAction::Stop);
        }
    }
}

/// A configuration without effective limits.
fn boundless() -> Config<4> {
    let mut config = four();
    unlimited(&mut config);
    config.limits.start_error_m = 1e3;
    config.limits.tracking_error_m = 1e3;
    config.limits.stiffness_n_per_m = f64::MAX;
    config.limits.joint_speed_rad_per_s.fill(f64::MAX);
    config.limits.tip_speed_m_per_s = f64::MAX;
    config
}

/// A clamp would turn infinity into the limit.
#[test]
fn an_infinite_term_is_a_fault_and_not_a_clamp() {
    let mut rig = Rig::holding(boundless(), bent());
    let far = rig.tip() + Vector3::new(5.0, 5.0, 5.0);
    rig.accept(Request::Track(Trajectory::Hold(far)));
    let before = rig.rest();
    assert!(before.fault.is_none());
    let output = rig.request(Request::Gains {
        gains: Gains::isotropic(f64::MAX, 0.0),
        ramp_s: 0.0,
    });
    assert_eq!(
        output.fault,
        Some(Fault::TorqueNotFinite { term: "stiffness" })
    );
    let weight = gravity(&rig.controller.config().arm, &rig.q);
    assert!((output.torque_nm - weight).norm() < 1e-6);
    latched(rig, &output, SafeAction::Stop);
}

/// Finite terms with an infinite sum: the safe action contains none of them.
#[test]
fn an_infinite_sum_of_finite_terms_is_a_fault() {
    let mut config = boundless();
    config.limits.soft_zone_rad = 1.0;
    config.limits.soft_stiffness_nm_per_rad[2] = 1.2e308;
    config.limits.joint_tracking_error_rad = f64::MAX;
    config.roles[2] = Role::Held {
        position_rad: 0.0,
        stiffness_nm_per_rad: 0.9e308,
        damping_nm_s_per_rad: 0.0,
    };
    let mut rig = Rig::holding(config, bent());
    for k in 0..2300 {
        rig.q[2] = 0.9e-3 * f64::from(k);
        let output = rig.cycle();
        for (_, torque) in output.torques.named() {
            assert!(torque.iter().all(|x| x.is_finite()));
        }
        assert!(output.torque_nm.iter().all(|x| x.is_finite()));
        if let Some(fault) = output.fault {
            assert_eq!(fault, Fault::TorqueNotFinite { term: "total" });
            let weight = gravity(&rig.controller.config().arm, &rig.q);
            assert!((rig.rest().torque_nm - weight).norm() < 1e-6);
            return;
        }
    }
    panic!("no fault");
}

/// Two coaxial joints with almost no inertia between them: no torque, and a reset is refused.
#[test]
fn a_mass_matrix_that_is_not_positive_definite_faults() {
    let ball = |mass_kg: f64| Body {
        mass_kg,
        com_m: Vector3::new(0.0, 0.0, 0.25),
        inertia_kg_m2: Matrix3::from_diagonal_element(0.1875 * mass_kg),
    };
    let joint = |axis: Vector3<f64>, mass_kg: f64| Joint {
        parent_from_link: Pose::IDENTITY,
        axis,
        body: ball(mass_kg),
        armature_kg_m2: 0.0,
    };
    let joints = [
        joint(Vector3::z(), 1.0),
        joint(Vector3::y(), 1e-30),
        joint(Vector3::y(), 1.0),
    ];
    let tip = Pose::from_xyz_rpy([0.0, 0.0, 0.5], [0.0; 3]);
    let mut config = three();
    config.arm = Arm::new(&joints, tip, None, Vector3::new(0.0, 0.0, -9.81)).expect("an arm");
    let mut rig = Rig::new(config, Vector::zeros());
    let output = rig.cycle();
    assert_eq!(output.fault, Some(Fault::MassMatrix));
    assert_eq!(output.torque_nm, Vector::<3>::zeros());
    let output = rig.request(Request::Reset);
    assert_eq!(output.fault, Some(Fault::MassMatrix));
    assert!(output.refusal.is_some());
}

/// Gravity hold is no longer safe after the loss of an encoder.
#[test]
fn a_worse_fault_removes_torque_but_keeps_the_first_cause() {
    let mut rig = Rig::new(four(), bent());
    rig.bring_to(Mode::Fault);
    let first = rig.state.fault();
    assert!(rig.rest().torque_nm.norm() > 1.0);
    let mut input = rig.input();
    input.position_rad[1] = Some(f64::NAN);
    let output = rig.step(&input);
    assert_eq!(output.fault, first);
    assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
    assert_eq!(rig.rest().torque_nm, Vector::<4>::zeros());
    assert_eq!(rig.request(Request::Reset).mode, Mode::Idle);
}

/// If the angle is not trusted, the torque falls to zero in 5 ms, and the fallback is zero at once.
#[test]
fn lost_encoder_removes_torque() {
    let mut rig = Rig::holding(four(), bent());
    let mut last = rig.rest().torque_nm;
    let mut input = rig.input();
    input.position_rad[3] = Some(f64::NAN);
    let mut output = rig.step(&input);
    // The full torque may be removed in 5 ms.
    for _ in 0..5 {
        assert_eq!(output.torques.total(), Vector::<4>::zeros());
        assert_eq!(output.fallback_torque_nm, Vector::<4>::zeros());
        let expected = stop_limited(&four(), &last, &Vector::zeros());
        assert!((output.torque_nm - expected).norm() < 1e-9);
        last = output.torque_nm;
        output = rig.cycle();
    }
    assert_eq!(output.torque_nm, Vector::<4>::zeros());
}

/// A reset in the cycle of a fault does not clear this fault.
#[test]
fn a_reset_in_the_cycle_of_the_fault_is_refused() {
    let bad_force = |input: &mut Input<4>| input.tip_force_n = Some(Vector3::repeat(f64::NAN));
    let bad_angle = |input: &mut Input<4>| input.position_rad[1] = Some(f64::NAN);
    let backwards = |input: &mut Input<4>| input.cycle -= 5;
    let causes: [&dyn Fn(&mut Input<4>); 3] = [&bad_force, &bad_angle, &backwards];
    for cause in causes {
        let mut rig = Rig::holding(four(), bent());
        let mut input = Input {
            request: Some(Request::Reset),
            ..rig.input()
        };
        cause(&mut input);
        let output = rig.step(&input);
        assert_eq!(output.mode, Mode::Fault);
        assert!(output.fault.is_some() && output.refusal.is_some());
        assert_eq!(rig.cycle().mode, Mode::Fault);
    }
    // A reset is also refused while the cause lasts.
    let mut rig = Rig::holding(four(), bent());
    for _ in 0..5 {
        let mut input = Input {
            request: Some(Request::Reset),
            ..rig.input()
        };
        bad_angle(&mut input);
        let output = rig.step(&input);
        assert_eq!(output.mode, Mode::Fault);
        assert!(output.fault.is_some());
    }
    // The rejected states count as missing until the first valid one.
    assert_eq!(rig.cycle().mode, Mode::Fault);
    assert_eq!(rig.request(Request::Reset).mode, Mode::Idle);
}

/// The safe action has no stiff loop, not even that of a held joint, and no soft stops.
#[test]
fn the_safe_action_has_no_stiff_loop() {
    let mut rig = Rig::holding(four(), bent());
    rig.bring_to(Mode::Fault);
    rig.q[2] = 0.01;
    rig.q[0] = four().limits.position_upper_rad[0] - 0.01;
    let output = rig.rest();
    assert_eq!(output.mode, Mode::Fault);
    let torques = &output.torques;
    assert_eq!(torques.total(), torques.gravity + torques.damping);
}

#[test]
fn a_stale_state_leaves_only_gravity() {
    let config = four();
    let mut rig = Rig::holding(config, bent());
    for _ in 0..200 {
        rig.q[1] += 1e-3;
        rig.cycle();
    }
    let input = Input {
        cycle: rig.cycle().cycle,
        ..rig.input()
    };
    let mut output = rig.step(&input);
    for _ in 0..200 {
        output = rig.step(&input);
    }
    assert!(matches!(output.fault, Some(Fault::StateStale { .. })));
    let gravity = output.torques.gravity;
    assert!((output.torque_nm - gravity).norm() < 1e-12 * gravity.norm());
}
