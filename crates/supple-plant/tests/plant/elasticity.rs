//! Elastic transmissions: closed forms of one joint, an independent integration of an arm, conservation.

use crate::common::{DOWN, wam4, wam4_with};
use core::f64::consts::TAU;
use supple_core::dynamics::{aba, gravity, potential_energy};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Body, Joint, Pose, Vector};
use supple_plant::{ActuatorModel, Elasticity, Plant, PlantConfig};

const ROTOR_KG_M2: f64 = 0.0346;
const LINK_KG_M2: f64 = 0.05;
const STIFFNESS: f64 = 3000.0;

/// A wheel on a vertical axis, which gravity does not turn.
pub fn wheel(rotor_kg_m2: f64, link_kg_m2: f64) -> Arm<1> {
    let joint = Joint {
        parent_from_link: Pose::IDENTITY,
        axis: Vector3::z(),
        // A ball of mass m and radius r has 2/5 m r^2.
        body: Body::ball(link_kg_m2 / (0.4 * 0.01), 0.1, Vector3::zeros()),
        armature_kg_m2: rotor_kg_m2,
    };
    Arm::new(&[joint], Pose::IDENTITY, None, DOWN).unwrap()
}

fn elastic<const N: usize>(arm: Arm<N>, stiffness: f64, damping_ratio: f64) -> PlantConfig<N> {
    PlantConfig {
        elasticity: Some(Elasticity {
            stiffness_nm_per_rad: Vector::repeat(stiffness),
            damping_ratio,
            backlash_rad: 0.0,
        }),
        ..PlantConfig::ideal(arm)
    }
}

fn struck_wheel(damping_ratio: f64) -> Plant<1> {
    let config = elastic(wheel(ROTOR_KG_M2, LINK_KG_M2), STIFFNESS, damping_ratio);
    let mut plant = Plant::new(config, Vector::zeros(), Vector::zeros()).unwrap();
    plant.apply_velocity_step(&Vector::from([1.0])).unwrap();
    plant
}

fn stretch(plant: &Plant<1>) -> f64 {
    plant.truth().motor_position_rad[0] - plant.truth().position_rad[0]
}

fn angular_frequency() -> f64 {
    (STIFFNESS * (1.0 / ROTOR_KG_M2 + 1.0 / LINK_KG_M2)).sqrt()
}

#[test]
fn a_struck_joint_vibrates_at_the_frequency_of_two_inertias_on_a_spring() {
    let mut plant = struck_wheel(0.0);
    let (mut last, mut crossings) = (0.0, Vec::new());
    for cycle in 0..5000 {
        plant.cycle(&Vector::zeros());
        let now = stretch(&plant);
        if last < 0.0 && now >= 0.0 {
            crossings.push(f64::from(cycle) - last / (now - last));
        }
        last = now;
    }
    let periods = (crossings.len() - 1) as f64;
    let period_s = 1e-3 * (crossings[crossings.len() - 1] - crossings[0]) / periods;
    let relative = TAU / period_s / angular_frequency() - 1.0;
    // The method's own frequency error is (w dt)^2 / 24 = 2.5e-4.
    assert!(relative.abs() < 1e-3, "{relative}");
}

#[test]
fn energy_does_not_drift_and_momentum_is_conserved_without_damping() {
    let mut plant = struck_wheel(0.0);
    let initial_j = plant.kinetic_energy_j();
    assert!((initial_j - 0.5 * LINK_KG_M2).abs() < 1e-12);
    let mut mean = |seconds: u32| {
        let mut sum = 0.0;
        for _ in 0..seconds * 1000 {
            plant.cycle(&Vector::zeros());
            let energy_j = plant.kinetic_energy_j() + plant.elastic_energy_j();
            // Symplectic Euler: the error oscillates within w dt / 2 of the vibration's share of the energy.
            assert!((energy_j / initial_j - 1.0).abs() < 0.04, "{energy_j}");
            let truth = plant.truth();
            let momentum = ROTOR_KG_M2 * truth.motor_velocity_rad_per_s[0]
                + LINK_KG_M2 * truth.velocity_rad_per_s[0];
            assert!((momentum / LINK_KG_M2 - 1.0).abs() < 1e-9, "{momentum}");
            sum += energy_j;
        }
        sum / f64::from(seconds * 1000)
    };
    let (first, _, last) = (mean(2), mean(56), mean(2));
    assert!((last / first - 1.0).abs() < 1e-4, "{first} {last}");
}

#[test]
fn vibration_decays_with_the_damping_ratio() {
    let ratio = 0.02;
    let mut plant = struck_wheel(ratio);
    let amplitude = |plant: &mut Plant<1>, cycles: u32| {
        let mut largest = 0.0_f64;
        for _ in 0..cycles {
            plant.cycle(&Vector::zeros());
            largest = largest.max(stretch(plant).abs());
        }
        largest
    };
    let first = amplitude(&mut plant, 50);
    amplitude(&mut plant, 100);
    let later = amplitude(&mut plant, 50);
    // The spring's coordinate has the reduced inertia.
    let reduced = 1.0 / (1.0 / ROTOR_KG_M2 + 1.0 / LINK_KG_M2);
    let damping = 2.0 * ratio * (STIFFNESS * ROTOR_KG_M2).sqrt();
    let rate = damping / (2.0 * reduced);
    let found = (first / later).ln() / 0.150;
    assert!((found / rate - 1.0).abs() < 0.1, "{found} {rate}");
}

/// The elastic arm by the classical Runge-Kutta method on the core's articulated-body algorithm.
fn reference(start: &Vector<4>, stiffness: f64, duration_s: f64) -> (Vector<4>, Vector<4>) {
    let links = wam4_with([0.0; 4]);
    let rotors = wam4().armature();
    let springs = |q: &Vector<4>, theta: &Vector<4>| (theta - q) * stiffness;
    let rate = |s: &[Vector<4>; 4]| {
        let [q, qd, theta, w] = s;
        let spring = springs(q, theta);
        [
            *qd,
            aba(&links, q, qd, &spring),
            *w,
            -spring.component_div(&rotors),
        ]
    };
    let step = |s: &[Vector<4>; 4], k: &[Vector<4>; 4], h: f64| {
        core::array::from_fn::<_, 4, _>(|i| s[i] + k[i] * h)
    };
    let theta = start + gravity(&links, start) / stiffness;
    let mut s = [*start, Vector::zeros(), theta, Vector::zeros()];
    let steps = 20_000;
    let h = duration_s / f64::from(steps);
    for _ in 0..steps {
        let k1 = rate(&s);
        let k2 = rate(&step(&s, &k1, h / 2.0));
        let k3 = rate(&step(&s, &k2, h / 2.0));
        let k4 = rate(&step(&s, &k3, h));
        s = core::array::from_fn(|i| {
            s[i] + (k1[i] + k2[i] * 2.0 + k3[i] * 2.0 + k4[i]) * (h / 6.0)
        });
    }
    (s[0], s[2])
}

fn fallen(start: &Vector<4>, stiffness: f64, step_s: f64, cycles: u32) -> Plant<4> {
    let config = PlantConfig {
        step_s,
        ..elastic(wam4(), stiffness, 0.0)
    };
    let mut plant = Plant::new(config, *start, Vector::zeros()).unwrap();
    for _ in 0..cycles {
        plant.cycle(&Vector::zeros());
    }
    plant
}

#[test]
fn a_falling_elastic_arm_converges_at_first_order() {
    let start = Vector::from([0.3, 0.5, -0.4, 1.2]);
    for stiffness in [1000.0, 3000.0] {
        let (q, theta) = reference(&start, stiffness, 0.1);
        let error = |step_s| {
            let plant = fallen(&start, stiffness, step_s, 100);
            let truth = plant.truth();
            (truth.position_rad - q).norm() + (truth.motor_position_rad - theta).norm()
        };
        let (coarse, fine, finest) = (error(2e-4), error(1e-4), error(2.5e-5));
        assert!(coarse < 2e-3, "{coarse}");
        assert!((coarse / fine / 2.0 - 1.0).abs() < 0.15, "{coarse} {fine}");
        assert!(
            (coarse / finest / 8.0 - 1.0).abs() < 0.15,
            "{coarse} {finest}"
        );
    }
}

#[test]
fn a_falling_elastic_arm_conserves_energy_to_first_order() {
    let start = Vector::from([0.3, 0.5, -0.4, 1.2]);
    let drift = |step_s| {
        let total = |plant: &Plant<4>| {
            let q = &plant.truth().position_rad;
            let potential = potential_energy(&plant.config().arm, q);
            plant.kinetic_energy_j() + plant.elastic_energy_j() + potential
        };
        let mut plant = fallen(&start, 3000.0, step_s, 0);
        let initial_j = total(&plant);
        for _ in 0..500 {
            plant.cycle(&Vector::zeros());
        }
        (total(&plant) - initial_j).abs()
    };
    let (coarse, fine) = (drift(2e-4), drift(5e-5));
    // Some 20 J are exchanged.
    assert!(
        coarse < 0.1 && fine < 0.3 * coarse + 1e-4,
        "{coarse} {fine}"
    );
}

#[test]
fn a_very_stiff_transmission_moves_like_a_rigid_one() {
    let start = Vector::from([0.3, 0.5, -0.4, 1.2]);
    let rigid = {
        let mut plant = Plant::new(PlantConfig::ideal(wam4()), start, Vector::zeros()).unwrap();
        for _ in 0..300 {
            plant.cycle(&Vector::zeros());
        }
        plant.truth().position_rad
    };
    // (w dt)^2 is some 10, which only the implicit method survives.
    let plant = fallen(&start, 1e7, 2e-4, 300);
    let error = (plant.truth().position_rad - rigid).norm();
    assert!(error < 1e-4, "{error}");
    assert!(plant.elastic_energy_j() < 1e-3);
}

#[test]
fn a_held_arm_sags_by_its_weight_over_the_stiffness_and_the_encoders_do_not_see_it() {
    let arm = wam4();
    let start = Vector::from([0.0, 0.6, 0.0, 1.0]);
    let config = PlantConfig {
        actuators: ActuatorModel {
            torque_delay_cycles: 1,
            ..ActuatorModel::direct()
        },
        ..elastic(arm, 1000.0, 0.1)
    };
    let mut plant = Plant::new(config, start, Vector::zeros()).unwrap();
    let before = *plant.measurement();
    let weight = gravity(&arm, &start);
    for _ in 0..500 {
        plant.cycle(&weight);
    }
    let sag = plant.truth().motor_position_rad - plant.truth().position_rad;
    assert!((sag - weight / 1000.0).norm() < 1e-9, "{sag}");
    assert!((plant.measurement().position_rad - before.position_rad).norm() < 1e-9);
    assert_eq!(
        plant.measurement().position_rad,
        plant.truth().motor_position_rad
    );
}

#[test]
fn a_joint_moves_freely_within_its_backlash() {
    let mut config = elastic(wheel(ROTOR_KG_M2, LINK_KG_M2), 1e5, 0.0);
    let elasticity = config.elasticity.as_mut().unwrap();
    elasticity.backlash_rad = 0.02;
    let mut plant = Plant::new(config, Vector::zeros(), Vector::zeros()).unwrap();
    plant.apply_velocity_step(&Vector::from([0.1])).unwrap();
    // Half of the backlash takes 0.1 s.
    for _ in 0..99 {
        plant.cycle(&Vector::zeros());
        assert_eq!(plant.truth().motor_velocity_rad_per_s[0], 0.0);
        assert_eq!(plant.truth().velocity_rad_per_s[0], 0.1);
    }
    // An elastic impact of the link on the rotor: the closed form of two masses.
    for _ in 0..20 {
        plant.cycle(&Vector::zeros());
    }
    let sum = ROTOR_KG_M2 + LINK_KG_M2;
    let expected = [
        0.1 * (LINK_KG_M2 - ROTOR_KG_M2) / sum,
        0.2 * LINK_KG_M2 / sum,
    ];
    let truth = plant.truth();
    assert!((truth.velocity_rad_per_s[0] / expected[0] - 1.0).abs() < 0.1);
    assert!((truth.motor_velocity_rad_per_s[0] / expected[1] - 1.0).abs() < 0.1);
}

#[test]
fn a_joint_without_rotor_stays_rigid() {
    let mut plant = Plant::new(
        elastic(wheel(0.0, LINK_KG_M2), 100.0, 0.0),
        Vector::zeros(),
        Vector::zeros(),
    )
    .unwrap();
    for _ in 0..100 {
        plant.cycle(&Vector::from([0.5]));
    }
    let truth = plant.truth();
    assert_eq!(truth.motor_position_rad, truth.position_rad);
    // Semi-implicit Euler: 0.1 s at 10 rad/s^2 and half a step more.
    assert!((truth.velocity_rad_per_s[0] - 1.0).abs() < 1e-9);
}
