//! The momentum observer inside the step: its model, and when it is inactive.

use crate::support::configs::{friction, three, unlimited};
use crate::support::plant::{Plant, push};
use crate::support::rig::{Rig, bent};
use crate::support::size;
use supple_core::config::JointGains;
use supple_core::controller::Request;
use supple_core::math::Vector3;
use supple_core::{Config, Vector};

/// Configuration for fast motion with friction and a fast estimator.
fn brisk() -> Config<3> {
    let mut config = three();
    unlimited(&mut config);
    config.friction = friction();
    config.estimator_rad_per_s = 2000.0;
    config.limits.joint_speed_rad_per_s.fill(10.0);
    config.limits.tip_speed_m_per_s = 10.0;
    config.move_gains = JointGains {
        stiffness_nm_per_rad: Vector::<3>::repeat(400.0),
        damping_nm_s_per_rad: Vector::<3>::repeat(20.0),
    };
    config
}

/// Maximum external torque observed in a fast undisturbed move of an arm with the friction of the
/// model.
fn seen_on_a_move(config: Config<3>) -> f64 {
    let model = config.friction;
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let mut request = Some(Request::Move {
        target_rad: Vector::<3>::new(-0.7, 0.2, 2.2),
        duration_s: 0.6,
    });
    let mut worst: f64 = 0.0;
    for _ in 0..700 {
        let output = rig.drive(&mut plant, request.take(), |_, _, qd| {
            Vector::<3>::from_fn(|i, _| -model[i].torque_nm(qd[i]))
        });
        assert_eq!((output.refusal, output.fault), (None, None));
        worst = worst.max(size(&output.external_torque_nm));
    }
    worst
}

/// Speeds of 3 rad/s and friction of 5 N m cause almost no observed external torque.
#[test]
fn motion_and_friction_cause_no_contact() {
    let worst = seen_on_a_move(brisk());
    assert!(worst < 0.35, "{worst} N m seen where there is nothing");
}

/// In idle the observer is inactive: forces that hold the arm up do not count as contact, then or
/// afterwards.
#[test]
fn idle_resets_the_observer() {
    let config = three();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let force = Vector3::new(0.0, 3.0, 0.0);
    let mut output = rig.run(&mut plant);
    for _ in 0..300 {
        output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &force));
    }
    assert!(size(&output.external_torque_nm) > 0.5, "a push is seen");
    rig.q = plant.q;
    output = rig.request(Request::Idle);
    for _ in 0..50 {
        assert_eq!(output.external_torque_nm, Vector::<3>::zeros());
        assert_eq!(output.external_force_n, Vector3::zeros());
        output = rig.cycle();
    }
    // After idle the observer starts from zero.
    output = rig.accept(Request::GravityHold);
    assert_eq!(output.external_torque_nm, Vector::<3>::zeros());
}
