//! Gains of the move mode and soft stops of joints whose inertia is small for the delay of the loop.

use crate::support::configs::{four, seven, unlimited};
use crate::support::inverse;
use crate::support::plant::Plant;
use crate::support::rig::{Rig, bent};
use std::f64::consts::FRAC_PI_2;
use supple_core::config::{JointGains, Role};
use supple_core::controller::{Mode, Request};
use supple_core::dynamics::crba;
use supple_core::{Config, Controller, Matrix, Vector};

/// Damping that these arms cannot have in any pose.
fn stiff() -> Config<7> {
    Config {
        move_gains: JointGains {
            stiffness_nm_per_rad: Vector::repeat(600.0),
            damping_nm_s_per_rad: Vector::repeat(30.0),
        },
        ..seven()
    }
}

fn pose(number: u32) -> Vector<7> {
    Vector::from_fn(|joint, _| 2.0 * (f64::from(number) * (1.0 + 0.37 * joint as f64)).sin())
}

/// Greatest eigenvalue of a product of positive matrices, by power iteration.
fn greatest_eigenvalue(a: &Matrix<7, 7>) -> f64 {
    let mut v = Vector::<7>::from_fn(|i, _| 1.0 + 0.1 * i as f64);
    let mut value = 0.0;
    for _ in 0..3000 {
        let next = a * v;
        value = next.norm() / v.norm();
        v = next / next.norm();
    }
    value
}

#[test]
fn damping_stays_below_the_stability_limit_of_the_delay() {
    let controller = Controller::new(stiff()).expect("valid");
    let damping = &stiff().move_gains.damping_nm_s_per_rad;
    for number in 0..50 {
        let mass_matrix = crba(&stiff().arm, &pose(number));
        let rate = |damping: &Vector<7>| {
            greatest_eigenvalue(&(inverse(&mass_matrix) * Matrix::from_diagonal(damping)))
        };
        let found = controller.move_gains(&mass_matrix).damping_nm_s_per_rad;
        let (before, after) = (rate(damping), rate(&found));
        assert!(before * controller.delay_s() > FRAC_PI_2);
        assert!(
            after * controller.delay_s() < 0.751 * FRAC_PI_2,
            "pose {number}: {after} 1/s"
        );
    }
}

#[test]
fn stiffness_and_damping_of_a_joint_are_reduced_by_the_same_factor_and_only_if_necessary() {
    let controller = Controller::new(stiff()).expect("valid");
    let given = stiff().move_gains;
    for number in 0..50 {
        let found = controller.move_gains(&crba(&stiff().arm, &pose(number)));
        for joint in 0..7 {
            let share = found.damping_nm_s_per_rad[joint] / given.damping_nm_s_per_rad[joint];
            let same = found.stiffness_nm_per_rad[joint] / given.stiffness_nm_per_rad[joint];
            assert!(share > 0.0 && share <= 1.0 && (share - same).abs() < 1e-12);
        }
    }
    let low = Config {
        move_gains: JointGains {
            damping_nm_s_per_rad: Vector::from([1.0, 1.0, 0.5, 0.5, 0.02, 0.02, 0.002]),
            ..given
        },
        ..seven()
    };
    let controller = Controller::new(low).expect("valid");
    for number in 0..50 {
        let found = controller.move_gains(&crba(&low.arm, &pose(number)));
        assert_eq!(found, low.move_gains);
    }
}

/// Joints that do not act on each other: the margin times inertia over delay.
#[test]
fn a_decoupled_joint_has_the_damping_of_its_own_inertia() {
    let controller = Controller::new(stiff()).expect("valid");
    let inertia = Vector::from([5.0, 0.1, 0.02, 5.0, 5.0, 0.004, 5.0]);
    let found = controller.move_gains(&Matrix::from_diagonal(&inertia));
    for joint in 0..7 {
        let most = 0.75 * FRAC_PI_2 * inertia[joint] / controller.delay_s();
        let error = found.damping_nm_s_per_rad[joint] - most.min(30.0);
        assert!(error.abs() < 1e-9, "joint {joint}: {error}");
    }
}

#[test]
fn a_move_with_too_much_damping_comes_to_rest() {
    let mut config = four();
    unlimited(&mut config);
    config.move_gains.damping_nm_s_per_rad = Vector::repeat(60.0);
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let target_rad = bent() + Vector::from([0.2, -0.1, 0.0, 0.2]);
    rig.accept(Request::Move {
        target_rad,
        duration_s: 1.0,
    });
    let mut most: f64 = 0.0;
    for cycle in 0..4000 {
        let output = rig.drive(&mut plant, None, |_, _, _| Vector::zeros());
        assert_eq!((output.mode, output.fault), (Mode::Move, None));
        if cycle > 3000 {
            most = most.max(output.velocity_rad_per_s.amax());
        }
    }
    assert!(most < 1e-3, "{most} rad/s");
    assert!((plant.q - target_rad).amax() < 1e-3);
}

/// Depth into a soft zone as a share of it.
const DEPTH: f64 = 0.5;

/// Torque of the soft stop of a joint that moves into its zone, for an arm with decoupled joints, and the damping of that stop.
fn soft_stop_damping(hold_nm_s_per_rad: f64, soft_nm_s_per_rad: f64) -> f64 {
    let mut config = four();
    unlimited(&mut config);
    config.hold_damping_nm_s_per_rad.fill(hold_nm_s_per_rad);
    config.limits.soft_stiffness_nm_per_rad.fill(0.0);
    config
        .limits
        .soft_damping_nm_s_per_rad
        .fill(soft_nm_s_per_rad);
    let edge = config.limits.position_upper_rad[3] - config.limits.soft_zone_rad;
    let end = edge + DEPTH * config.limits.soft_zone_rad;
    let speed = 0.2;
    let mut start = bent::<4>();
    start[3] = end - speed * 0.2;
    let mut rig = Rig::holding(config, start);
    let mut output = rig.cycle();
    for cycle in 0..=200 {
        rig.q[3] = start[3] + speed * 1e-3 * f64::from(cycle);
        output = rig.cycle();
        assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
    }
    -output.torques.soft_stop[3] / output.velocity_rad_per_s[3]
}

#[test]
fn a_soft_stop_has_its_configured_damping_if_the_delay_allows_it() {
    for soft in [0.5, 2.0, 5.0] {
        let found = soft_stop_damping(1.0, soft);
        assert!((found - DEPTH * soft).abs() < 0.02 * soft, "{found}");
    }
}

/// The limit of the delay applies to the sum of both: the damping of gravity hold reduces the damping of the soft stop.
#[test]
fn a_soft_stop_has_the_damping_that_gravity_hold_leaves_within_the_limit() {
    let (alone, beside) = (soft_stop_damping(0.0, 1e3), soft_stop_damping(4.0, 1e3));
    assert!(alone > 4.0 && alone < 0.1 * 1e3, "{alone}");
    assert!(beside < alone - 3.0, "{beside} of {alone}");
}

/// An arm that enters its soft zones leaves them no faster, with any configured damping.
#[test]
fn a_soft_stop_with_too_much_damping_removes_energy() {
    for joint in [0, 1, 3] {
        for soft in [10.0, 200.0] {
            let mut config = four();
            unlimited(&mut config);
            config.roles[2] = Role::Active;
            config.hold_damping_nm_s_per_rad.fill(0.0);
            config.limits.soft_stiffness_nm_per_rad.fill(30.0);
            config.limits.soft_damping_nm_s_per_rad.fill(soft);
            let mut start = bent::<4>();
            start[joint] =
                config.limits.position_upper_rad[joint] - config.limits.soft_zone_rad - 0.05;
            let mut rig = Rig::holding(config, start);
            let mut plant = Plant::at_rest(config.arm, start);
            plant.qd[joint] = 0.8;
            let energy_j =
                |plant: &Plant<4>| 0.5 * plant.qd.dot(&(crba(&plant.arm, &plant.q) * plant.qd));
            let before_j = energy_j(&plant);
            for cycle in 0..600 {
                let output = rig.drive(&mut plant, None, |_, _, _| Vector::zeros());
                assert_eq!((output.mode, output.fault), (Mode::GravityHold, None));
                let after_j = energy_j(&plant);
                assert!(
                    after_j < 1.05 * before_j,
                    "joint {joint}, {soft} N m s/rad: {after_j} J of {before_j} J after {cycle} ms"
                );
            }
            assert!(
                energy_j(&plant) < 0.8 * before_j,
                "joint {joint}, {soft} N m s/rad"
            );
        }
    }
}
