//! The built-in arms are valid, can be controlled, match the reference kinematics, and their numbers match their
//! sources.

use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use supple_core::math::Vector3;
use supple_core::{Body, Controller, Vector, dynamics};
use supple_model::{Description, Parts, assets, schema_json, with_dof};

fn asset(name: &str) -> Description {
    Description::asset(name).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_asset_gives_a_valid_controller() {
    for name in assets() {
        let description = asset(name);
        assert_eq!(description.name(), *name);
        with_dof!(description.dof(), N => {
            let config = description.config::<N>().unwrap_or_else(|error| panic!("{error}"));
            Controller::new(config).unwrap_or_else(|error| panic!("{name}: {error}"));
        })
        .unwrap();
    }
}

/// The arm without tool and rotors, like the reference.
fn bare<const N: usize>(description: &Description) -> Parts<N> {
    let mut parts = description.parts::<N>().unwrap();
    parts.tool = None;
    for joint in &mut parts.joints {
        joint.armature_kg_m2 = 0.0;
    }
    parts
}

fn numbers(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(entries) => entries.iter().flat_map(numbers).collect(),
        None => vec![value.as_f64().expect("a number")],
    }
}

fn largest_difference<'a>(found: impl IntoIterator<Item = &'a f64>, expected: &Value) -> f64 {
    let expected = numbers(expected);
    let found: Vec<f64> = found.into_iter().copied().collect();
    assert_eq!(found.len(), expected.len());
    found
        .iter()
        .zip(&expected)
        .fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

fn agrees_with_the_reference<const N: usize>(name: &str) {
    let reference: Value = serde_json::from_str(include_str!("../data/reference.json")).unwrap();
    let samples = reference["arms"][name].as_array().expect("samples");
    assert!(!samples.is_empty());
    let arm = bare::<N>(&asset(name)).build().unwrap();
    for sample in samples {
        let q = Vector::<N>::from_column_slice(&numbers(&sample["q"]));
        let tip = dynamics::tip_pose(&arm, &q);
        assert!(largest_difference(&tip.translation, &sample["tip_pos"]) < 1e-12);
        // nalgebra iterates by columns, the reference is written by rows.
        assert!(largest_difference(&tip.rotation.transpose(), &sample["tip_rot"]) < 1e-12);
        assert!(largest_difference(&dynamics::gravity(&arm, &q), &sample["gravity"]) < 1e-10);
        assert!(largest_difference(&dynamics::crba(&arm, &q), &sample["M"]) < 1e-12);
    }
}

#[test]
fn arms_match_the_reference() {
    agrees_with_the_reference::<3>("wam3");
    agrees_with_the_reference::<4>("wam4");
    agrees_with_the_reference::<7>("wam7");
}

/// The same comparison for the arms whose reference is 40 states of all quantities; see `supple-core/tests/data`.
fn agrees_in_all_states<const N: usize>(name: &str, states: &str) {
    let reference: Value = serde_json::from_str(states).unwrap();
    let samples = &reference["samples"];
    let arm = bare::<N>(&asset(name)).build().unwrap();
    for k in 0..40 {
        let vector = |key: &str| Vector::<N>::from_column_slice(&numbers(&samples[key][k]));
        let (q, qd, qdd) = (vector("q"), vector("qd"), vector("qdd"));
        let tip = dynamics::tip_pose(&arm, &q);
        assert!(largest_difference(&tip.translation, &samples["tip_pos"][k]) < 1e-12);
        assert!(largest_difference(&tip.rotation.transpose(), &samples["tip_rot"][k]) < 1e-12);
        assert!(largest_difference(&dynamics::gravity(&arm, &q), &samples["gravity"][k]) < 1e-10);
        assert!(largest_difference(&dynamics::crba(&arm, &q), &samples["M"][k]) < 1e-12);
        let found = dynamics::rnea(&arm, &q, &qd, &qdd);
        assert!(largest_difference(&found, &samples["rnea"][k]) < 1e-9);
    }
}

#[test]
fn openarm_and_yam_match_their_reference() {
    let openarm = include_str!("../../../supple-core/tests/data/openarm.json");
    agrees_in_all_states::<7>("openarm", openarm);
    let yam = include_str!("../../../supple-core/tests/data/yam.json");
    agrees_in_all_states::<6>("yam", yam);
}

/// The chosen limits are below those of the manufacturers, and each joint limit is below the peak torque of the motor.
#[test]
fn limits_of_openarm_and_yam_are_below_the_manufacturers_limits() {
    for name in ["openarm", "yam"] {
        let description = asset(name);
        let robot = urdf_rs::read_from_string(description.urdf()).unwrap();
        let stow = description.stow_rad().expect("a pose without torque");
        with_dof!(description.dof(), N => {
            let limits = description.config::<N>().unwrap().limits;
            let arm = bare::<N>(&description).build().unwrap();
            for (i, joint) in description.joint_names().iter().enumerate() {
                let limit = &robot.joints.iter().find(|j| j.name == *joint).unwrap().limit;
                assert!(limits.joint_torque_nm[i] < 0.8 * limit.effort, "{joint}");
                assert!(limits.joint_speed_rad_per_s[i] < 0.4 * limit.velocity, "{joint}");
                assert!(limits.position_upper_rad[i] <= limit.upper - 0.029, "{joint}");
                // If the arm rests on a stop, the angle is the edge of the soft zone.
                let rests = stow[i] - limits.position_lower_rad[i] < limits.soft_zone_rad + 1e-6
                    && stow[i] <= limits.position_lower_rad[i] + limits.soft_zone_rad + 1e-6;
                let margin = if rests { 0.0 } else { 0.029 };
                assert!(limits.position_lower_rad[i] >= limit.lower + margin, "{joint}");
            }
            // Gravity stays below the limits in the whole range.
            for k in 0..2000u32 {
                let q = Vector::<N>::from_fn(|i, _| {
                    let fraction = (f64::from(k) * (0.37 + 0.11 * i as f64)).fract();
                    let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
                    lower + fraction * (upper - lower)
                });
                let gravity = dynamics::gravity(&arm, &q);
                for i in 0..N {
                    assert!(gravity[i].abs() < 0.8 * limits.joint_torque_nm[i], "{name} {i}");
                }
            }
        })
        .unwrap();
    }
}

/// In the stow pose gravity is below the dry friction, or pushes the joint onto the stop that it rests on.
#[test]
fn openarm_and_yam_stay_in_their_stow_pose_without_torque() {
    for name in ["openarm", "yam"] {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            let limits = description.config::<N>().unwrap().limits;
            let arm = bare::<N>(&description).build().unwrap();
            let stow = Vector::<N>::from_column_slice(description.stow_rad().unwrap());
            let gravity = dynamics::gravity(&arm, &stow);
            for i in 0..N {
                let on_stop = stow[i] - limits.position_lower_rad[i] <= limits.soft_zone_rad + 1e-9;
                let dry_nm = description.friction()[i].coulomb_nm;
                assert!(gravity[i].abs() < dry_nm || (on_stop && gravity[i] > 0.0), "{name} {i}: {}", gravity[i]);
            }
        })
        .unwrap();
    }
}

/// The resolution of torque and position in the bus frames agrees with the motors section.
#[test]
fn the_resolution_on_the_bus_equals_the_resolution_of_the_motors() {
    for name in ["openarm", "yam"] {
        let description = asset(name);
        let bus = description.bus().expect("a bus");
        let motors = description.motors();
        let quanta = motors.torque_quantum_nm.as_ref().unwrap();
        for (i, motor) in bus.motors.iter().enumerate() {
            let step_nm = 2.0 * motor.torque_range_nm / 4095.0;
            assert!(
                (quanta[i] / step_nm - 1.0).abs() < 1e-3,
                "{name} {i}: {step_nm}"
            );
            let counts = core::f64::consts::TAU / (2.0 * motor.position_range_rad) * 65535.0;
            assert!((f64::from(motors.counts_per_revolution.unwrap()) - counts).abs() < 1.0);
            assert_eq!((motor.id, motor.reply_id), (i as u16 + 1, i as u16 + 0x11));
        }
    }
    assert_eq!(asset("wam7").bus(), None);
}

/// `j2mp` as printed for the 7-joint arm: ratios 42, 28.25, 28.25 / 1.68, 18, 9.7, 9.7, 14.93.
fn motor_from_joint() -> DMatrix<f64> {
    let mut j2mp = DMatrix::zeros(7, 7);
    let roll = 28.25 / 1.68;
    for (row, column, ratio) in [
        (0, 0, -42.0),
        (1, 1, 28.25),
        (1, 2, -roll),
        (2, 1, -28.25),
        (2, 2, -roll),
        (3, 3, -18.0),
        (4, 4, 9.7),
        (4, 5, -9.7),
        (5, 4, 9.7),
        (5, 5, 9.7),
        (6, 6, -14.93),
    ] {
        j2mp[(row, column)] = ratio;
    }
    j2mp
}

#[test]
fn transmissions_are_the_inverse_of_the_published_ones() {
    let printed = motor_from_joint();
    for name in ["wam4", "wam7"] {
        let description = asset(name);
        let (motors, n) = (description.motors(), description.dof());
        let product = &motors.joint_from_motor * printed.view((0, 0), (n, n));
        assert!((product - DMatrix::identity(n, n)).amax() < 1e-12, "{name}");
        let inverse = &motors.motor_from_joint - printed.view((0, 0), (n, n));
        assert!(inverse.amax() < 1e-12, "{name}");
    }
}

#[test]
fn rotor_inertias_match_the_motors_through_the_transmission() {
    let drive = [
        1.1631e-4, 1.1831e-4, 1.1831e-4, 1.0686e-4, 1.685e-5, 1.745e-5, 1.42e-6,
    ];
    let j2mp = motor_from_joint();
    let rotors = DMatrix::from_diagonal(&DVector::from_row_slice(&drive));
    let reflected = j2mp.transpose() * rotors * &j2mp;
    for name in ["wam4", "wam7"] {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            for (i, joint) in description.parts::<N>().unwrap().joints.iter().enumerate() {
                let (found, expected) = (joint.armature_kg_m2, reflected[(i, i)]);
                assert!((found / expected - 1.0).abs() < 1e-3, "{name} {i}: {found} {expected}");
            }
        })
        .unwrap();
    }
}

#[test]
fn joint_torque_limits_match_the_motors() {
    for name in assets() {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            let limits = description.config::<N>().unwrap().limits;
            let ratios = description.motors().motor_from_joint.transpose().abs();
            let max_torque_nm = ratios * DVector::from_column_slice(limits.motor_torque_nm.as_slice());
            for i in 0..N {
                let fraction = limits.joint_torque_nm[i] / max_torque_nm[i];
                assert!((0.99..1.01).contains(&fraction), "{name} joint {i}: {fraction}");
            }
        })
        .unwrap();
    }
}

#[test]
fn the_tool_is_a_disc_and_a_cylinder() {
    let cylinder = |mass_kg: f64, radius_m: f64, length_m: f64, middle_m: f64| {
        let across = mass_kg * (3.0 * radius_m * radius_m + length_m * length_m) / 12.0;
        let along = 0.5 * mass_kg * radius_m * radius_m;
        Body {
            mass_kg,
            com_m: Vector3::new(0.0, 0.0, middle_m),
            inertia_kg_m2: nalgebra::Matrix3::from_diagonal(&Vector3::new(across, across, along)),
        }
    };
    let sensor = cylinder(0.136, 0.045, 0.012, -0.026);
    let cap = cylinder(0.214, 0.02, 0.1 / 3.0, 0.04 / 3.0 / 2.0 - 0.01);
    let expected = sensor.merged(&cap);
    for name in ["wam3", "wam4", "wam7"] {
        let tool = asset(name).tool().expect("a tool");
        let body = tool.body.expect("with mass");
        assert!((body.mass_kg - 0.35).abs() < 1e-12);
        assert!((body.com_m - expected.com_m).amax() < 1e-8);
        assert!((body.inertia_kg_m2 - expected.inertia_kg_m2).amax() < 1e-9);
        assert_eq!(tool.cap_radius_m, 0.02);
    }
    assert_eq!(asset("paper3").tool().expect("a cap").body, None);
}

#[test]
fn the_tip_axis_points_along_the_forearm() {
    for name in ["wam3", "wam4", "wam7", "paper3"] {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            let mut q = Vector::<N>::zeros();
            if name == "paper3" {
                q[1] = core::f64::consts::FRAC_PI_2;
            }
            let tip = dynamics::tip_pose(&description.arm::<N>().unwrap(), &q);
            // At these angles every arm points straight up.
            assert!((tip.rotation.column(2) - Vector3::z()).amax() < 1e-12, "{name}");
            assert!((tip.translation.z - 0.9).abs() < 0.02, "{name}");
        })
        .unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn home_poses_are_outside_the_soft_zones() {
    for name in assets() {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            let (home, limits) = (description.home::<N>().unwrap(), description.config::<N>().unwrap().limits);
            for i in 0..N {
                assert!(home[i] > limits.position_lower_rad[i] + limits.soft_zone_rad, "{name} {i}");
                assert!(home[i] < limits.position_upper_rad[i] - limits.soft_zone_rad, "{name} {i}");
            }
        })
        .unwrap();
    }
}

#[test]
fn the_law_controls_three_joints_of_every_asset() {
    for (name, expected) in [
        ("openarm", vec![0, 1, 3]),
        ("yam", vec![0, 1, 2]),
        ("paper3", vec![0, 1, 2]),
        ("wam3", vec![0, 1, 2]),
        ("wam4", vec![0, 1, 3]),
        ("wam7", vec![0, 1, 3]),
    ] {
        let description = asset(name);
        with_dof!(description.dof(), N => {
            let roles = description.config::<N>().unwrap().roles;
            let active: Vec<usize> =
                (0..N).filter(|i| roles[*i] == supple_core::config::Role::Active).collect();
            assert_eq!(active, expected, "{name}");
        })
        .unwrap();
    }
}

/// Every number of an asset has a stated source: a comment on its line or above its block of lines, or a `source`
/// in its section or above all sections.
#[test]
fn every_number_has_a_stated_source() {
    for name in assets() {
        let description = asset(name);
        let settings = description.settings();
        assert!(settings.source.is_some(), "{name}");
        assert!(settings.law.source.is_some(), "{name} [law]");
        assert!(settings.latch.source.is_some(), "{name} [latch]");
        assert!(settings.limits.source.is_some(), "{name} [limits]");
        assert!(
            settings.motors.as_ref().is_some_and(|m| m.source.is_some()),
            "{name} [motors]"
        );
        assert!(
            settings.tool.as_ref().is_some_and(|t| t.source.is_some()),
            "{name} [tool]"
        );
        let mut commented = false;
        let joints = description
            .toml()
            .split("[motors]")
            .next()
            .unwrap_or_default();
        for line in joints.lines() {
            let number = line.contains("= ") && line.chars().any(|c| c.is_ascii_digit());
            commented = line.starts_with('#') || (commented && number);
            let held_by_name = line.starts_with("name") || line.starts_with("gravity");
            assert!(
                !number || held_by_name || commented || line.contains('#'),
                "{name}: {line}"
            );
        }
    }
}

#[test]
fn the_published_schema_matches_the_code() {
    let published: Value =
        serde_json::from_str(include_str!("../../../../assets/arm.schema.json")).unwrap();
    let of_the_code: Value = serde_json::from_str(&schema_json()).unwrap();
    assert!(
        published == of_the_code,
        "run `cargo run -p supple-model --example schema > assets/arm.schema.json`"
    );
}

#[test]
fn the_published_schema_rejects_unknown_keys_everywhere() {
    let schema: Value = serde_json::from_str(&schema_json()).unwrap();
    let definitions = schema["$defs"].as_object().expect("definitions");
    let sections = definitions
        .iter()
        .filter(|(_, section)| section["type"] == "object");
    let mut count = 0;
    for (name, section) in sections.chain([(&"root".to_owned(), &schema)]) {
        assert_eq!(section["additionalProperties"], false, "{name}");
        count += 1;
    }
    assert!(count > 7, "{count} sections");
}

#[test]
fn texts_are_kept_unchanged() {
    for name in assets() {
        let description = asset(name);
        let again = Description::from_text(description.toml(), description.urdf()).unwrap();
        with_dof!(description.dof(), N => {
            assert_eq!(again.parts::<N>().unwrap(), description.parts::<N>().unwrap());
        })
        .unwrap();
    }
}
