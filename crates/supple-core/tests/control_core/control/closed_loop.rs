//! Controller and arm together, exact model, no friction: from idle to the paper's sinusoid and back.

use crate::support::configs::{four, friction, three};
use crate::support::plant::{Plant, nothing, push};
use crate::support::rig::Rig;
use supple_core::config::Gains;
use supple_core::controller::{Mode, Request};
use supple_core::inverse_kinematics::inverse_kinematics;
use supple_core::math::Vector3;
use supple_core::trajectory::{Arc, Sinusoid};
use supple_core::{Config, Friction, Output, Trajectory, Vector};

fn start<const N: usize>(config: &Config<N>, seed: Vector<N>) -> Vector<N> {
    let point = Vector3::new(0.6, 0.0, 0.0);
    let place = inverse_kinematics(&config.arm, &config.roles, &config.limits, &seed, &point);
    assert!(place.reached());
    place.position_rad
}

/// Idle, hold, move to the start, track, hold: returns the errors.
fn mission<const N: usize>(mut config: Config<N>, seed: Vector<N>) -> (f64, f64) {
    config.law.gains = Gains::isotropic(5.0, 1.5);
    let target = start(&config, seed);
    let mut plant = Plant::at_rest(config.arm, seed);
    let mut rig = Rig::new(config, seed);
    rig.drive(&mut plant, None, nothing);
    // The arm falls while the torque rises from zero; the damping of gravity hold stops it.
    rig.drive(&mut plant, Some(Request::GravityHold), nothing);
    for _ in 0..1000 {
        assert_eq!(rig.run(&mut plant).fault, None);
    }
    let fallen = (plant.q - seed).amax();
    assert!(fallen < 0.05, "{fallen} rad fallen");
    rig.drive(
        &mut plant,
        Some(Request::Move {
            target_rad: target,
            duration_s: 2.0,
        }),
        nothing,
    );
    for _ in 0..2500 {
        assert_eq!(rig.run(&mut plant).fault, None);
    }
    let arrived = (plant.q - target).amax();
    let track = Request::Track(Trajectory::Sinusoid(Sinusoid::paper(1.0)));
    let first = rig.drive(&mut plant, Some(track), nothing);
    assert_eq!((first.mode, first.refusal), (Mode::Track, None));
    let mut squares = 0.0;
    let mut worst: f64 = 0.0;
    for _ in 0..16_000 {
        let output = rig.run(&mut plant);
        assert_eq!(output.fault, None);
        let reference = output.reference.expect("a reference");
        let error = (reference.position - output.tip_position_m).norm();
        squares += error * error;
        worst = worst.max(error);
    }
    assert!(arrived < 2e-3, "the move ended {arrived} rad away");
    ((squares / 16_000.0_f64).sqrt(), worst)
}

#[test]
fn the_papers_sinusoid_with_3_joints() {
    let (rms, worst) = mission(three(), Vector::<3>::new(0.0, 0.4, 1.4));
    assert!(
        rms < 2e-3 && worst < 5e-3,
        "{rms} m RMS, {worst} m at worst"
    );
}

#[test]
fn the_papers_sinusoid_with_a_held_roll() {
    let (rms, worst) = mission(four(), Vector::<4>::new(0.0, 0.4, 0.0, 1.4));
    assert!(
        rms < 2e-3 && worst < 5e-3,
        "{rms} m RMS, {worst} m at worst"
    );
}

/// Under a constant force the tip is displaced by `F / K`, and the observer estimates the force.
#[test]
fn a_constant_force_is_observed_and_displaces_the_tip() {
    let mut config = three();
    config.law.gains = Gains::isotropic(100.0, 40.0);
    let q = start(&config, Vector::<3>::new(0.0, 0.4, 1.4));
    let mut plant = Plant::at_rest(config.arm, q);
    let mut rig = Rig::holding(config, q);
    rig.drive(&mut plant, Some(rig.hold_tip_request()), nothing);
    let force = Vector3::new(1.0, -2.0, 1.5);
    let mut output = rig.run(&mut plant);
    for _ in 0..6000 {
        output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &force));
        assert_eq!(output.fault, None);
    }
    let felt = output.external_force_n;
    assert!(
        (felt - force).norm() < 1e-3,
        "{felt} felt, {force} is pushing"
    );
    let reference = output.reference.expect("a reference");
    let given = output.tip_position_m - reference.position;
    assert!((given - force / 100.0).norm() < 1e-4, "{given}");
    let at_joints = push(&config.arm, &plant.q, &force);
    assert!((output.external_torque_nm - at_joints).norm() < 1e-3);
}

/// A frictionless arm in gravity hold is slowed by the damping and never accelerated.
#[test]
fn gravity_hold_removes_energy() {
    let config = three();
    let q = start(&config, Vector::<3>::new(0.0, 0.4, 1.4));
    let mut plant = Plant::at_rest(config.arm, q);
    let mut rig = Rig::holding(config, q);
    rig.q = plant.q;
    plant.qd = Vector::<3>::new(0.4, 0.2, -0.3);
    let energy =
        |plant: &Plant<3>| supple_core::dynamics::kinetic_energy(&plant.arm, &plant.q, &plant.qd);
    let begun = energy(&plant);
    let mut last = begun;
    for k in 0..3000 {
        assert_eq!(rig.run(&mut plant).fault, None);
        // The estimator lags by 10 ms.
        if k % 50 == 49 {
            let now = energy(&plant);
            assert!(now < last + 1e-6 * begun, "{now} J after {last} J");
            last = now;
        }
    }
    assert!(last < 1e-3 * begun, "{last} of {begun} J left");
}

/// On an arc only the base joint moves. With a tip that lags by two centimetres, the dry friction of the other joints is still
/// not fed forward, because their references do not move.
#[test]
fn a_tip_behind_its_reference_does_not_reverse_the_friction_of_other_joints() {
    let mut config = four();
    config.friction = friction().map(|friction| Friction {
        presliding_rad: 1.5e-3,
        offset_nm: 0.0,
        ..friction
    });
    config.law.gains = Gains::isotropic(5.0, 1.5);
    // The arm does not move, which must not count as contact.
    config.latch.threshold_n = 1e3;
    let q = start(&config, Vector::<4>::new(0.0, 0.8, 0.0, 1.8));
    let mut rig = Rig::holding(config, q);
    let arc = Arc {
        radius_m: 0.6,
        height_m: 0.0,
        centre_rad: 0.0,
        amplitude_rad: 0.4,
        angular_frequency_rad_per_s: 0.8,
        ramp_s: 1.0,
    };
    let mut output = rig.accept(Request::Track(Trajectory::Arc(arc)));
    let lag = |output: &Output<4>| {
        let reference = output.reference.expect("it tracks");
        (reference.position - output.tip_position_m).norm()
    };
    while lag(&output) < 0.02 {
        output = rig.cycle();
        assert_eq!(output.fault, None);
    }
    let dry = |joint: usize| output.torques.friction[joint] / config.friction[joint].coulomb_nm;
    assert!(dry(0).abs() > 0.9, "{}", dry(0));
    assert!(dry(1).abs() < 0.1, "{}", dry(1));
    assert!(dry(3).abs() < 0.1, "{}", dry(3));
}
