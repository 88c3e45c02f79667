//! Encoders, amplifiers, stops and noise; reruns are bit-identical.

use crate::common::{block, tip_spring, wam4, wam4_at, weight};
use core::f64::consts::TAU;
use supple_core::dynamics::aba;
use supple_core::nalgebra::Vector3;
use supple_core::{Friction, Matrix, Vector};
use supple_plant::{
    ActuatorModel, ForceSensor, HardStops, LuGre, Plant, PlantConfig, PlantError, Ripple,
};

/// `joint_from_motor` of the four-joint arm with its differential shoulder.
fn transmission() -> Matrix<4, 4> {
    let (n2, n3) = (28.25, 28.25 / 1.68);
    let motor_from_joint = Matrix::<4, 4>::from_row_slice(&[
        -42.0, 0.0, 0.0, 0.0, 0.0, n2, -n3, 0.0, 0.0, -n2, -n3, 0.0, 0.0, 0.0, 0.0, -18.0,
    ]);
    motor_from_joint.try_inverse().unwrap()
}

fn real_actuators() -> ActuatorModel<4> {
    ActuatorModel {
        joint_from_motor: transmission(),
        counts_per_motor_revolution: Vector::repeat(4096.0),
        motor_torque_quantum_nm: Vector::repeat(1.0 / 2700.0),
        torque_delay_cycles: 1,
        ..ActuatorModel::direct()
    }
}

fn plant_with(actuators: ActuatorModel<4>) -> Plant<4> {
    let arm = wam4();
    let config = PlantConfig {
        actuators,
        ..PlantConfig::ideal(arm)
    };
    Plant::new(config, wam4_at(&arm, 0.6, 0.0), Vector::zeros()).unwrap()
}

#[test]
fn measured_angles_are_quantised_to_motor_counts_within_half_a_count() {
    let mut plant = plant_with(real_actuators());
    let motor_from_joint = transmission().try_inverse().unwrap();
    for _ in 0..200 {
        let measured = plant.cycle(&Vector::zeros()).position_rad;
        let counts = |q: &Vector<4>| motor_from_joint * q * (4096.0 / TAU);
        let found = counts(&measured);
        let truth = counts(&plant.truth().position_rad);
        for motor in 0..4 {
            assert!((found[motor] - found[motor].round()).abs() < 1e-6);
            assert!((found[motor] - truth[motor]).abs() < 0.5 + 1e-6);
        }
    }
    assert!(
        plant.truth().position_rad[1].abs() > 0.01,
        "the joint moved over many counts"
    );
}

#[test]
fn torques_are_quantised_to_amplifier_steps_within_half_a_step() {
    let actuators = ActuatorModel {
        torque_delay_cycles: 0,
        ..real_actuators()
    };
    let mut plant = plant_with(actuators);
    for i in 0..50 {
        let command = Vector::from([0.1, -14.0, 0.3, 2.0]) * (1.0 + 0.01 * f64::from(i));
        plant.cycle(&command);
        let motor = |tau: &Vector<4>| transmission().transpose() * tau * 2700.0;
        let found = motor(&plant.truth().motor_torque_nm);
        let commanded = motor(&command);
        for m in 0..4 {
            assert!((found[m] - found[m].round()).abs() < 1e-6);
            assert!((found[m] - commanded[m]).abs() < 0.5 + 1e-6);
        }
    }
}

/// A drive that carries the remainder gives the commanded torque in the mean; without it the mean is wrong by up to half a step.
#[test]
fn a_carried_remainder_makes_the_mean_torque_exact() {
    let mean_nm = |carries_remainder| {
        let mut plant = plant_with(ActuatorModel {
            motor_torque_quantum_nm: Vector::repeat(0.5),
            carries_remainder,
            ..ActuatorModel::direct()
        });
        let mut sum = Vector::<4>::zeros();
        for _ in 0..100 {
            plant.cycle(&Vector::from([0.2, -0.2, 1.3, 0.0]));
            sum += plant.truth().motor_torque_nm;
        }
        sum / 100.0
    };
    let exact = mean_nm(true) - Vector::from([0.2, -0.2, 1.3, 0.0]);
    assert!(exact.amax() <= 0.25 / 100.0 + 1e-12, "{exact}");
    assert_eq!(mean_nm(false), Vector::from([0.0, 0.0, 1.5, 0.0]));
}

#[test]
fn a_torque_acts_after_exactly_its_delay_and_gravity_is_compensated_until_then() {
    for delay in [0, 1, 3] {
        let mut plant = plant_with(ActuatorModel {
            torque_delay_cycles: delay,
            ..ActuatorModel::direct()
        });
        let start = plant.truth().position_rad;
        for cycle in 0..6 {
            let command = Vector::from([1.0 + cycle as f64, 0.0, 0.0, 0.0]);
            let gravity_nm = weight(&plant);
            plant.cycle(&command);
            let acted = plant.truth().motor_torque_nm;
            if cycle < delay {
                assert!((acted - gravity_nm).norm() < 1e-9);
                assert!((plant.truth().position_rad - start).norm() < 1e-12);
            } else {
                assert_eq!(acted[0], 1.0 + (cycle - delay) as f64);
            }
        }
    }
}

#[test]
fn a_non_finite_command_is_ignored() {
    let mut plant = plant_with(ActuatorModel::direct());
    plant.cycle(&Vector::from([2.0, 0.0, 0.0, 0.0]));
    plant.cycle(&Vector::from([f64::NAN, 5.0, 0.0, 0.0]));
    assert_eq!(
        plant.truth().motor_torque_nm,
        Vector::from([2.0, 0.0, 0.0, 0.0])
    );
    assert!(plant.truth().position_rad.iter().all(|q| q.is_finite()));
}

#[test]
fn ripple_adds_its_harmonic_of_the_motor_angle() {
    let ripple = Ripple {
        motor: 3,
        harmonic: 6,
        amplitude_nm: 0.02,
        phase_rad: 0.4,
    };
    let mut plant = plant_with(ActuatorModel {
        joint_from_motor: transmission(),
        ripple: vec![ripple],
        ..ActuatorModel::direct()
    });
    let config = plant.config().clone();
    let q = plant.truth().position_rad;
    let command = weight(&plant);
    plant.cycle(&command);
    let motor_angle = -18.0 * q[3];
    let expected = -18.0 * 0.02 * (6.0 * motor_angle + 0.4).sin();
    // The velocity after a single step from rest at q shows the torque of that step.
    let one_step = PlantConfig {
        cycle_s: 2e-4,
        ..config
    };
    let mut single = Plant::new(one_step, q, Vector::zeros()).unwrap();
    single.cycle(&command);
    let total = command + Vector::from([0.0, 0.0, 0.0, expected]);
    let expected_velocity = aba(&wam4(), &q, &Vector::zeros(), &total) * 2e-4;
    let found = single.truth().velocity_rad_per_s;
    assert!(
        (found - expected_velocity).norm() < 1e-9 * expected_velocity.norm().max(1e-3),
        "{found} {expected_velocity}"
    );
    assert!(expected.abs() > 0.05);
}

#[test]
fn hard_stops_hold_the_arm_and_dissipate_its_energy() {
    let arm = wam4();
    let lower = Vector::from([-2.6, -2.0, -2.8, -0.9]);
    let upper = Vector::from([2.6, 2.0, 2.8, 3.1]);
    for direction in [1.0, -1.0] {
        let config = PlantConfig {
            stops: Some(HardStops::new(lower, upper)),
            ..PlantConfig::ideal(arm)
        };
        let mut plant =
            Plant::new(config, Vector::from([0.0, 0.0, 0.0, 1.0]), Vector::zeros()).unwrap();
        let push = Vector::from([20.0, 15.0, 3.0, 5.0]) * direction;
        let mut penetration = 0.0_f64;
        for _ in 0..6_000 {
            let qd = plant.truth().velocity_rad_per_s;
            let tau = weight(&plant) + push - qd.component_mul(&Vector::from([4.0, 4.0, 1.0, 1.0]));
            plant.cycle(&tau);
            let q = plant.truth().position_rad;
            penetration = penetration.max((q - upper).max()).max((lower - q).max());
        }
        let truth = plant.truth();
        assert!(penetration > 0.0 && penetration < 0.06, "{penetration}");
        assert!(truth.velocity_rad_per_s.norm() < 1e-6, "{truth:?}");
        let stop = if direction > 0.0 { upper } else { lower };
        // At rest the spring of each stop balances the applied torque.
        let deviation = truth.position_rad - stop - push / 1e4;
        assert!(deviation.norm() < 1e-6, "{deviation}");
    }
}

#[test]
fn sensor_noise_has_the_configured_deviation_and_no_bias() {
    let arm = wam4();
    let config = PlantConfig {
        force_sensor: ForceSensor {
            noise_n: 0.05,
            ..ForceSensor::default()
        },
        actuators: ActuatorModel {
            encoder_noise_rad: Vector::repeat(1e-4),
            ..ActuatorModel::direct()
        },
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.6, 0.0);
    let mut plant = Plant::new(config, q, Vector::zeros()).unwrap();
    let n = 20_000;
    let (mut force_sum, mut force_squares, mut angle_squares) = (Vector3::zeros(), 0.0, 0.0);
    for _ in 0..n {
        let gravity_nm = weight(&plant);
        let measured = plant.cycle(&gravity_nm);
        force_sum += measured.force_n;
        force_squares += measured.force_n.norm_squared() / 3.0;
        angle_squares += (measured.position_rad - plant.truth().position_rad).norm_squared() / 4.0;
    }
    let n = f64::from(n);
    assert!((force_sum / n).norm() < 5.0 * 0.05 * (3.0 / n).sqrt());
    assert!(((force_squares / n).sqrt() / 0.05 - 1.0).abs() < 0.02);
    assert!(((angle_squares / n).sqrt() / 1e-4 - 1.0).abs() < 0.02);
}

/// A run of one second in contact with all effects enabled.
fn run_with_all_effects(seed: u64) -> Vec<u64> {
    let arm = wam4();
    let friction = [
        (1.605, 1.648),
        (0.533, 2.364),
        (0.372, 0.811),
        (0.642, 0.601),
    ]
    .map(|(coulomb, viscous)| LuGre::from_friction(&Friction::coulomb(viscous, coulomb)));
    let config = PlantConfig {
        friction,
        actuators: ActuatorModel {
            encoder_noise_rad: Vector::repeat(1e-4),
            ripple: vec![Ripple {
                motor: 1,
                harmonic: 12,
                amplitude_nm: 0.01,
                phase_rad: 0.0,
            }],
            ..real_actuators()
        },
        force_sensor: ForceSensor {
            noise_n: 0.02,
            ..ForceSensor::default()
        },
        scene: block(),
        seed,
        ..PlantConfig::ideal(arm)
    };
    let q = wam4_at(&arm, 0.72, 0.022);
    let mut plant = Plant::new(config, q, Vector::zeros()).unwrap();
    let mut bits = Vec::new();
    for _ in 0..1_000 {
        let tau = tip_spring(&plant, &Vector3::new(0.72, 0.02, 0.0), 300.0, 20.0);
        let measured = plant.cycle(&tau);
        let values = measured.position_rad.iter().chain(measured.force_n.iter());
        bits.extend(values.map(|x| x.to_bits()));
        bits.extend(plant.truth().position_rad.iter().map(|x| x.to_bits()));
    }
    assert!(
        plant.truth().contact_force_n.z > 0.5,
        "the tip rests on the block"
    );
    bits
}

#[test]
fn a_rerun_is_bit_identical_and_another_seed_gives_other_results() {
    let first = run_with_all_effects(5);
    assert!(first == run_with_all_effects(5));
    assert!(first != run_with_all_effects(6));
}

#[test]
fn setting_the_state_is_equivalent_to_starting_there() {
    let arm = wam4();
    let (q, qd) = (wam4_at(&arm, 0.7, 0.1), Vector::from([0.2, 0.1, -0.3, 0.4]));
    let fresh = |q, qd| Plant::new(PlantConfig::ideal(arm), q, qd).unwrap();
    let mut moved = fresh(Vector::zeros(), Vector::zeros());
    for _ in 0..20 {
        moved.cycle(&Vector::from([1.0, 2.0, 0.0, 1.0]));
    }
    moved.set_state(q, qd).unwrap();
    assert_eq!(moved.measurement().cycle, 20);
    let mut started = fresh(q, qd);
    for _ in 0..50 {
        moved.cycle(&Vector::zeros());
        started.cycle(&Vector::zeros());
    }
    let difference = moved.truth().position_rad - started.truth().position_rad;
    assert!(difference.norm() < 1e-12, "{difference}");
    let error = moved.set_state(Vector::repeat(f64::NAN), qd).unwrap_err();
    assert!(error.to_string().contains("q of joint 0"));
}

#[test]
fn invalid_entries_are_rejected_with_name_value_and_requirement() {
    let arm = wam4();
    let error_of = |edit: &dyn Fn(&mut PlantConfig<4>)| -> PlantError {
        let mut config = PlantConfig::ideal(arm);
        edit(&mut config);
        Plant::new(config, Vector::zeros(), Vector::zeros())
            .err()
            .unwrap()
    };
    let assert_contains = |error: PlantError, words: &[&str]| {
        let text = error.to_string();
        assert!(words.iter().all(|w| text.contains(w)), "{text}");
    };
    assert_contains(error_of(&|c| c.step_s = 0.0), &["step_s", "0", "positive"]);
    assert_contains(
        error_of(&|c| c.cycle_s = 5e-4),
        &["cycle_s", "0.0005", "whole number"],
    );
    assert_contains(
        error_of(&|c| c.tip_radius_m = -0.01),
        &["tip_radius_m", "-0.01"],
    );
    assert_contains(
        error_of(&|c| c.actuators.joint_from_motor = Matrix::zeros()),
        &["joint_from_motor", "invertible"],
    );
    assert_contains(
        error_of(&|c| c.actuators.joint_from_motor[(0, 0)] = f64::NAN),
        &["joint_from_motor", "invertible"],
    );
    assert_contains(
        error_of(&|c| c.actuators.motor_torque_quantum_nm[2] = -1.0),
        &["motor_torque_quantum_nm of motor 2", "-1"],
    );
    assert_contains(
        error_of(&|c| c.friction[1].coulomb_nm = 2.0),
        &["friction of joint 1", "breakaway_nm", "at least coulomb_nm"],
    );
    assert_contains(
        error_of(&|c| c.force_sensor.cutoff_hz = 4e3),
        &["cutoff_hz", "4000", "half the sampling rate"],
    );
    assert_contains(
        error_of(&|c| c.stops = Some(HardStops::new(Vector::zeros(), Vector::zeros()))),
        &["stops.lower_rad of joint 0", "below"],
    );
    let start = Plant::new(
        PlantConfig::ideal(arm),
        Vector::zeros(),
        Vector::from([0.0, 0.0, f64::INFINITY, 0.0]),
    );
    assert_contains(start.err().unwrap(), &["qd0 of joint 2", "inf", "finite"]);
}

#[test]
fn a_plant_can_be_sent_to_another_thread() {
    fn send<T: Send>(_: &T) {}
    send(&plant_with(ActuatorModel::direct()));
}
