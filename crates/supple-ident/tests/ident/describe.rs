//! A fit as a description: the saved model equals the fit.

use crate::support::motion;
use supple_core::dynamics::rnea;
use supple_core::{Friction, Vector};
use supple_ident::{FrictionColumns, Options, fit};
use supple_model::Description;
use supple_random::Random;

fn friction() -> [Friction; 4] {
    std::array::from_fn(|j| Friction::coulomb(1.0 + j as f64, 0.5))
}

fn state(noise: &mut Random) -> [Vector<4>; 3] {
    std::array::from_fn(|_| Vector::from_fn(|_, _| 1.5 * noise.signed()))
}

fn options() -> Options {
    Options {
        friction: FrictionColumns::COULOMB,
        consistent_prior_weight: Some(1e-3),
        ..Options::default()
    }
}

#[test]
fn a_saved_fit_is_loaded_as_the_same_arm() {
    let description = Description::asset("wam4").unwrap();
    let arm = description.arm::<4>().unwrap();
    let data = motion(&arm, &friction(), &[0, 1, 3], 900, 8);
    let found = fit(&arm, &[data], &[0, 1, 3], &options()).unwrap();
    let folder = std::env::temp_dir().join(format!("supple-describe-{}", std::process::id()));
    found.save(&description, &folder).unwrap();
    let loaded = Description::load(&folder).unwrap();
    let config = loaded.config::<4>().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let expected = found.arm().unwrap();
    let mut noise = Random::new(5);
    for _ in 0..20 {
        let [q, qd, qdd] = state(&mut noise);
        let difference = rnea(&config.arm, &q, &qd, &qdd) - rnea(&expected, &q, &qd, &qdd);
        assert!(difference.amax() < 1e-9, "{difference}");
    }
    for j in [0, 1, 3] {
        assert_eq!(config.friction[j], found.friction()[j]);
    }
    // The joint that did not move keeps its known parameters.
    assert_eq!(config.friction[2], description.friction()[2]);
    assert_eq!(loaded.settings().joints.len(), 4);
    // Comments and limits are unchanged.
    assert!(loaded.toml().contains("# 42 x 1.8"));
    assert_eq!(loaded.settings().limits, description.settings().limits);
}

#[test]
fn a_collision_threshold_is_three_residuals_two_breakaway_torques_and_a_share_of_the_limit() {
    let description = Description::asset("wam4").unwrap();
    let arm = description.arm::<4>().unwrap();
    let joints = [0, 1, 3];
    let found = fit(
        &arm,
        &[motion(&arm, &friction(), &joints, 900, 10)],
        &joints,
        &options(),
    )
    .unwrap();
    let free = motion(&arm, &friction(), &joints, 300, 11);
    let mut pushed = free.clone();
    pushed.tau[(150, 1)] += 2.0;
    let logs = [free, pushed].map(|motion| found.validate_motion(&motion).unwrap());
    let mut config = description.config::<4>().unwrap();
    let mut thresholds_nm = |present_nm| {
        config.collision.move_joint_torque_nm = Vector::repeat(present_nm);
        found.move_collision_nm(&logs, &config)
    };
    // Every joint breaks away at 0.5 N m.
    let limits_nm = description.config::<4>().unwrap().limits.joint_torque_nm;
    let expected_nm =
        |residual_nm: f64, joint: usize| 3.0 * residual_nm + 1.0 + 0.005 * limits_nm[joint];
    let expected_nm = [
        Some(expected_nm(0.0, 0)),
        Some(expected_nm(2.0, 1)),
        None,
        Some(expected_nm(0.0, 3)),
    ];
    for (found_nm, expected_nm) in thresholds_nm(100.0).iter().zip(expected_nm) {
        match (found_nm, expected_nm) {
            (Some(found_nm), Some(nm)) => assert!((found_nm - nm).abs() < 0.1, "{found_nm} {nm}"),
            (found_nm, expected_nm) => assert_eq!(*found_nm, expected_nm),
        }
    }
    // A threshold that is smaller than the computed one is unchanged.
    assert_eq!(thresholds_nm(0.8), [Some(0.8), Some(0.8), None, Some(0.8)]);
}

#[test]
fn a_prediction_is_the_torque_of_the_identified_arm_and_its_friction() {
    let description = Description::asset("wam4").unwrap();
    let arm = description.arm::<4>().unwrap();
    let joints = [0, 1, 2, 3];
    let data = motion(&arm, &friction(), &joints, 900, 9);
    let found = fit(&arm, &[data], &joints, &options()).unwrap();
    let (model, joint_friction) = (found.arm().unwrap(), found.friction());
    let mut noise = Random::new(6);
    for _ in 0..20 {
        let [q, qd, qdd] = state(&mut noise);
        let mut expected = rnea(&model, &q, &qd, &qdd);
        (0..4).for_each(|j| expected[j] += joint_friction[j].torque_nm(qd[j]));
        assert!((found.predict(&q, &qd, &qdd) - expected).amax() < 1e-8);
    }
}

#[test]
fn missing_motor_and_joint_entries_are_added() {
    let urdf = Description::asset("wam3").unwrap().urdf().to_owned();
    let description = Description::from_text(
        "name = \"a\"\nurdf = \"b.urdf\"\ntip_frame = \"tip\"\n",
        &urdf,
    )
    .unwrap();
    let arm = description.arm::<3>().unwrap();
    let data = motion(&arm, &[Friction::coulomb(1.0, 0.5); 3], &[0, 1, 2], 900, 9);
    let found = fit(&arm, &[data], &[0, 1, 2], &options()).unwrap();
    let described = found.description(&description, None).unwrap();
    assert_eq!(described.friction(), &found.friction()[..]);
    let armature = described.arm::<3>().unwrap().armature();
    assert!((armature - found.arm().unwrap().armature()).amax() == 0.0);
    assert!(found.training_relative < 0.02);
}
