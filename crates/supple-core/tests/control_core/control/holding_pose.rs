//! A gravity hold that keeps the pose, for a model that would let the arm sink.

use crate::support::configs::{four, unlimited};
use crate::support::plant::Plant;
use crate::support::rig::{Rig, bent, ramp};
use crate::support::{assert_close, size};
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_core::{Config, Input, Vector};

/// Distance from the set-points at which the arm stands \[rad\].
fn sag() -> Vector<4> {
    Vector::from([0.0, 0.03, 0.0, 0.02])
}

fn keeping() -> Config<4> {
    let mut config = four();
    unlimited(&mut config);
    config.handover_s = 0.05;
    config.hold_pose = true;
    config
}

/// An arm that is `sag` below the end of its move.
fn sagging(config: Config<4>) -> Rig<4> {
    let mut rig = Rig::holding(config, bent() - sag());
    rig.accept(Request::Move {
        target_rad: bent(),
        duration_s: 0.5,
    });
    rig.cycles(2000);
    rig
}

#[test]
fn the_torque_at_the_end_of_a_move_persists_in_gravity_hold() {
    let mut rig = sagging(keeping());
    let moved = rig.cycle();
    let output = rig.accept(Request::GravityHold);
    assert_eq!(output.mode, Mode::GravityHold);
    assert_close(&output.torque_nm, &moved.torque_nm, 1e-6);
    let output = rig.cycles(1000);
    assert_close(&output.torque_nm, &moved.torque_nm, 1e-6);
    // Without the position loops the torque would be gravity alone.
    let mut rig = sagging(Config {
        hold_pose: false,
        ..keeping()
    });
    rig.accept(Request::GravityHold);
    let output = rig.cycles(1000);
    let lacks = (moved.torque_nm - output.torque_nm)[1];
    let expected = keeping().move_gains.stiffness_nm_per_rad[1] * sag()[1];
    assert!((lacks - expected).abs() < 1e-6, "{lacks}");
}

#[test]
fn a_ramp_ends_with_the_torque_that_it_began_with() {
    let mut rig = sagging(keeping());
    rig.accept(Request::GravityHold);
    let held = rig.cycles(100);
    rig.accept(Request::Breakaway(ramp()));
    // The joint moves to the end of the ramp and stays.
    let ends = (0..40).find(|_| {
        rig.q[1] += 1e-3;
        rig.cycle().mode == Mode::GravityHold
    });
    assert!(ends.is_some());
    let output = rig.cycles(1000);
    assert_eq!(output.mode, Mode::GravityHold);
    assert_close(&output.torques.joint_pd, &held.torques.joint_pd, 1e-6);
}

#[test]
fn a_fault_opens_the_loops_and_a_reset_closes_them_where_the_arm_is() {
    let mut rig = sagging(keeping());
    rig.accept(Request::GravityHold);
    let input = Input {
        tip_force_n: Some(Vector3::repeat(f64::NAN)),
        ..rig.input()
    };
    let output = rig.step(&input);
    assert!(output.fault.is_some());
    let output = rig.cycles(100);
    assert_eq!(size(&output.torques.joint_pd), 0.0);
    rig.accept(Request::Reset);
    let output = rig.rest();
    assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
    assert!(size(&output.torques.joint_pd) < 1e-9);
    rig.q[1] += 0.01;
    let stiffness = keeping().move_gains.stiffness_nm_per_rad[1];
    let output = rig.rest();
    assert!((output.torques.joint_pd[1] + 0.01 * stiffness).abs() < 1e-6);
}

#[test]
fn an_arm_that_is_heavier_than_its_model_stays() {
    let config = keeping();
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let weight_nm = Vector::from([0.0, 9.0, 0.0, 6.0]);
    for _ in 0..3000 {
        let output = rig.drive(&mut plant, None, |_, _, _| weight_nm);
        assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
    }
    let expected = weight_nm.component_div(&config.move_gains.stiffness_nm_per_rad);
    assert_close(&(plant.q - bent()), &expected, 1e-3);
}
