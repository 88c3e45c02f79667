//! Random arms are identified from their motion and torques.

use crate::property::config;
use crate::support::{motion, motion_of_size, random_arm};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use supple_core::dynamics::{parameters, rnea};
use supple_core::friction::LoadTorque;
use supple_core::{Arm, Friction, Vector};
use supple_ident::{Columns, DMatrix, FrictionColumns, Options, Weights, fit};
use supple_random::Random;

fn friction<const N: usize>() -> [Friction; N] {
    std::array::from_fn(|j| Friction {
        offset_nm: 0.1 * j as f64,
        ..Friction::coulomb(1.0 + 0.2 * j as f64, 0.8)
    })
}

/// Maximum difference of the joint torques of two arms at random states, without friction.
fn max_torque_difference<const N: usize>(a: &Arm<N>, b: &Arm<N>, moving: &[usize]) -> f64 {
    let mut noise = Random::new(99);
    let mut worst: f64 = 0.0;
    for _ in 0..50 {
        let q = Vector::<N>::from_fn(|j, _| {
            if moving.contains(&j) {
                3.0 * noise.signed()
            } else {
                0.3 + j as f64
            }
        });
        let mut rate = || {
            Vector::<N>::from_fn(|j, _| {
                if moving.contains(&j) {
                    2.0 * noise.signed()
                } else {
                    0.0
                }
            })
        };
        let (qd, qdd) = (rate(), rate());
        let difference = rnea(a, &q, &qd, &qdd) - rnea(b, &q, &qd, &qdd);
        worst = moving
            .iter()
            .fold(worst, |w, j| w.max(difference[*j].abs()));
    }
    worst
}

/// Fits `random_arm(seed)` from a model with other masses, without noise.
fn check_recovery(seed: u64) -> Result<(), TestCaseError> {
    let (truth, model) = (random_arm::<4>(seed), random_arm::<4>(seed));
    // Same kinematics, other masses: the model is the truth with 1.3 times its inertia.
    let mut links = *model.links();
    for link in &mut links {
        link.mass *= 1.3;
        link.first_moment *= 1.3;
        link.inertia *= 1.3;
    }
    let model = Arm::from_links(
        links,
        model.armature(),
        model.joint_from_tip(),
        model.gravity(),
    )
    .unwrap();
    let joints = [0, 1, 2, 3];
    let data = [
        motion(&truth, &friction(), &joints, 600, seed),
        motion(&truth, &friction(), &joints, 400, seed + 1),
    ];
    for weights in [Weights::Equal, Weights::ByJointResidual, Weights::Huber] {
        let options = Options {
            weights,
            consistent_prior_weight: None,
            ..Options::default()
        };
        let fit = fit(&model, &data, &joints, &options).unwrap();
        let held_out = motion(&truth, &friction(), &joints, 300, seed + 7);
        let checked = fit.validate_motion(&held_out).unwrap();
        prop_assert!(checked.total_relative < 1e-11, "{}", checked.total_relative);
        for (found, expected) in fit.friction().iter().zip(friction::<4>()) {
            prop_assert!((found.coulomb_nm - expected.coulomb_nm).abs() < 1e-9);
            prop_assert!((found.viscous_nm_s_per_rad - expected.viscous_nm_s_per_rad).abs() < 1e-9);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(config(12, 20_260_501))]

    #[test]
    fn noise_free_data_recover_every_torque_of_the_arm(seed in 1_u64..1000) {
        check_recovery(seed)?;
    }

    #[test]
    fn consistent_fits_are_valid_arms_for_any_noise(seed in 1_u64..1000) {
        let truth = random_arm::<4>(seed);
        let joints = [0, 1, 2, 3];
        let (samples, amplitude_nm) = (300, 5.0);
        let exact = motion(&truth, &friction(), &joints, samples, seed);
        let mut data = exact.clone();
        let mut noise = Random::new(seed);
        data.tau.iter_mut().for_each(|t| *t += amplitude_nm * noise.signed());
        // Some of these arms move very little, so no sample may be excluded.
        let options = Options { slow_rad_per_s: 0.0, ..Options::default() };
        let fit = fit(&truth, &[data], &joints, &options).unwrap();
        prop_assert!(fit.arm().is_ok());
        prop_assert!(fit.friction().iter().all(|f| f.validate().is_ok()));
        let checked = fit.validate_motion(&motion(&truth, &friction(), &joints, 200, seed + 3)).unwrap();
        prop_assert_eq!(checked.positive_definite, 1.0);
        // With p parameters, n samples and noise of standard deviation `sigma`, the torques that a least-squares
        // fit predicts for the same motion have an expected RMS error of `sigma sqrt(p / n)`. A margin of 50 %
        // covers its scatter.
        let sigma_nm = amplitude_nm / 3.0_f64.sqrt();
        let expected_nm = sigma_nm * (fit.rank() as f64 / samples as f64).sqrt();
        let same_motion = fit.validate_motion(&exact).unwrap();
        let found_nm = same_motion.rms_nm.iter().map(|rms| rms * rms).sum::<f64>().sqrt();
        prop_assert!(found_nm < 1.5 * expected_nm, "{found_nm} N m, {expected_nm} N m expected");
    }
}

/// Regressors whose singular values an inexact solver computed with errors in the third digit.
#[test]
fn ill_conditioned_regressors_recover_the_arm() {
    for seed in [634, 658] {
        check_recovery(seed).unwrap();
    }
}

#[test]
fn consistent_fits_of_exact_data_recover_the_arm() {
    let truth = random_arm::<4>(11);
    let joints = [0, 1, 2, 3];
    let data = motion(&truth, &friction(), &joints, 1500, 3);
    let options = Options {
        consistent_prior_weight: Some(1e-6),
        ..Options::default()
    };
    let fit = fit(&truth, &[data], &joints, &options).unwrap();
    assert!(max_torque_difference(&truth, &fit.arm().unwrap(), &joints) < 1e-3);
    assert!(fit.optimality_gap.unwrap() > 0.0);
}

#[test]
fn a_joint_without_fast_samples_is_rejected() {
    let truth = random_arm::<4>(13);
    let joints = [0, 1, 2, 3];
    let data = motion(&truth, &friction(), &joints, 400, 3);
    let options = Options {
        slow_rad_per_s: 50.0,
        ..Options::default()
    };
    let error = fit(&truth, &[data], &joints, &options).unwrap_err();
    assert!(error.to_string().contains("q[0]"), "{error}");
}

#[test]
fn joints_that_do_not_move_need_no_torques_and_keep_their_parameters() {
    let truth = random_arm::<4>(21);
    let moving = [1, 3];
    let mut data = motion(&truth, &friction(), &moving, 800, 5);
    data.tau.column_mut(0).fill(f64::NAN);
    let options = Options {
        consistent_prior_weight: Some(1e-2),
        ..Options::default()
    };
    let fit = fit(&truth, &[data], &moving, &options).unwrap();
    let arm = fit.arm().unwrap();
    assert!(max_torque_difference(&truth, &arm, &moving) < 1e-3);
    // The first link was not moved: its parameters are those of the nominal model.
    let (before, after) = (parameters(&truth)[0], parameters(&arm)[0]);
    assert!((before - after).amax() < 1e-4);
    assert_eq!(fit.friction()[0].coulomb_nm, 0.0);
}

#[test]
fn the_stribeck_effect_is_fitted_in_the_second_stage_without_bias_of_the_first() {
    let truth = random_arm::<3>(31);
    let stribeck: [Friction; 3] = std::array::from_fn(|_| Friction {
        breakaway_nm: 1.4,
        stribeck_rad_per_s: 0.05,
        ..Friction::coulomb(1.0, 1.0)
    });
    let data = motion(&truth, &stribeck, &[0, 1, 2], 3000, 4);
    let options = Options {
        friction: FrictionColumns {
            stribeck_rad_per_s: Some(0.05),
            ..FrictionColumns::COULOMB
        },
        consistent_prior_weight: Some(1e-6),
        slow_rad_per_s: 0.3,
        ..Options::default()
    };
    let fit = fit(&truth, &[data], &[0, 1, 2], &options).unwrap();
    for found in fit.friction() {
        assert!(
            (found.coulomb_nm - 1.0).abs() < 1e-4,
            "{}",
            found.coulomb_nm
        );
        assert!(
            (found.breakaway_nm - 1.4).abs() < 1e-3,
            "{}",
            found.breakaway_nm
        );
    }
}

/// Breakaway torque that differs by direction, where sliding friction does not, is found in slow motion; the columns of steady sliding
/// are not biased by it.
#[test]
fn breakaway_torque_that_differs_by_direction_is_found() {
    let truth = random_arm::<3>(31);
    let law: [Friction; 3] = std::array::from_fn(|joint| Friction {
        breakaway_nm: 1.2,
        stribeck_offset_nm: [0.1, -0.05, 0.0][joint],
        ..Friction::coulomb(1.0, 1.0)
    });
    let data = motion(&truth, &law, &[0, 1, 2], 3000, 4);
    let options = Options {
        friction: FrictionColumns {
            stribeck_rad_per_s: Some(0.05),
            asymmetry: true,
            ..FrictionColumns::COULOMB_AND_OFFSET
        },
        consistent_prior_weight: Some(1e-6),
        slow_rad_per_s: 0.3,
        ..Options::default()
    };
    let fit = fit(&truth, &[data], &[0, 1, 2], &options).unwrap();
    for (found, expected) in fit.friction().iter().zip(law) {
        for (found, expected) in [
            (found.stribeck_offset_nm, expected.stribeck_offset_nm),
            (found.breakaway_nm, expected.breakaway_nm),
            (found.coulomb_nm, expected.coulomb_nm),
            (found.offset_nm, 0.0),
        ] {
            assert!((found - expected).abs() < 2e-3, "{found}, {expected}");
        }
    }
}

/// An error at speeds at which little of the Stribeck effect is left is not extrapolated to rest.
#[test]
fn a_stribeck_effect_that_the_motion_does_not_show_is_not_found() {
    let truth = random_arm::<3>(31);
    let friction = [Friction::coulomb(1.0, 1.0); 3];
    let mut data = motion(&truth, &friction, &[0, 1, 2], 3000, 4);
    for (tau, qd) in data.tau.iter_mut().zip(data.qd.iter()) {
        if (0.03..0.06).contains(&qd.abs()) {
            *tau += 0.1 * qd.signum();
        }
    }
    for asymmetry in [false, true] {
        // Outside a band of 1.25 times the Stribeck speed at most 21 % of the effect is left.
        let options = Options {
            friction: FrictionColumns {
                stribeck_rad_per_s: Some(0.02),
                band_rad_per_s: 0.025,
                asymmetry,
                ..FrictionColumns::COULOMB_AND_OFFSET
            },
            consistent_prior_weight: Some(1e-6),
            slow_rad_per_s: 0.3,
            ..Options::default()
        };
        let found = fit(&truth, &[data.clone()], &[0, 1, 2], &options).unwrap();
        for friction in found.friction() {
            assert_eq!(friction.breakaway_nm, friction.coulomb_nm);
        }
        let narrow = Options {
            friction: FrictionColumns {
                band_rad_per_s: 0.01,
                ..options.friction
            },
            ..options
        };
        let found = fit(&truth, &[data.clone()], &[0, 1, 2], &narrow).unwrap();
        for friction in found.friction() {
            assert!(friction.breakaway_nm <= 2.0 * friction.coulomb_nm);
        }
    }
}

/// Offsets up to a tenth of the Coulomb friction are found without a bias, greater ones where the motion shows them. In a motion of some
/// degrees gravity and an offset nearly cancel: there the offset stays in proportion to the Coulomb friction.
#[test]
fn an_offset_is_not_made_up() {
    let truth = random_arm::<3>(31);
    let fitted = |size: f64, offset_nm: f64, noise_nm: f64, prior: Option<f64>, seed: u64| {
        let friction = [Friction {
            offset_nm,
            ..Friction::coulomb(1.0, 1.0)
        }; 3];
        let mut data = motion_of_size(size, &truth, &friction, &[0, 1, 2], 3000, seed);
        let mut noise = Random::new(seed);
        data.tau
            .iter_mut()
            .for_each(|tau| *tau += noise_nm * noise.signed());
        let options = Options {
            consistent_prior_weight: prior,
            slow_rad_per_s: 0.02,
            ..Options::default()
        };
        let found = fit(&truth, &[data], &[0, 1, 2], &options).unwrap();
        found
            .friction()
            .iter()
            .map(|friction| friction.offset_nm)
            .collect::<Vec<_>>()
    };
    for offset_nm in [-0.09, 0.0, 0.05] {
        for found in fitted(1.0, offset_nm, 0.0, Some(1e-6), 4) {
            assert!((found - offset_nm).abs() < 1e-4, "{found} of {offset_nm}");
        }
    }
    for found in fitted(1.0, 0.5, 0.0, Some(1e-6), 4) {
        assert!((found - 0.5).abs() < 0.01, "{found} of 0.5");
    }
    let largest = |prior: Option<f64>| {
        (1..10)
            .flat_map(|seed| fitted(0.1, 0.0, 0.5, prior, seed))
            .fold(0.0_f64, |largest, found| largest.max(found.abs()))
    };
    let (free, with_cost) = (largest(None), largest(Some(1e-2)));
    assert!(free > 0.5, "{free}");
    assert!(with_cost < 0.2, "{with_cost}");
}

#[test]
fn a_motor_coupled_to_two_joints_is_identified() {
    let truth = random_arm::<3>(41);
    let of_joints = [Friction::coulomb(0.5, 0.2); 3];
    let mut data = motion(&truth, &of_joints, &[0, 1, 2], 1500, 6);
    let of_coupled_motor = Friction::coulomb(0.7, 0.4);
    for i in 0..1500 {
        let coupled_nm = 0.3 * (data.qdd[(i, 1)] + data.qdd[(i, 2)])
            + of_coupled_motor.torque_nm(data.qd[(i, 1)] + data.qd[(i, 2)]);
        data.tau[(i, 1)] += coupled_nm;
        data.tau[(i, 2)] += coupled_nm;
    }
    let options = Options {
        couplings: vec![(1, 2)],
        consistent_prior_weight: Some(1e-6),
        ..Options::default()
    };
    let fit = fit(&truth, &[data], &[0, 1, 2], &options).unwrap();
    let names = fit.columns.names();
    let value = |name: &str| fit.x[names.iter().position(|n| n == name).unwrap()];
    assert!((value("V1+2") - 0.7).abs() < 1e-3, "{}", value("V1+2"));
    assert!((value("S1+2") - 0.4).abs() < 1e-3, "{}", value("S1+2"));
}

/// Each joint's friction grows by 5 % of the torque that its gear transmits to the links.
#[test]
fn load_dependent_friction_is_identified() {
    let truth = random_arm::<3>(43);
    let weightless_rotors = Arm::from_links(
        *truth.links(),
        Vector::zeros(),
        truth.joint_from_tip(),
        truth.gravity(),
    )
    .unwrap();
    let dry = Friction::coulomb(0.0, 1.0);
    let loaded = |seed| {
        let mut data = motion(&truth, &friction(), &[0, 1, 2], 1500, seed);
        for i in 0..data.samples() {
            let at = |m: &DMatrix<f64>| Vector::<3>::from_fn(|j, _| m[(i, j)]);
            let (q, qd, qdd) = (at(&data.q), at(&data.qd), at(&data.qdd));
            let transmitted = rnea(&weightless_rotors, &q, &qd, &qdd);
            for j in 0..3 {
                data.tau[(i, j)] += 0.05 * transmitted[j].abs() * dry.dry_torque_nm(qd[j]);
            }
        }
        data
    };
    let options = Options {
        friction: FrictionColumns {
            load: Some(LoadTorque::Joint),
            ..FrictionColumns::COULOMB_AND_OFFSET
        },
        consistent_prior_weight: Some(1e-6),
        ..Options::default()
    };
    let fit = fit(&truth, &[loaded(9)], &[0, 1, 2], &options).unwrap();
    let names = fit.columns.names();
    for j in 0..3 {
        let value = fit.x[names.iter().position(|n| *n == format!("L{j}")).unwrap()];
        assert!((value - 0.05).abs() < 1e-4, "{value}");
        // The controller uses the friction at the mean load, and its growth with the load.
        let (found, unloaded) = (fit.friction()[j], friction::<3>()[j]);
        let more_nm = found.coulomb_nm - unloaded.coulomb_nm;
        let mean_nm = 0.05 * fit.load_nm[j];
        assert!((more_nm - mean_nm).abs() < 1e-3, "{more_nm} {mean_nm}");
        assert!(fit.load_nm[j] > 0.0);
        for load_nm in [0.0, 8.0, -20.0_f64] {
            let expected_nm = unloaded.coulomb_nm + 0.05 * load_nm.abs();
            let found_nm = found.at_load(load_nm).coulomb_nm;
            assert!((found_nm - expected_nm).abs() < 1e-2, "{found_nm}");
        }
    }
    assert!(fit.validate_motion(&loaded(10)).unwrap().total_relative < 1e-4);
    let load_only = FrictionColumns {
        coulomb: false,
        ..options.friction
    };
    let error = Columns::new(3, &[0], true, load_only, &[]).unwrap_err();
    assert!(error.to_string().contains("load alone"), "{error}");
}

#[test]
fn the_rank_of_an_arm_does_not_depend_on_the_log() {
    let truth = random_arm::<4>(51);
    let options = Options {
        rotor: false,
        friction: FrictionColumns::NONE,
        consistent_prior_weight: None,
        slow_rad_per_s: 0.0,
        ..Options::default()
    };
    let ranks: Vec<usize> = (1..4)
        .map(|seed| {
            let data = motion(&truth, &[Friction::NONE; 4], &[0, 1, 2, 3], 800, seed);
            fit(&truth, &[data], &[0, 1, 2, 3], &options)
                .unwrap()
                .base
                .rank()
        })
        .collect();
    // Base parameters: seven for each link in general position, three for the first, whose axis is fixed.
    assert_eq!(ranks, [24, 24, 24]);
}

/// Viscous friction that differs by direction is found, and reaches the controller's friction law: without it, the offset would be
/// right at the mean speed of the motion only.
#[test]
fn viscous_friction_that_differs_by_direction_is_found() {
    let arm = random_arm::<4>(5);
    let law = friction::<4>().map(|friction| Friction {
        viscous_asymmetry_nm_s_per_rad: -0.2 * friction.viscous_nm_s_per_rad,
        ..friction
    });
    let joints = [0, 1, 2, 3];
    let data = [motion(&arm, &law, &joints, 600, 11)];
    let held_out = motion(&arm, &law, &joints, 300, 12);
    let identified = |asymmetry: bool| {
        let options = Options {
            friction: FrictionColumns {
                asymmetry,
                ..FrictionColumns::COULOMB_AND_OFFSET
            },
            consistent_prior_weight: None,
            ..Options::default()
        };
        let found = fit(&arm, &data, &joints, &options).unwrap();
        let left = found.validate_motion(&held_out).unwrap().total_relative;
        (found, left)
    };
    let (found, left) = identified(true);
    // The column differs from the law within the band only.
    assert!(left < 1e-4, "{left}");
    for (found, expected) in found.friction().iter().zip(law) {
        let error = found.viscous_asymmetry_nm_s_per_rad - expected.viscous_asymmetry_nm_s_per_rad;
        assert!(error.abs() < 1e-3, "{error}");
        assert_eq!(found.validate(), Ok(()));
    }
    let (_, without) = identified(false);
    assert!(without > 100.0 * left, "{without}, {left} with it");
}
