//! Cross-validation finds the true friction terms and rejects superfluous ones.

use crate::support::{motion, random_arm};
use supple_core::dynamics::gravity;
use supple_core::friction::LoadTorque;
use supple_core::{Friction, Vector};
use supple_ident::select::{
    Candidate, CandidateResult, compare, friction_candidates, load_candidates, prior_candidates,
};
use supple_ident::{
    DMatrix, FrictionColumns, IdentError, Motion, Options, Procedure, fit, identify_motions,
};
use supple_random::Random;

const JOINTS: [usize; 3] = [0, 1, 2];

fn noisy(friction: Friction) -> Motion {
    let mut data = motion(&random_arm::<3>(61), &[friction; 3], &JOINTS, 1200, 8);
    let mut noise = Random::new(8);
    data.tau.iter_mut().for_each(|t| *t += 0.3 * noise.signed());
    data
}

fn base() -> Options {
    Options {
        slow_rad_per_s: 0.0,
        ..Options::default()
    }
}

#[test]
fn the_true_friction_model_is_selected() {
    let stribeck = Friction {
        breakaway_nm: 3.0,
        stribeck_rad_per_s: 0.5,
        ..Friction::coulomb(0.6, 1.0)
    };
    let offset = Friction {
        offset_nm: 2.0,
        ..Friction::coulomb(0.6, 1.0)
    };
    let cases = [
        (Friction::NONE, "no friction"),
        (Friction::coulomb(2.0, 0.0), "viscous"),
        (Friction::coulomb(0.6, 1.0), "viscous, Coulomb"),
        (offset, "viscous, Coulomb, offset"),
        (stribeck, "viscous, Coulomb, Stribeck 0.5 rad/s"),
    ];
    for (friction, expected) in cases {
        let model = random_arm::<3>(61);
        let candidates = friction_candidates(&base());
        let table = compare(&model, &[noisy(friction)], &JOINTS, &candidates, 4).unwrap();
        assert_eq!(
            table.candidates[table.chosen].candidate.name, expected,
            "\n{table}"
        );
    }
}

#[test]
fn load_independent_friction_is_not_reported_as_load_dependent() {
    let model = random_arm::<3>(61);
    let options = Options {
        friction: FrictionColumns::COULOMB,
        ..base()
    };
    let choose = |data: Motion| {
        let table = compare(&model, &[data], &JOINTS, &load_candidates(&options), 4).unwrap();
        table.options().friction.load
    };
    let steady = noisy(Friction::coulomb(0.6, 1.0));
    let mut loaded = steady.clone();
    let dry = Friction::coulomb(0.0, 1.0);
    for i in 0..loaded.samples() {
        let at = |m: &DMatrix<f64>| Vector::<3>::from_fn(|j, _| m[(i, j)]);
        let passed_on = gravity(&model, &at(&loaded.q));
        for j in JOINTS {
            loaded.tau[(i, j)] += 0.1 * passed_on[j].abs() * dry.dry_torque_nm(loaded.qd[(i, j)]);
        }
    }
    assert_eq!(choose(steady), None);
    assert_eq!(choose(loaded), Some(LoadTorque::Joint));
    assert!(
        load_candidates(&Options {
            friction: FrictionColumns::NONE,
            ..base()
        })
        .is_empty()
    );
}

#[test]
fn a_wrong_prior_gets_a_small_weight_and_a_right_one_a_large_weight() {
    let data = [noisy(Friction::coulomb(0.6, 1.0))];
    let weight = |model| {
        let table = compare(&model, &data, &JOINTS, &prior_candidates(&base()), 4).unwrap();
        assert!(table.to_string().lines().count() == 7);
        table.options().consistent_prior_weight.unwrap()
    };
    let right = random_arm::<3>(61);
    let mut links = *right.links();
    for link in &mut links {
        link.mass *= 3.0;
        link.first_moment *= -3.0;
        link.inertia *= 3.0;
    }
    let wrong = supple_core::Arm::from_links(
        links,
        right.armature(),
        right.joint_from_tip(),
        right.gravity(),
    );
    assert!(weight(right) > weight(wrong.unwrap()));
}

/// With three logs of the same kind or more, a fold is made of whole logs.
#[test]
fn logs_of_the_same_kind_are_held_out_whole() {
    let model = random_arm::<3>(61);
    let fast = noisy(Friction::coulomb(0.6, 1.0));
    let mut slow = fast.clone();
    slow.qdd *= 0.1;
    let folds = |motions: &[Motion]| {
        let candidates = [Candidate {
            name: "one".to_owned(),
            options: base(),
            rank: 0,
        }];
        let table = compare(&model, motions, &JOINTS, &candidates, 4).unwrap();
        table.candidates[0].folds.len()
    };
    let [a, b, c] = [fast.clone(), fast.clone(), fast.clone()];
    assert_eq!(folds(&[a.clone(), b.clone()]), 4);
    assert_eq!(folds(&[a.clone(), b.clone(), c.clone()]), 3);
    assert_eq!(folds(&[a.clone(), b.clone(), slow]), 4);
    assert_eq!(folds(&[a.clone(), b.clone(), c, a, b]), 4);
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn a_candidate_is_as_good_if_it_is_within_a_standard_error() {
    let result = |folds: &[f64]| CandidateResult {
        candidate: Candidate {
            name: String::new(),
            options: base(),
            rank: 0,
        },
        columns: 1,
        folds: folds.iter().map(|square| square.sqrt()).collect(),
        total: mean(folds).sqrt(),
        relative: 0.0,
    };
    let best = result(&[1.0, 2.0, 3.0, 4.0]);
    // Mean difference 0.1, standard error over the folds 0.06.
    assert!(!result(&[1.0, 2.1, 3.2, 4.1]).is_as_good_as(&best));
    // Mean difference 0.1, standard error 0.2.
    assert!(result(&[1.5, 1.7, 3.1, 4.1]).is_as_good_as(&best));
    // A fold that cannot be predicted: mean difference and standard error are equal.
    assert!(!result(&[1.0, 2.0, 3.0, 4e9]).is_as_good_as(&best));
    assert!(best.is_as_good_as(&best));
    // 0.05 % in all folds does not matter.
    assert!(result(&[1.001, 2.002, 3.003, 4.004]).is_as_good_as(&best));
    let failed = CandidateResult {
        total: f64::INFINITY,
        ..result(&[])
    };
    assert!(!failed.is_as_good_as(&best));
}

#[test]
fn rejects_a_single_part_and_an_empty_list() {
    let data = [noisy(Friction::NONE)];
    let model = random_arm::<3>(61);
    assert!(compare(&model, &data, &JOINTS, &friction_candidates(&base()), 1).is_err());
    assert!(compare(&model, &data, &JOINTS, &[], 4).is_err());
}

/// The flag ends a comparison between two fits, and a fit between two steps.
#[test]
fn a_cancelled_identification_has_no_result() {
    let model = random_arm::<3>(61);
    let motions = [noisy(Friction::coulomb(0.6, 1.0))];
    let procedure = Procedure::default();
    identify_motions(&model, &motions, &JOINTS, &procedure).expect("not cancelled");
    procedure.cancellation.cancel();
    let found = identify_motions(&model, &motions, &JOINTS, &procedure);
    assert_eq!(found.err(), Some(IdentError::Cancelled));
    let options = Options {
        cancellation: procedure.cancellation.clone(),
        ..base()
    };
    let found = compare(&model, &motions, &JOINTS, &friction_candidates(&options), 4);
    assert_eq!(found.err(), Some(IdentError::Cancelled));
    let found = fit(&model, &motions, &JOINTS, &options);
    assert_eq!(found.err(), Some(IdentError::Cancelled));
}
