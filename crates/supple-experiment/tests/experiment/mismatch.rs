//! Models with errors: what is written as a description is the model.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use supple_core::Vector;
use supple_core::dynamics::{crba, rnea};
use supple_core::{Arm, Joint};
use supple_experiment::Mismatch;
use supple_model::{Description, IdentifiedModel, with_dof};

/// Compares the torques of two arms in random motion.
fn same_dynamics<const N: usize>(found: &Arm<N>, expected: &Arm<N>, of: &str) {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..50 {
        let mut draw = |size: f64| Vector::<N>::from_fn(|_, _| random.random_range(-size..size));
        let (q, qd, qdd) = (draw(2.0), draw(2.0), draw(4.0));
        let (found_nm, expected_nm) = (rnea(found, &q, &qd, &qdd), rnea(expected, &q, &qd, &qdd));
        let scale_nm = expected_nm.amax().max(1.0);
        assert!(
            (found_nm - expected_nm).amax() < 1e-9 * scale_nm,
            "{of}: {found_nm} {expected_nm}"
        );
    }
}

fn written<const N: usize>(description: &Description) {
    let given = description.config::<N>().unwrap();
    let errors = Mismatch {
        gravity: 0.15,
        friction: 0.5,
        seed: 4,
    };
    let changed = errors.apply(&given).unwrap();
    let q = description.home::<N>().unwrap();
    let moved = (crba(&changed.arm, &q) - crba(&given.arm, &q)).amax();
    assert!(moved > 1e-3 * crba(&given.arm, &q).amax());
    let write = |arm: &Arm<N>| {
        let model = IdentifiedModel {
            arm,
            friction: &changed.friction,
            ripple: None,
            source: "a test",
        };
        description
            .with_model(&model)
            .unwrap()
            .config::<N>()
            .unwrap()
            .arm
    };
    same_dynamics(&write(&changed.arm), &changed.arm, description.name());
    // The same arm, whose links are given in its joint frames.
    let joints: [Joint; N] = core::array::from_fn(|i| Joint {
        parent_from_link: changed.arm.parent_from_joint(i),
        axis: supple_core::nalgebra::Vector3::z(),
        body: changed.arm.body(i),
        armature_kg_m2: changed.arm.armature()[i],
    });
    let arm = Arm::new(
        &joints,
        changed.arm.joint_from_tip(),
        None,
        changed.arm.gravity(),
    )
    .unwrap();
    same_dynamics(&write(&arm), &changed.arm, description.name());
    for i in 0..N {
        assert_eq!(changed.arm.link_from_joint(i), given.arm.link_from_joint(i));
    }
}

/// Joints of these arms turn about any axis of their link frames.
#[test]
fn a_model_with_errors_is_written_with_its_own_dynamics() {
    for &name in supple_model::assets() {
        let description = Description::asset(name).unwrap();
        with_dof!(description.dof(), N => written::<N>(&description)).unwrap();
    }
}
