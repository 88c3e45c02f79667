//! Gains change along straight ramps.

use crate::support::configs::four;
use crate::support::rig::{Rig, bent};
use supple_core::config::Gains;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;

fn gains_request(gains: Gains, ramp_s: f64) -> Request<4> {
    Request::Gains { gains, ramp_s }
}

#[test]
fn gains_change_linearly_per_axis() {
    for mode in [Mode::Idle, Mode::GravityHold, Mode::Track, Mode::Fault] {
        let mut rig = Rig::new(four(), bent());
        rig.bring_to(mode);
        let from = four().law.gains;
        let to = Gains {
            stiffness_n_per_m: Vector3::new(5.0, 500.0, 100.0),
            damping_n_s_per_m: Vector3::new(1.5, 0.0, 25.0),
        };
        assert_eq!(rig.cycle().gains, from);
        let mut output = rig.request(gains_request(to, 0.2));
        for k in 1..=300 {
            let x = (f64::from(k) * 1e-3 / 0.2).min(1.0);
            let expected = from.stiffness_n_per_m * (1.0 - x) + to.stiffness_n_per_m * x;
            let error = output.gains.stiffness_n_per_m - expected;
            assert!(error.norm() < 1e-9, "{mode:?}: {error} after {k} cycles");
            let expected = from.damping_n_s_per_m * (1.0 - x) + to.damping_n_s_per_m * x;
            assert!((output.gains.damping_n_s_per_m - expected).norm() < 1e-9);
            output = rig.cycle();
        }
        assert_eq!(output.gains, to);
    }
}

#[test]
fn gains_change_at_once_without_a_ramp() {
    let mut rig = Rig::holding(four(), bent());
    let to = Gains::isotropic(7.0, 3.0);
    assert_eq!(rig.accept(gains_request(to, 0.0)).gains, to);
}

#[test]
fn a_new_ramp_starts_at_the_current_gains() {
    let mut rig = Rig::holding(four(), bent());
    rig.accept(gains_request(Gains::isotropic(200.0, 20.0), 0.1));
    let halfway = rig.cycles(50).gains;
    assert!((halfway.stiffness_n_per_m.x - 150.0).abs() < 2.1);
    let mut last = halfway.stiffness_n_per_m.x;
    let mut output = rig.accept(gains_request(Gains::isotropic(100.0, 20.0), 0.1));
    for _ in 0..150 {
        let now = output.gains.stiffness_n_per_m.x;
        assert!((now - last).abs() <= 0.6, "a jump from {last} to {now}");
        last = now;
        output = rig.cycle();
    }
    assert_eq!(output.gains, Gains::isotropic(100.0, 20.0));
}

/// The ramp uses the time of the arm's states: it pauses while a state is repeated, and skips the time of missing
/// states.
#[test]
fn a_ramp_advances_with_the_time_of_arm_states() {
    let mut rig = Rig::holding(four(), bent());
    rig.accept(gains_request(Gains::isotropic(200.0, 20.0), 0.1));
    let before = rig.cycle().gains;
    let mut input = rig.input();
    input.cycle -= 1;
    assert_eq!(rig.step(&input).gains, before);
    let mut input = rig.input();
    input.cycle += 2;
    let after = rig.step(&input).gains;
    let gained = after.stiffness_n_per_m.x - before.stiffness_n_per_m.x;
    assert!((gained - 3.0).abs() < 1e-9, "{gained}");
}

/// The reported gains are those used for the torque.
#[test]
fn the_torque_follows_the_gains() {
    let mut rig = Rig::new(four(), bent());
    rig.bring_to(Mode::Track);
    rig.q[0] += 0.01;
    let soft = rig.rest().torques;
    rig.request(gains_request(Gains::isotropic(300.0, 20.0), 0.0));
    let stiff = rig.rest().torques;
    assert!((stiff.stiffness - soft.stiffness * 3.0).norm() < 1e-9);
    assert!(soft.stiffness.norm() > 0.01);
}
