//! Shorted motors only dissipate energy; the arm descends at the speed at which motors and friction dissipate the
//! power of gravity, and this speed determines the impact on a body below.

use crate::common::wam4_at;
use supple_core::dynamics::{crba, gravity, jacobian};
use supple_core::nalgebra::Vector3;
use supple_core::{Arm, Body, Joint, Pose, Vector};
use supple_model::Description;
use supple_plant::{Material, Plant, PlantConfig, Scene};

/// Height of the tip above the face of the block at the start \[m\].
const HEIGHT_M: f64 = 0.05;

fn described() -> PlantConfig<4> {
    let description = Description::asset("wam4").expect("built in");
    PlantConfig::from_description(&description).expect("four joints")
}

/// A single rotor behind a gear: `J q'' = -n^2 b q'`.
#[test]
fn a_shorted_motor_stops_its_rotor_with_its_time_constant() {
    let (inertia_kg_m2, gear, braking) = (0.2, -42.0, 0.06);
    let joint = Joint {
        parent_from_link: Pose::IDENTITY,
        axis: Vector3::z(),
        body: Body::ball(1e-6, 1e-3, Vector3::zeros()),
        armature_kg_m2: inertia_kg_m2,
    };
    let arm = Arm::new(&[joint], Pose::IDENTITY, None, Vector3::zeros()).expect("valid");
    let mut config = PlantConfig::ideal(arm);
    config.step_s = 2e-5;
    config.actuators.joint_from_motor[(0, 0)] = 1.0 / gear;
    config.actuators.braking_nm_s_per_rad = Vector::from([braking]);
    let mut plant = Plant::new(config, Vector::zeros(), Vector::from([1.0])).expect("valid");
    for cycle in 1..=5 {
        plant.short_motors([cycle > 2]);
        plant.cycle(&Vector::zeros());
        let braked_s = 1e-3 * f64::from(cycle - 2).max(0.0);
        let expected = (-braked_s * gear * gear * braking / inertia_kg_m2).exp();
        let speed = plant.truth().velocity_rad_per_s[0];
        assert!((speed - expected).abs() < 0.01, "{speed} {expected}");
    }
}

/// A motor brakes until its first torque acts, so that a weight is always held while the drives become active.
#[test]
fn a_released_motor_brakes_until_its_torque_acts() {
    let joint = Joint {
        parent_from_link: Pose::IDENTITY,
        axis: Vector3::z(),
        body: Body::ball(1e-6, 1e-3, Vector3::zeros()),
        armature_kg_m2: 200.0,
    };
    let arm = Arm::new(&[joint], Pose::IDENTITY, None, Vector3::zeros()).expect("valid");
    let (delay_cycles, braking, command_nm) = (3, 5.0, 2.0);
    let mut config = PlantConfig::ideal(arm);
    config.actuators.torque_delay_cycles = delay_cycles;
    config.actuators.braking_nm_s_per_rad = Vector::from([braking]);
    let mut plant = Plant::new(config, Vector::zeros(), Vector::from([1.0])).expect("valid");
    for cycle in 0..20 {
        let is_active = (5..15).contains(&cycle);
        plant.short_motors([!is_active]);
        plant.cycle(&Vector::from([if is_active { command_nm } else { 0.0 }]));
        let torque_nm = plant.truth().motor_torque_nm[0];
        let acts = (5 + delay_cycles..15 + delay_cycles).contains(&cycle);
        let brakes = !(5 + delay_cycles..15).contains(&cycle);
        let speed = plant.truth().velocity_rad_per_s[0];
        let expected =
            if acts { command_nm } else { 0.0 } - if brakes { braking * speed } else { 0.0 };
        assert!(
            (torque_nm - expected).abs() < 0.02,
            "{cycle}: {torque_nm} {expected}"
        );
    }
}

/// With a transmission that couples joints, each shorted motor dissipates `b p'^2`, and other motors dissipate nothing.
#[test]
fn energy_lost_by_the_arm_equals_energy_dissipated_by_the_motors() {
    let mut config = described();
    config.cycle_s = config.step_s;
    let home = Vector::from([0.0, -1.8, 0.0, 2.9]);
    let speed = Vector::from([0.3, -0.2, 0.5, -0.7]);
    let to_motors = config.actuators.joint_from_motor.try_inverse();
    let motor_speed = to_motors.expect("regular") * speed;
    let torque = |shorted| {
        let mut plant = Plant::new(config.clone(), home, speed).expect("valid");
        plant.short_motors(shorted);
        plant.cycle(&Vector::zeros());
        plant.truth().motor_torque_nm
    };
    for shorted in [[true; 4], [false, true, false, true]] {
        let taken_w = (torque([false; 4]) - torque(shorted)).dot(&speed);
        let motors = (0..4).filter(|i| shorted[*i]);
        let heat_w: f64 = motors
            .map(|i| config.actuators.braking_nm_s_per_rad[i] * motor_speed[i].powi(2))
            .sum();
        assert!(heat_w > 0.0);
        assert!(
            (taken_w - heat_w).abs() < 1e-9 * heat_w,
            "{taken_w} {heat_w}"
        );
    }
}

/// Fall from rest above a block with shorted motors, until the impact, and its maximum force.
struct Fall {
    speed_m_per_s: f64,
    peak_n: f64,
    effective_mass_kg: f64,
    /// Power of gravity, of the shorted motors and of friction half-way down \[W\].
    gravity_w: f64,
    braking_w: f64,
    friction_w: f64,
}

fn fall(step_s: f64) -> Fall {
    let mut config = described();
    config.step_s = step_s;
    config.scene = Scene::with_block_at(-HEIGHT_M - config.tip_radius_m);
    let (arm, actuators) = (config.arm, config.actuators.clone());
    let to_motors = actuators.joint_from_motor.try_inverse().expect("regular");
    let mut plant = Plant::new(config, wam4_at(&arm, 0.65, 0.0), Vector::zeros()).expect("valid");
    plant.short_motors([true; 4]);
    let mut fall = Fall {
        speed_m_per_s: 0.0,
        peak_n: 0.0,
        effective_mass_kg: 0.0,
        gravity_w: 0.0,
        braking_w: 0.0,
        friction_w: 0.0,
    };
    for _ in 0..1500 {
        plant.cycle(&Vector::zeros());
        let peak_n = plant.take_max_force_n().norm();
        let truth = plant.truth();
        let (q, qd) = (truth.position_rad, truth.velocity_rad_per_s);
        fall.peak_n = fall.peak_n.max(peak_n);
        if fall.peak_n > 0.0 {
            continue;
        }
        if truth.tip_position_m.z > -0.5 * HEIGHT_M {
            fall.gravity_w = -gravity(&arm, &q).dot(&qd);
            let motor = to_motors * qd;
            fall.braking_w = motor.dot(&actuators.braking_nm_s_per_rad.component_mul(&motor));
            fall.friction_w = truth.friction_torque_nm.dot(&qd);
        }
        fall.speed_m_per_s = -truth.tip_velocity_m_per_s.z;
        let up = jacobian(&arm, &q).fixed_rows::<1>(2).into_owned();
        let inertia = crba(&arm, &q).try_inverse().expect("positive");
        fall.effective_mass_kg = 1.0 / (up * inertia * up.transpose())[(0, 0)];
    }
    fall
}

/// Peak force of the contact law for a freely falling mass, integrated with small steps.
fn peak_n(material: &Material, mass_kg: f64, speed_m_per_s: f64) -> f64 {
    let (mut depth, mut rate, mut peak) = (0.0_f64, speed_m_per_s, 0.0_f64);
    let dt_s = 1e-7;
    while rate > 0.0 {
        let force = material.normal_force_n(depth, rate);
        peak = peak.max(force);
        rate -= force / mass_kg * dt_s;
        depth += rate * dt_s;
    }
    peak
}

#[test]
fn a_braked_arm_descends_slowly_and_its_speed_determines_the_impact() {
    let fine = fall(2e-5);
    // The power of gravity is dissipated completely: the speed is steady.
    let taken_w = fine.braking_w + fine.friction_w;
    assert!(
        (taken_w - fine.gravity_w).abs() < 0.03 * fine.gravity_w,
        "{} W and {} W of {} W",
        fine.braking_w,
        fine.friction_w,
        fine.gravity_w
    );
    assert!(fine.braking_w > fine.friction_w);
    assert!(
        (0.05..0.12).contains(&fine.speed_m_per_s),
        "{}",
        fine.speed_m_per_s
    );
    let expected_n = peak_n(
        &Material::wood(),
        fine.effective_mass_kg,
        fine.speed_m_per_s,
    );
    assert!(
        (fine.peak_n - expected_n).abs() < 0.05 * expected_n,
        "{} N, {expected_n} N expected",
        fine.peak_n
    );
    // The default step overestimates the peak of a faster impact slightly more than that of the experiments.
    let coarse = fall(2e-4);
    assert!((coarse.speed_m_per_s - fine.speed_m_per_s).abs() < 0.01 * fine.speed_m_per_s);
    let excess = coarse.peak_n / fine.peak_n - 1.0;
    assert!((-0.02..0.15).contains(&excess), "{excess}");
}
