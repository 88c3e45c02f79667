//! Compares each effect with a closed-form solution.

use crate::elasticity::wheel;
use core::f64::consts::TAU;
use supple_core::{Arm, Friction, Matrix, Vector};
use supple_plant::{
    ActuatorModel, FrictionVariation, Hose, LuGre, Plant, PlantConfig, PlantOptions, TorqueRipple,
};

use crate::common::wam4;

/// Two joints with the differential of the WAM's shoulder, as wheels on parallel axes.
fn differential() -> Matrix<2, 2> {
    let (n2, n3) = (28.25, 28.25 / 1.68);
    let motor_from_joint = Matrix::<2, 2>::new(n2, -n3, -n2, -n3);
    motor_from_joint.try_inverse().unwrap()
}

fn plant_of<const N: usize>(config: PlantConfig<N>, qd: Vector<N>) -> Plant<N> {
    Plant::new(config, Vector::zeros(), qd).unwrap()
}

/// A wheel so heavy that its speed hardly changes.
fn flywheel(speed: f64, friction: LuGre, variation: FrictionVariation<1>) -> Plant<1> {
    let config = PlantConfig {
        friction: [friction],
        friction_variation: variation,
        ..PlantConfig::ideal(wheel(0.0, 1e6))
    };
    plant_of(config, Vector::from([speed]))
}

fn dry() -> LuGre {
    LuGre::from_friction(&Friction::coulomb(0.0, 2.0)).without_load()
}

#[test]
fn the_amplifier_has_dead_zone_gain_offset_and_ripple() {
    let actuators = ActuatorModel {
        dead_zone_nm: Vector::from([0.1]),
        torque_constant: Vector::from([0.9]),
        offset_nm: Vector::from([0.02]),
        torque_ripple: vec![TorqueRipple {
            motor: 0,
            harmonic: 3,
            fraction: 0.05,
            phase_rad: 0.4,
        }],
        joint_from_motor: Matrix::<1, 1>::new(0.1),
        ..ActuatorModel::direct()
    };
    let config = PlantConfig {
        actuators,
        ..PlantConfig::ideal(wheel(0.0, 1e6))
    };
    let mut plant = plant_of(config, Vector::from([2.0]));
    for motor_nm in [0.0, 0.09, -0.09, 0.5, -0.5, 3.0] {
        let angle = 10.0 * plant.truth().position_rad[0];
        // The joint torque is the motor's times the ratio of 10; the ripple is that at the start of the last step.
        plant.cycle(&Vector::from([10.0 * motor_nm]));
        let at_step = angle + 10.0 * 2.0 * 0.8e-3;
        let beyond = if motor_nm.abs() < 0.1 {
            0.0
        } else {
            motor_nm - 0.1 * motor_nm.signum()
        };
        let ripple = 1.0 + 0.05 * (3.0 * at_step + 0.4).sin();
        let expected = 10.0 * (0.9 * beyond * ripple + 0.02);
        let found = plant.truth().motor_torque_nm[0];
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    plant.short_motors([true]);
    plant.cycle(&Vector::zeros());
    assert_eq!(
        plant.truth().motor_torque_nm[0],
        0.0,
        "no braking, no offset"
    );
}

#[test]
fn an_encoder_bias_shifts_the_measured_angle_by_a_constant() {
    let actuators = ActuatorModel {
        encoder_bias_rad: Vector::from([0.003]),
        ..ActuatorModel::direct()
    };
    let config = PlantConfig {
        actuators,
        ..PlantConfig::ideal(wheel(0.0, 1.0))
    };
    let mut plant = plant_of(config, Vector::from([1.0]));
    for _ in 0..10 {
        let measured = plant.cycle(&Vector::from([0.3])).position_rad[0];
        assert_eq!(measured, plant.truth().position_rad[0] + 0.003);
    }
}

#[test]
fn a_joint_with_a_hose_oscillates_about_its_preloaded_rest_angle() {
    let config = PlantConfig {
        hose: Hose {
            stiffness_nm_per_rad: Vector::repeat(2.0),
            preload_nm: Vector::from([0.4]),
        },
        ..PlantConfig::ideal(wheel(0.0, 0.05))
    };
    let mut plant = plant_of(config, Vector::zeros());
    let (mut lowest, mut highest) = (0.0_f64, 0.0_f64);
    // From rest at 0 it swings about -0.2 rad: after a whole period it is back.
    let period_s = TAU * (0.05_f64 / 2.0).sqrt();
    for _ in 0..(period_s / 1e-3) as u32 {
        let q = plant.cycle(&Vector::zeros()).position_rad[0];
        (lowest, highest) = (lowest.min(q), highest.max(q));
    }
    assert!((lowest + 0.4).abs() < 1e-3, "{lowest}");
    assert!(highest < 1e-3, "{highest}");
    assert!(plant.truth().position_rad[0].abs() < 1e-3);
}

#[test]
fn friction_warms_up_exponentially() {
    let friction = LuGre::from_friction(&Friction::coulomb(1.5, 2.0)).without_load();
    let variation = FrictionVariation {
        cold_dry_fraction: 0.5,
        cold_viscous_fraction: 0.8,
        warm_up_s: 1.0,
        warmed_s: 0.2,
        ..FrictionVariation::none()
    };
    let mut plant = flywheel(0.5, friction, variation);
    for cycle in 1..=2000 {
        plant.cycle(&Vector::zeros());
        if cycle >= 100 {
            let cold = (-(0.2 + 1e-3 * f64::from(cycle))).exp();
            let expected = 2.0 * (1.0 + 0.5 * cold) + 1.5 * 0.5 * (1.0 + 0.8 * cold);
            let found = plant.truth().friction_torque_nm[0];
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
    }
}

#[test]
fn friction_varies_with_angle_and_direction() {
    let variation = FrictionVariation {
        angle_fraction: 0.1,
        periods_per_revolution: 4.0,
        phase_rad: Vector::from([0.7]),
        direction_fraction: Vector::from([-0.2]),
        ..FrictionVariation::none()
    };
    for speed in [0.5, -0.5] {
        let mut plant = flywheel(speed, dry(), variation.clone());
        for cycle in 1..=3000 {
            plant.cycle(&Vector::zeros());
            if cycle >= 100 {
                let q = plant.truth().position_rad[0];
                let over_angle = 1.0 + 0.1 * (4.0 * q + 0.7).sin();
                let expected = 2.0 * over_angle * (1.0 - 0.2 * speed.signum()) * speed.signum();
                let found = plant.truth().friction_torque_nm[0];
                // The bristle follows within its deflection of 0.5 mrad.
                assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
            }
        }
    }
}

#[test]
fn varying_friction_takes_energy_over_every_cycle_of_motion() {
    let variation = FrictionVariation {
        angle_fraction: 0.3,
        periods_per_revolution: 4.0,
        phase_rad: Vector::from([0.7]),
        direction_fraction: Vector::from([0.3]),
        cold_dry_fraction: 0.5,
        ..FrictionVariation::none()
    };
    let config = PlantConfig {
        friction: [dry()],
        friction_variation: variation,
        ..PlantConfig::ideal(wheel(0.0, 0.05))
    };
    let mut plant = plant_of(config, Vector::zeros());
    let (mut work_j, mut lowest_j, mut supplied_j) = (0.0, 0.0_f64, 0.0);
    for cycle in 0..4000 {
        let tau = 4.0 * (TAU * 1e-3 * f64::from(cycle)).sin();
        plant.cycle(&Vector::from([tau]));
        let truth = plant.truth();
        work_j += 1e-3 * truth.friction_torque_nm[0] * truth.velocity_rad_per_s[0];
        supplied_j += 1e-3 * tau * truth.velocity_rad_per_s[0];
        lowest_j = lowest_j.min(work_j);
    }
    // A bristle stores at most 0.5 g^2 / s0 = 0.5 (2 x 1.1 x 1.3 x 1.3 x 1.5)^2 / 4000 = 4 mJ.
    assert!(lowest_j > -4e-3, "{lowest_j}");
    assert!(
        work_j > 0.9 * supplied_j && work_j > 1.0,
        "{work_j} {supplied_j}"
    );
}

/// Friction torque of the two joints in steady motion, by options.
fn steady_friction(options: &PlantOptions, qd: Vector<2>) -> Vector<2> {
    let arm = {
        let one = wheel(0.0, 1e6);
        let bodies = [one.body(0), one.body(0)];
        let joints = bodies.map(|body| supple_core::Joint {
            parent_from_link: supple_core::Pose::IDENTITY,
            axis: supple_core::nalgebra::Vector3::z(),
            body,
            armature_kg_m2: 0.0,
        });
        Arm::new(&joints, supple_core::Pose::IDENTITY, None, one.gravity()).unwrap()
    };
    let joint = |viscous, coulomb| {
        LuGre::from_friction(&Friction::coulomb(viscous, coulomb)).without_load()
    };
    let config = PlantConfig {
        friction: [joint(2.364, 0.533), joint(0.811, 0.372)],
        actuators: ActuatorModel {
            joint_from_motor: differential(),
            ..ActuatorModel::direct()
        },
        ..PlantConfig::ideal(arm)
    };
    let mut plant = plant_of(options.apply(config).unwrap(), qd);
    for _ in 0..500 {
        plant.cycle(&Vector::zeros());
    }
    plant.truth().friction_torque_nm
}

#[test]
fn friction_at_a_differential_couples_its_joints_but_not_motion_of_one_alone() {
    let none = PlantOptions::default();
    let shared = PlantOptions {
        motor_friction_share: Some(0.8),
        ..none.clone()
    };
    for qd in [[0.5, 0.0], [0.0, -0.5]] {
        let (a, b) = (
            steady_friction(&none, qd.into()),
            steady_friction(&shared, qd.into()),
        );
        assert!((a - b).norm() < 2e-3 * a.norm(), "{a} {b}");
    }
    // Both joints turn such that the first motor is at rest: n2 q2 = n3 q3. Only the friction of the second motor acts.
    let (n2, n3) = (28.25, 28.25 / 1.68);
    let qd = Vector::from([0.3, 0.3 * n2 / n3]);
    // 0.8 of the friction that the weaker joint allows each motor: S3 / (2 n3) = 0.01106, and S2 / (2 n2) = 0.00943.
    let dry_at_motor = 0.8 * (0.533 / (2.0 * n2)).min(0.372 / (2.0 * n3));
    let viscous_at_motor = 0.8 * (2.364 / (2.0 * n2 * n2)).min(0.811 / (2.0 * n3 * n3));
    let left_dry = [
        0.533 - 2.0 * n2 * dry_at_motor,
        0.372 - 2.0 * n3 * dry_at_motor,
    ];
    let left_viscous = [
        2.364 - 2.0 * n2 * n2 * viscous_at_motor,
        0.811 - 2.0 * n3 * n3 * viscous_at_motor,
    ];
    let speed = -(n2 * qd[0] + n3 * qd[1]);
    let motor = -dry_at_motor + viscous_at_motor * speed;
    let expected = Vector::from([
        left_dry[0] + left_viscous[0] * qd[0] - n2 * motor,
        left_dry[1] + left_viscous[1] * qd[1] - n3 * motor,
    ]);
    let found = steady_friction(&shared, qd);
    assert!(
        (found - expected).norm() < 5e-3 * expected.norm(),
        "{found} {expected}"
    );
}

#[test]
fn jitter_moves_the_start_of_cycles_without_drift() {
    let config = PlantConfig {
        cycle_jitter: 0.2,
        seed: 3,
        ..PlantConfig::ideal(wheel(0.0, 1.0))
    };
    let mut plant = plant_of(config, Vector::from([0.7]));
    let (mut sum_s, mut largest_s) = (0.0, 0.0_f64);
    for cycle in 1..=5000 {
        let measured = plant.cycle(&Vector::zeros());
        let scheduled_s = 1e-3 * f64::from(cycle);
        assert!((measured.time_s - scheduled_s).abs() < 1e-9);
        let late_s = plant.truth().time_s - scheduled_s;
        // Without torque it turns at constant speed: the angle is the time.
        assert!((plant.truth().position_rad[0] - 0.7 * plant.truth().time_s).abs() < 1e-9);
        assert!(late_s.abs() <= 0.2e-3 + 1e-12, "{late_s}");
        sum_s += late_s;
        largest_s = largest_s.max(late_s.abs());
    }
    // A uniform distribution: its mean has a standard error of 0.2 / sqrt(3 n) ms.
    assert!((sum_s / 5000.0).abs() < 5.0 * 0.2e-3 / (3.0_f64 * 5000.0).sqrt());
    assert!(largest_s > 0.195e-3);
}

#[test]
fn the_base_tilts_by_the_angle_and_the_tool_adds_its_weight() {
    let options = PlantOptions {
        base_tilt_rad: Some(0.01),
        tool_extra_kg: Some(0.05),
        ..PlantOptions::default()
    };
    let before = wam4();
    let after = options.apply(PlantConfig::ideal(before)).unwrap().arm;
    let cosine = before.gravity().dot(&after.gravity()) / 9.81_f64.powi(2);
    assert!((after.gravity().norm() - 9.81).abs() < 1e-12);
    assert!((cosine.acos() - 0.01).abs() < 1e-9);
    assert!((after.body(3).mass_kg - before.body(3).mass_kg - 0.05).abs() < 1e-12);
    let q = Vector::from([0.0, 1.2, 0.0, 0.3]);
    let alone = PlantOptions {
        tool_extra_kg: Some(0.05),
        ..PlantOptions::default()
    };
    let loaded = alone.apply(PlantConfig::ideal(before)).unwrap().arm;
    let weight =
        supple_core::dynamics::gravity(&loaded, &q) - supple_core::dynamics::gravity(&before, &q);
    let jacobian = supple_core::dynamics::jacobian(&before, &q);
    let expected = jacobian.row(2).transpose() * (0.05 * 9.81);
    assert!((weight - expected).norm() < 1e-9, "{weight} {expected}");
}
