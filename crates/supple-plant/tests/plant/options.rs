//! Options of the plant: files, ranges, seeds, determinism.

use crate::common::{wam4, wam4_at};
use std::path::Path;
use supple_core::{Friction, Vector};
use supple_model::{Description, UrdfName};
use supple_plant::options::{OPTIONS, REALISTIC};
use supple_plant::{ActuatorModel, LuGre, Plant, PlantConfig, PlantOptions};

fn config(seed: u64) -> PlantConfig<4> {
    PlantConfig {
        friction: [LuGre::from_friction(&Friction::coulomb(1.0, 0.5)); 4],
        actuators: ActuatorModel {
            counts_per_motor_revolution: Vector::repeat(4096.0),
            torque_delay_cycles: 1,
            ..ActuatorModel::direct()
        },
        seed,
        ..PlantConfig::ideal(wam4())
    }
}

/// Bits of the measurements over half a second of motion.
fn digest(options: &PlantOptions, seed: u64) -> Vec<u64> {
    let arm = wam4();
    let config = options.apply(config(seed)).unwrap();
    let mut plant = Plant::new(config, wam4_at(&arm, 0.6, 0.0), Vector::zeros()).unwrap();
    let mut bits = Vec::new();
    for cycle in 0..500 {
        let tau = Vector::from([0.5, -12.0, 0.1, -3.0]) * (1.0 + 0.001 * f64::from(cycle));
        let measured = plant.cycle(&tau);
        assert!(measured.position_rad.iter().all(|q| q.is_finite()));
        bits.extend(measured.position_rad.iter().map(|q| q.to_bits()));
    }
    bits
}

fn alone(name: &str, value: f64) -> PlantOptions {
    let mut options = PlantOptions::default();
    *options.value_mut(name).unwrap() = Some(value);
    if ["cable_damping_ratio", "backlash_rad"].contains(&name) {
        options.cable_stiffness_nm_per_rad = Some(3000.0);
    }
    if name == "small_joint_fraction" {
        options.ripple_nm = Some(0.1);
    }
    if ["warm_up_s", "warmed_s"].contains(&name) {
        options.warm_up_dry_fraction = Some(0.5);
    }
    options
}

#[test]
fn the_realistic_set_is_valid_and_has_all_effects_of_an_arm_with_cables() {
    let realistic = PlantOptions::realistic();
    assert_eq!(realistic, PlantOptions::from_toml(REALISTIC, "x").unwrap());
    let off: Vec<_> = realistic
        .values()
        .filter(|(_, value)| value.is_none_or(|x| x == 0.0))
        .map(|(option, _)| option.name)
        .collect();
    // Cables have no backlash and no gears, and the WAM's torques are calibrated; the others belong to an experiment.
    assert_eq!(
        off,
        [
            "backlash_rad",
            "dry_friction_change",
            "warmed_s",
            "gear_friction_fraction",
            "torque_shortfall_fraction",
            "torque_shortfall_spread"
        ]
    );
}

/// In the set of geared motors friction grows with load and differs by direction, and every motor gives less than the commanded
/// torque, by the fraction that users report.
#[test]
fn the_set_of_geared_motors_has_the_friction_and_torque_shortfall_that_users_report() {
    let name = std::path::Path::new("openarm-realistic");
    let arm = Description::asset("wam4").unwrap();
    let geared = PlantOptions::chosen(&arm, Some(name), false).unwrap();
    let config = geared.apply(config(3)).unwrap();
    for k in config.actuators.torque_constant.iter() {
        assert!((1.0 / 1.5..=1.0 / 1.29).contains(k), "{k}");
    }
    let all = config.actuators.torque_constant;
    assert!(all.max() - all.min() > 0.01, "{all}");
    assert_eq!(config.friction_variation.gear_fraction, 0.1);
    assert!(
        config
            .friction_variation
            .direction_fraction
            .iter()
            .all(|d| d.abs() == 0.1)
    );
}

/// The motors of an arm determine its set: the motors of a URDF are unknown, and its encoders measure at the joints.
#[test]
fn the_realistic_set_of_an_arm_depends_on_its_motors() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/wam4/arm.urdf");
    let urdf_alone = UrdfName::parse(&file.display().to_string()).unwrap();
    let urdf_alone = Description::from_urdf(&urdf_alone).unwrap();
    let name = PlantOptions::realistic_name_of;
    let asset = |name| Description::asset(name).unwrap();
    assert_eq!(name(&asset("wam4")), "realistic");
    assert_eq!(name(&asset("openarm")), "openarm-realistic");
    assert_eq!(name(&urdf_alone), "urdf-realistic");
    for arm in [asset("wam4"), asset("yam"), urdf_alone] {
        let set = PlantOptions::chosen(&arm, None, true).unwrap();
        assert_eq!(set, PlantOptions::realistic_of(&arm));
        let noise_rad = PlantOptions::default_encoder_noise_rad(&arm);
        assert_eq!(set.encoder_noise_rad, Some(noise_rad));
        // At the joint: less than a quarter of the count of any encoder of an arm that is controlled by torque.
        let ratio = arm.motors().motor_from_joint.iter();
        let ratio = ratio.fold(1.0_f64, |most, ratio| most.max(ratio.abs()));
        assert!(noise_rad / ratio <= 1e-4, "{noise_rad} {ratio}");
    }
}

/// Effects in N m that are small for a shoulder would be a large part of the torque of a wrist's motor.
#[test]
fn a_small_joint_has_small_effects() {
    let arm = Description::asset("wam7").unwrap();
    let config = PlantConfig::<7>::from_description(&arm).unwrap();
    let limits_nm = config.joint_torque_nm;
    let realistic = PlantOptions::realistic();
    let config = realistic.apply(config).unwrap();
    let mut ripple_nm = Vector::<7>::zeros();
    for line in &config.actuators.ripple {
        let ratio = config.actuators.joint_from_motor.column(line.motor).amax();
        ripple_nm[line.motor] += line.amplitude_nm / ratio;
    }
    let (hose, fraction) = (config.hose, realistic.small_joint_fraction.unwrap());
    for joint in 0..4 {
        assert!((ripple_nm[joint] - 0.1).abs() < 1e-12, "{ripple_nm}");
        assert_eq!(hose.preload_nm[joint].abs(), 0.05);
        assert_eq!(hose.stiffness_nm_per_rad[joint], 0.1);
    }
    for joint in 4..7 {
        let bound_nm = fraction * limits_nm[joint];
        assert!((ripple_nm[joint] - bound_nm).abs() < 1e-12, "{ripple_nm}");
        assert_eq!(hose.preload_nm[joint].abs(), bound_nm.min(0.05));
        assert_eq!(hose.stiffness_nm_per_rad[joint], bound_nm);
    }
}

/// Breakaway against gravity: the motor must give the gravity torque, dry friction, and a tenth of the transmitted torque.
#[test]
fn gears_under_load_have_more_friction() {
    let friction_nm = |gear_fraction: f64| {
        let mut config = config(0);
        config.friction = [LuGre::from_friction(&Friction::coulomb(0.0, 0.5)).without_load(); 4];
        config.friction_variation.gear_fraction = gear_fraction;
        config.stops = None;
        let arm = wam4();
        let mut plant = Plant::new(config, wam4_at(&arm, 0.6, 0.0), Vector::zeros()).unwrap();
        let mut max = Vector::<4>::zeros();
        // A torque that lifts the shoulder, far above breakaway.
        for _ in 0..400 {
            plant.cycle(&Vector::from([0.0, -45.0, 0.0, 0.0]));
            max = max.sup(&plant.truth().friction_torque_nm.abs());
        }
        max[1]
    };
    let (without, with) = (friction_nm(0.0), friction_nm(0.1));
    // Sliding at the torque of 45 N m: a tenth of it more, with the share of the Stribeck effect at most.
    assert!((4.4..=5.1).contains(&(with - without)), "{without} {with}");
}

#[test]
fn without_options_the_plant_is_unchanged_bit_for_bit() {
    let none = PlantOptions::default();
    assert!(none.is_none() && none.line().is_empty());
    let arm = wam4();
    let mut plain = Plant::new(config(0), wam4_at(&arm, 0.6, 0.0), Vector::zeros()).unwrap();
    let bits = digest(&none, 0);
    for (cycle, expected) in bits.chunks(4).enumerate() {
        let tau = Vector::from([0.5, -12.0, 0.1, -3.0]) * (1.0 + 0.001 * cycle as f64);
        let measured = plain.cycle(&tau).position_rad;
        let found: Vec<u64> = measured.iter().map(|q| q.to_bits()).collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn every_option_changes_the_motion_and_the_same_seed_gives_the_same_bits() {
    let plain = digest(&PlantOptions::default(), 0);
    let realistic = PlantOptions::realistic();
    for (option, value) in realistic.values() {
        let value = match option.name {
            "backlash_rad" => 0.005,
            "dry_friction_change" => 0.2,
            "warmed_s" => 100.0,
            "gear_friction_fraction" => 0.1,
            "torque_shortfall_fraction" => 0.28,
            "torque_shortfall_spread" => 0.05,
            // The default is 600 s, the size of the set.
            "warm_up_s" => 60.0,
            _ => value.unwrap(),
        };
        let options = alone(option.name, value);
        let (first, second) = (digest(&options, 0), digest(&options, 0));
        assert_eq!(first, second, "{}", option.name);
        assert_ne!(first, plain, "{}", option.name);
    }
    assert_eq!(digest(&realistic, 1), digest(&realistic, 1));
    assert_ne!(digest(&realistic, 1), digest(&realistic, 2));
    let fixed = PlantOptions {
        seed: Some(1),
        encoder_noise_rad: None,
        cycle_jitter_fraction: None,
        ..realistic
    };
    assert_eq!(digest(&fixed, 1), digest(&fixed, 2), "the file's seed wins");
}

#[test]
fn the_random_draws_of_an_effect_do_not_depend_on_other_effects() {
    let both = PlantOptions::realistic().apply(config(5)).unwrap();
    let bias = alone("encoder_bias_rad", 0.002).apply(config(5)).unwrap();
    let tilt = alone("base_tilt_rad", 0.0035).apply(config(5)).unwrap();
    assert_eq!(
        both.actuators.encoder_bias_rad,
        bias.actuators.encoder_bias_rad
    );
    assert_eq!(both.arm.gravity(), tilt.arm.gravity());
}

#[test]
fn errors_name_file_option_value_and_remedy() {
    for (text, expected) in [
        (
            "cable_stifness_nm_per_rad = 3.0",
            vec!["mine.toml", "cable_stifness", "plant list"],
        ),
        (
            "base_tilt_rad = \"a\"",
            vec!["mine.toml", "base_tilt_rad", "plant list"],
        ),
        (
            "base_tilt_rad = 3.5",
            vec![
                "mine.toml",
                "base_tilt_rad",
                "3.5",
                "from 0 to 0.5 rad",
                "leave it out",
            ],
        ),
        (
            "tool_extra_kg = nan",
            vec!["mine.toml", "tool_extra_kg", "NaN", "from 0 to 100 kg"],
        ),
        (
            "extra_delay_cycles = 1.5",
            vec!["mine.toml", "1.5", "a whole number from 0 to 50"],
        ),
        (
            "backlash_rad = 0.01",
            vec!["mine.toml", "cable_stiffness_nm_per_rad"],
        ),
        ("warmed_s = 10", vec!["mine.toml", "warm_up_dry_fraction"]),
    ] {
        let error = PlantOptions::from_toml(text, "mine.toml")
            .unwrap_err()
            .to_string();
        for part in expected {
            assert!(error.contains(part), "{text}: {error}");
        }
    }
    let missing = PlantOptions::from_file("/nowhere/mine.toml".as_ref()).unwrap_err();
    assert!(missing.to_string().contains("/nowhere/mine.toml"));
    assert_eq!(
        PlantOptions::from_toml("extra_delay_cycles = 2", "x")
            .unwrap()
            .extra_delay_cycles,
        Some(2.0)
    );
}

#[test]
fn every_option_has_a_description_and_a_source() {
    for option in OPTIONS {
        assert!(
            option.effect.len() > 20 && option.source.len() > 10,
            "{option:?}"
        );
        assert!(option.min < option.max, "{option:?}");
    }
    let options = alone("backlash_rad", 0.001);
    assert_eq!(
        options.line(),
        "cable_stiffness_nm_per_rad = 3000, backlash_rad = 0.001"
    );
}

#[test]
fn the_published_schema_equals_the_schema_of_the_options() {
    let published: serde_json::Value =
        serde_json::from_str(include_str!("../../../../assets/plants/plant.schema.json")).unwrap();
    let schema = serde_json::to_value(schemars::schema_for!(PlantOptions)).unwrap();
    assert_eq!(
        published, schema,
        "run `cargo run -p supple-plant --example plant_schema > assets/plants/plant.schema.json`"
    );
}
