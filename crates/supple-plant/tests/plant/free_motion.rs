//! The plant without contact or friction compared with the core's articulated-body algorithm: two
//! derivations of the same mechanics that share no code.

use crate::common::{self, random_arm, wam4, wam4_with};
use supple_core::dynamics::{aba, kinetic_energy, potential_energy, tip_pose};
use supple_core::{Arm, Vector};
use supple_plant::{Plant, PlantConfig};

/// Torque-free motion by the classical Runge-Kutta method.
fn runge_kutta<const N: usize>(
    arm: &Arm<N>,
    (mut q, mut qd): (Vector<N>, Vector<N>),
    duration_s: f64,
    steps: usize,
) -> (Vector<N>, Vector<N>) {
    let h = duration_s / steps as f64;
    let acceleration = |q: &Vector<N>, qd: &Vector<N>| aba(arm, q, qd, &Vector::zeros());
    for _ in 0..steps {
        let (k1, l1) = (qd, acceleration(&q, &qd));
        let (k2, l2) = (
            qd + l1 * (h / 2.0),
            acceleration(&(q + k1 * (h / 2.0)), &(qd + l1 * (h / 2.0))),
        );
        let (k3, l3) = (
            qd + l2 * (h / 2.0),
            acceleration(&(q + k2 * (h / 2.0)), &(qd + l2 * (h / 2.0))),
        );
        let (k4, l4) = (qd + l3 * h, acceleration(&(q + k3 * h), &(qd + l3 * h)));
        q += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        qd += (l1 + l2 * 2.0 + l3 * 2.0 + l4) * (h / 6.0);
    }
    (q, qd)
}

fn fall<const N: usize>(
    arm: &Arm<N>,
    start: (Vector<N>, Vector<N>),
    cycles: usize,
    step_s: f64,
) -> Plant<N> {
    let config = PlantConfig {
        step_s,
        ..PlantConfig::ideal(*arm)
    };
    let mut plant = Plant::new(config, start.0, start.1).unwrap();
    for _ in 0..cycles {
        plant.cycle(&Vector::zeros());
    }
    plant
}

fn converges_at_first_order<const N: usize>(arm: &Arm<N>, start: (Vector<N>, Vector<N>)) {
    let cycles = 300;
    let duration_s = cycles as f64 * 1e-3;
    let (q, qd) = runge_kutta(arm, start, duration_s, 2000);
    let tip = tip_pose(arm, &q).translation;
    let error = |step_s: f64| {
        let plant = fall(arm, start, cycles, step_s);
        let truth = plant.truth();
        let joint = (truth.position_rad - q).norm() + (truth.velocity_rad_per_s - qd).norm();
        (joint, (truth.tip_position_m - tip).norm())
    };
    let (coarse, fine, finest) = (error(2e-4), error(1e-4), error(2.5e-5));
    assert!(coarse.0 < 5e-3 * (1.0 + qd.norm()), "{coarse:?}");
    for (a, b, ratio) in [
        (coarse.0, fine.0, 2.0),
        (coarse.1, fine.1, 2.0),
        (coarse.0, finest.0, 8.0),
        (coarse.1, finest.1, 8.0),
    ] {
        assert!(
            (a / b / ratio - 1.0).abs() < 0.05,
            "{coarse:?} {fine:?} {finest:?}"
        );
    }
}

#[test]
fn a_falling_wam_converges_to_the_articulated_body_algorithm() {
    let start = (
        Vector::from([0.1, 0.5, 0.3, 1.0]),
        Vector::from([0.5, 0.0, -0.5, 0.3]),
    );
    converges_at_first_order(&wam4(), start);
}

#[test]
fn falling_random_arms_converge_to_the_articulated_body_algorithm() {
    let start = |n: usize| 0.3 * n as f64 - 0.7;
    for seed in [1, 2, 3] {
        let q = Vector::from_fn(|i, _| start(i));
        let qd = Vector::from_fn(|i, _| start(i + 1));
        converges_at_first_order(&random_arm::<3>(seed), (q, qd));
        let q = Vector::from_fn(|i, _| start(i));
        converges_at_first_order(&random_arm::<7>(seed), (q, Vector::zeros()));
    }
}

/// The velocity after the first step from rest is `dt` times the acceleration, so it checks torques, inertias and
/// rotors to rounding accuracy.
#[test]
fn the_first_step_from_rest_is_exact() {
    let arm = wam4();
    let q = Vector::from([0.4, 0.7, -0.3, 1.1]);
    let tau = Vector::from([3.0, -20.0, 1.5, 4.0]);
    let first = |arm: &Arm<4>| {
        let config = PlantConfig {
            cycle_s: 2e-4,
            ..PlantConfig::ideal(*arm)
        };
        let mut plant = Plant::new(config, q, Vector::zeros()).unwrap();
        plant.cycle(&tau);
        plant.truth().velocity_rad_per_s / 2e-4
    };
    let expected = aba(&arm, &q, &Vector::zeros(), &tau);
    let found = first(&arm);
    assert!(
        (found - expected).norm() < 1e-10 * expected.norm(),
        "{found} {expected}"
    );
    let without_rotors = first(&wam4_with([0.0; 4]));
    assert!((without_rotors - expected).norm() > 0.3 * expected.norm());
}

#[test]
fn a_frictionless_fall_conserves_energy_to_the_order_of_the_step() {
    let arm = wam4();
    let start = (Vector::from([0.1, 0.5, 0.3, 1.0]), Vector::zeros());
    let energy = |plant: &Plant<4>| {
        let truth = plant.truth();
        let (q, qd) = (truth.position_rad, truth.velocity_rad_per_s);
        (kinetic_energy(&arm, &q, &qd), potential_energy(&arm, &q))
    };
    let drift = |step_s: f64| {
        let before = energy(&fall(&arm, start, 0, step_s)).1;
        let (kinetic, potential) = energy(&fall(&arm, start, 400, step_s));
        assert!(kinetic > 10.0, "it falls");
        (kinetic + potential - before) / kinetic
    };
    let (coarse, fine) = (drift(2e-4), drift(1e-4));
    assert!(coarse.abs() < 2e-3, "{coarse}");
    assert!((coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
}

#[test]
fn gravity_acts_along_the_axis_of_the_arm_configuration() {
    let q = Vector::from([0.4, 0.7, -0.3, 1.1]);
    let sideways = supple_core::nalgebra::Vector3::new(3.0, -9.0, 1.0);
    let arm = common::wam4_in(sideways);
    let config = PlantConfig {
        cycle_s: 2e-4,
        ..PlantConfig::ideal(arm)
    };
    let mut plant = Plant::new(config, q, Vector::zeros()).unwrap();
    plant.cycle(&Vector::zeros());
    let expected = aba(&arm, &q, &Vector::zeros(), &Vector::zeros()) * 2e-4;
    let found = plant.truth().velocity_rad_per_s;
    assert!((found - expected).norm() < 1e-10 * expected.norm());
}
