//! Plants of the built-in arms.

use supple_core::Vector;
use supple_core::dynamics::gravity;
use supple_model::{Description, ModelError, assets, with_dof};
use supple_plant::{Plant, PlantConfig};

/// Asserts that an arm with real actuators and friction stays at home under its gravity torque.
fn stays_at_home<const N: usize>(description: &Description) {
    let config = PlantConfig::<N>::from_description(description).unwrap();
    assert_eq!(config.actuators.torque_delay_cycles, 1);
    let arm = config.arm;
    let home = description.home::<N>().unwrap();
    let mut plant = Plant::new(config, home, Vector::zeros()).unwrap();
    for _ in 0..500 {
        let tau = gravity(&arm, &plant.measurement().position_rad);
        plant.cycle(&tau);
    }
    let moved = (plant.truth().position_rad - home).amax();
    assert!(moved < 1e-3, "{}: {moved}", description.name());
}

#[test]
fn the_built_in_arms_stay_at_home_under_their_gravity_torque() {
    for name in assets() {
        let description = Description::asset(name).unwrap();
        with_dof!(description.dof(), N => stays_at_home::<N>(&description)).unwrap();
    }
}

#[test]
fn the_wam_has_the_actuators_and_friction_of_its_description() {
    let description = Description::asset("wam4").unwrap();
    let config = PlantConfig::<4>::from_description(&description).unwrap();
    for (truth, described) in config.friction.iter().zip(description.friction()) {
        assert_eq!(truth.coulomb_nm, described.coulomb_nm);
        assert!(truth.breakaway_nm > truth.coulomb_nm);
    }
    let tool = description.tool().unwrap();
    assert_eq!(config.tip_radius_m, tool.cap_radius_m);
    // Shoulder pitch and roll share two motors.
    assert!(config.actuators.joint_from_motor[(1, 1)] != 0.0);
    assert!(config.actuators.joint_from_motor[(2, 1)] != 0.0);
    assert!(config.actuators.counts_per_motor_revolution[0] > 0.0);
    assert!(config.actuators.motor_torque_quantum_nm[0] > 0.0);
}

/// Every control rate is possible: the physics step is 0.2 ms, or the largest smaller step that divides the cycle.
#[test]
fn the_physics_step_divides_the_cycle() {
    let wam = Description::asset("wam4").unwrap();
    let usual = PlantConfig::<4>::from_description(&wam).unwrap();
    assert_eq!(usual.step_s, 2e-4);
    for rate_hz in [250.0, 400.0, 500.0, 700.0, 1000.0] {
        let arm = wam.clone().at_rate(rate_hz).unwrap();
        let config = PlantConfig::<4>::from_description(&arm).unwrap();
        assert!((1e-4..=2e-4).contains(&config.step_s), "{rate_hz}");
        let home = arm.home::<4>().unwrap();
        Plant::new(config, home, Vector::zeros()).unwrap();
    }
}

#[test]
fn a_wrong_number_of_joints_is_rejected() {
    let description = Description::asset("wam4").unwrap();
    let refused = PlantConfig::<3>::from_description(&description);
    assert!(matches!(refused, Err(ModelError::JointCount { .. })));
}
