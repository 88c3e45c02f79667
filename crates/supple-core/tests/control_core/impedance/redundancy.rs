//! A fourth active joint: null-space motion is damped without an effect on the tip.

use crate::support::arms::{wam4, wam7};
use crate::support::configs::seven;
use crate::support::plant::{Plant, held_acceleration};
use crate::support::property::{Outcome, check};
use crate::support::states::{Scene, scene};
use crate::support::{inverse, size};
use proptest::prelude::*;
use supple_core::config::{Gains, Law, Role};
use supple_core::dynamics::{crba, jacobian, kinetic_energy};
use supple_core::impedance::{SINGULAR_BELOW_M, Task};
use supple_core::{Arm, Friction, Vector};

const DAMPING: f64 = 2.0;

fn law() -> Law {
    Law {
        nullspace_damping_nm_s_per_rad: DAMPING,
        ..Law::as_published(Gains::isotropic(0.0, 0.0))
    }
}

fn nullspace<const N: usize>(scene: &Scene<N>, arm: &Arm<N>, roles: &[Role; N]) -> Vector<N> {
    let friction = [Friction::NONE; N];
    scene.torques(&law(), &friction, arm, roles, None).nullspace
}

fn regular<const N: usize>(task: &Task<N>) -> bool {
    task.min_singular_value_m > SINGULAR_BELOW_M
}

fn tip_feels_nothing<const N: usize>(arm: Arm<N>, roles: [Role; N]) {
    check(300, scene::<N>(), |scene| -> Outcome {
        if !regular(&scene.task(&arm, &roles)) {
            return Ok(());
        }
        let (q, qd) = (&scene.q, &scene.qd);
        let torque = nullspace(&scene, &arm, &roles);
        prop_assert!(torque.norm() > 0.0);
        let with = held_acceleration(&arm, &roles, q, qd, &torque);
        let without = held_acceleration(&arm, &roles, q, qd, &Vector::zeros());
        let tip = jacobian(&arm, q).fixed_rows::<3>(0) * (with - without);
        prop_assert!(
            tip.norm() < 1e-10 * (1.0 + (with - without).norm()),
            "{tip}"
        );
        Ok(())
    });
}

#[test]
fn nullspace_damping_of_4_joints_does_not_accelerate_the_tip() {
    tip_feels_nothing(wam4(), [Role::Active; 4]);
}

#[test]
fn nullspace_damping_before_a_held_wrist_does_not_accelerate_the_tip() {
    tip_feels_nothing(wam7(), seven().roles);
}

/// The null-space torque satisfies `J H^-1 tau = 0`.
#[test]
fn nullspace_torque_does_not_accelerate_the_tip() {
    let (arm, roles) = (wam4(), [Role::Active; 4]);
    check(300, scene::<4>(), |scene| {
        let task = scene.task(&arm, &roles);
        if !regular(&task) {
            return Ok(());
        }
        let torque = nullspace(&scene, &arm, &roles);
        let tip = task.jacobian * inverse(&crba(&arm, &scene.q)) * torque;
        prop_assert!(tip.norm() < 1e-11 * (1.0 + torque.norm()));
        Ok(())
    });
}

/// For any motion, also near singular poses, the damping only removes energy.
fn only_takes_energy<const N: usize>(arm: Arm<N>, roles: [Role; N]) {
    check(1000, scene::<N>(), |scene| -> Outcome {
        let power = nullspace(&scene, &arm, &roles).dot(&scene.qd);
        prop_assert!(power <= 1e-12, "{power} W added");
        Ok(())
    });
}

#[test]
fn damping_of_4_joints_only_removes_energy() {
    only_takes_energy(wam4(), [Role::Active; 4]);
}

#[test]
fn damping_of_4_joints_before_a_held_wrist_only_removes_energy() {
    only_takes_energy(wam7(), seven().roles);
}

/// Pure null-space motion is subject to the full damping.
#[test]
fn pure_nullspace_motion_is_fully_damped() {
    let (arm, roles) = (wam4(), [Role::Active; 4]);
    check(300, scene::<4>(), |mut scene| {
        let task = scene.task(&arm, &roles);
        if !regular(&task) {
            return Ok(());
        }
        scene.qd -= task.inverse * (task.jacobian * scene.qd);
        let power = nullspace(&scene, &arm, &roles).dot(&scene.qd);
        let expected = -DAMPING * scene.qd.norm_squared();
        prop_assert!((power - expected).abs() < 1e-9, "{power} is not {expected}");
        Ok(())
    });
}

#[test]
fn three_active_joints_have_no_nullspace_motion() {
    let config = crate::support::configs::four();
    check(100, scene::<4>(), |scene| {
        let torque = nullspace(&scene, &config.arm, &config.roles);
        prop_assert_eq!(size(&torque), 0.0);
        Ok(())
    });
}

/// In simulation null-space motion decays while the law keeps the tip in place.
#[test]
fn nullspace_motion_decays() {
    let (arm, roles) = (wam4(), [Role::Active; 4]);
    let q = Vector::<4>::new(0.3, 0.7, 0.4, 1.4);
    let mut scene = Scene {
        q,
        qd: Vector::<4>::new(0.0, 0.0, 1.0, 0.0),
        reference: supple_core::Reference::at_rest(
            supple_core::dynamics::tip_pose(&arm, &q).translation,
        ),
        gains: Gains::isotropic(100.0, 20.0),
        force_n: supple_core::math::Vector3::zeros(),
        friction_share: 1.0,
    };
    let task = scene.task(&arm, &roles);
    scene.qd -= task.inverse * (task.jacobian * scene.qd);
    let mut plant = Plant::at_rest(arm, q);
    plant.qd = scene.qd;
    let energy = kinetic_energy(&arm, &plant.q, &plant.qd);
    let mut astray: f64 = 0.0;
    for _ in 0..1500 {
        (scene.q, scene.qd) = (plant.q, plant.qd);
        let torque = scene
            .torques(&law(), &[Friction::NONE; 4], &arm, &roles, None)
            .total();
        plant.advance(&torque, crate::support::plant::nothing, 1e-3, 2);
        let tip = supple_core::dynamics::tip_pose(&arm, &plant.q).translation;
        astray = astray.max((tip - scene.reference.position).norm());
    }
    let left = kinetic_energy(&arm, &plant.q, &plant.qd) / energy;
    assert!(left < 1e-6, "{left} of the energy is left");
    assert!(astray < 2e-3, "the tip went {astray} m astray");
}
