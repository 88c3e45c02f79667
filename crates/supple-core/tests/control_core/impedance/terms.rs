//! Each term, their sum, and (3.6) as printed.

use crate::support::arms::{wam3, wam7};
use crate::support::configs::{four, friction, seven};
use crate::support::property::{check, vector3};
use crate::support::states::scene;
use crate::support::{inverse, size};
use proptest::prelude::*;
use std::collections::BTreeSet;
use supple_core::config::{ApparentInertia, FrictionVelocity, Gains, Law, Role};
use supple_core::dynamics::{coriolis, crba, gravity, jacobian, jacobian_dot_qd, tip_pose};
use supple_core::impedance::{SINGULAR_BELOW_M, Torques};
use supple_core::math::{Matrix3, Vector3};
use supple_core::record::{Recorded, Unpack};
use supple_core::torques::TERMS;
use supple_core::{Friction, Vector};

fn whole_law() -> Law {
    Law {
        gains: Gains::isotropic(0.0, 0.0),
        inertia: ApparentInertia::Chosen(Matrix3::from_diagonal_element(3.0)),
        friction_velocity: FrictionVelocity::Reference,
        measured_stribeck: false,
        presliding_share: 1.0,
        inertial_feedforward: true,
        nullspace_damping_nm_s_per_rad: 2.0,
    }
}

#[test]
fn every_term_is_named_once_and_counted_once() {
    let one = Vector::<3>::repeat;
    let words = |k: usize| [f64::from(1 << k).to_bits(); 3];
    let words: Vec<u64> = (0..TERMS.len()).flat_map(words).collect();
    let torques: Torques<3> = Recorded::<3>::unpack(&mut Unpack::new(&words, 3));
    let all = f64::from((1 << TERMS.len()) - 1);
    assert_eq!(torques.total(), one(all));
    assert_eq!(torques.feedback(), torques.stiffness + torques.damping);
    let names: BTreeSet<_> = torques.named().iter().map(|(name, _)| *name).collect();
    assert_eq!(names.len(), TERMS.len());
    // The names are those of the fields, in their order.
    let written = format!("{torques:?}");
    let mut last = 0;
    for (k, (name, torque)) in torques.named().into_iter().enumerate() {
        assert_eq!(*torque, one(f64::from(1 << k)), "{name}");
        let place = written.find(&format!("{name}:")).expect(name);
        assert!(place >= last, "{name} is out of order");
        last = place;
    }
    assert_eq!(Torques::<3>::zeros().total(), one(0.0));
}

/// The law leaves the terms of other modules at zero.
#[test]
fn the_law_leaves_terms_of_other_modules_zero() {
    let config = seven();
    check(100, scene::<7>(), |scene| {
        let torques = scene.torques(
            &whole_law(),
            &friction(),
            &config.arm,
            &config.roles,
            Some(scene.force_n),
        );
        for term in [torques.joint_pd, torques.soft_stop, torques.handover] {
            prop_assert_eq!(size(&term), 0.0);
        }
        Ok(())
    });
}

#[test]
fn model_terms_equal_the_dynamics() {
    let arm = wam7();
    check(100, scene::<7>(), |scene| {
        let (q, qd) = (&scene.q, &scene.qd);
        let torques = scene.torques(&whole_law(), &friction(), &arm, &seven().roles, None);
        prop_assert!((torques.gravity - gravity(&arm, q)).norm() < 1e-12);
        prop_assert!((torques.coriolis - coriolis(&arm, q, qd)).norm() < 1e-11);
        Ok(())
    });
}

/// Neither spring nor damper nor measured force reaches a held joint through `J^T`.
#[test]
fn held_joints_get_no_force_of_the_task() {
    let config = four();
    check(200, scene::<4>(), |scene| {
        let own = Law {
            inertia: ApparentInertia::Own,
            ..whole_law()
        };
        let (arm, roles, none) = (&config.arm, &config.roles, [Friction::NONE; 4]);
        let torques = scene.torques(&own, &none, arm, roles, Some(scene.force_n));
        for (name, term) in [
            ("stiffness", torques.stiffness),
            ("damping", torques.damping),
            ("force", torques.force),
            ("nullspace", torques.nullspace),
        ] {
            prop_assert_eq!(term[2], 0.0, "{}", name);
        }
        // With a chosen inertia the held joint gets the coupling torque of the others'
        // acceleration, `H Jb a`, so that it stays at rest without a torque of its own loop.
        let law = whole_law();
        let torques = scene.torques(&law, &none, arm, roles, Some(scene.force_n));
        let task = scene.task(arm, roles);
        let k = scene.gains.stiffness_n_per_m;
        let error = scene.reference.position - tip_pose(arm, &scene.q).translation;
        let coupling = crba(arm, &scene.q) * (task.inverse * (k.component_mul(&error) / 3.0));
        prop_assert!((torques.stiffness - coupling).norm() < 1e-9 * (1.0 + coupling.norm()));
        Ok(())
    });
}

#[test]
fn a_measured_force_is_not_used_with_the_arms_own_inertia() {
    let config = four();
    let own = Law {
        inertia: ApparentInertia::Own,
        ..whole_law()
    };
    check(100, (scene::<4>(), vector3(100.0)), |(scene, force)| {
        let torques = |force| scene.torques(&own, &friction(), &config.arm, &config.roles, force);
        prop_assert_eq!(torques(Some(force)), torques(None));
        Ok(())
    });
}

/// A chosen inertia without a force measurement gives bit-identical torques to the arm's own.
#[test]
fn a_chosen_inertia_without_force_equals_the_arms_own() {
    let config = four();
    check(100, scene::<4>(), |scene| {
        let torques = |inertia| {
            let law = Law {
                inertia,
                ..whole_law()
            };
            scene.torques(&law, &friction(), &config.arm, &config.roles, None)
        };
        prop_assert_eq!(torques(whole_law().inertia), torques(ApparentInertia::Own));
        Ok(())
    });
}

#[test]
fn stiffness_and_damping_are_per_axis_and_linear() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    let law = Law::as_published(Gains::isotropic(0.0, 0.0));
    let none = [Friction::NONE; 3];
    check(100, scene::<3>(), |scene| {
        let at = |k: Vector3<f64>, b: Vector3<f64>| {
            let mut with = scene.clone();
            with.gains = Gains {
                stiffness_n_per_m: k,
                damping_n_s_per_m: b,
            };
            with.torques(&law, &none, &arm, &roles, None)
        };
        let zero = Vector3::zeros();
        prop_assert_eq!(size(&at(zero, zero).feedback()), 0.0);
        let (k, b) = (scene.gains.stiffness_n_per_m, scene.gains.damping_n_s_per_m);
        let mut sum = Vector::<3>::zeros();
        for axis in 0..3 {
            let mut one = zero;
            one[axis] = k[axis];
            let along = at(one, zero);
            prop_assert_eq!(size(&along.damping), 0.0);
            sum += along.stiffness;
            one[axis] = b[axis];
            sum += at(zero, one).damping;
        }
        let whole = at(k, b).feedback();
        prop_assert!((sum - whole).norm() < 1e-12 * (1.0 + whole.norm()));
        Ok(())
    });
}

/// The torque is `G + C qd + D(qd) - H J^-1 J' qd + J^T [K (Xo - X) + B (Xo' - X')]`.
#[test]
fn as_published_matches_the_printed_equation() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    let model: [Friction; 3] = friction();
    check(300, scene::<3>(), |mut scene| {
        scene.friction_share = 1.0;
        let (q, qd) = (&scene.q, &scene.qd);
        if scene.task(&arm, &roles).min_singular_value_m < SINGULAR_BELOW_M {
            return Ok(());
        }
        let j: Matrix3<f64> = jacobian(&arm, q).fixed_rows::<3>(0).into_owned();
        let jdot_qd = jacobian_dot_qd(&arm, q, qd);
        let (k, b) = (scene.gains.stiffness_n_per_m, scene.gains.damping_n_s_per_m);
        let error = scene.reference.position - tip_pose(&arm, q).translation;
        let error_rate = scene.reference.velocity - j * qd;
        let expected = gravity(&arm, q)
            + coriolis(&arm, q, qd)
            + Vector::<3>::from_fn(|i, _| model[i].torque_nm(qd[i]))
            - crba(&arm, q) * (inverse(&j) * jdot_qd.fixed_rows::<3>(0))
            + j.transpose() * (k.component_mul(&error) + b.component_mul(&error_rate));
        let law = Law::as_published(scene.gains);
        prop_assert_eq!(law.gains, scene.gains);
        let found = scene.torques(&law, &model, &arm, &roles, Some(scene.force_n));
        let off = (found.total() - expected).norm();
        prop_assert!(off < 1e-9 * (1.0 + expected.norm()), "{off}");
        for term in [found.inertial, found.force, found.nullspace] {
            prop_assert_eq!(size(&term), 0.0);
        }
        Ok(())
    });
}
