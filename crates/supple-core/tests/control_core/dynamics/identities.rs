//! Identities between the functions of `supple_core::dynamics`, on random arms.

use crate::common::numeric::{scalar, size};
use crate::common::random::Case;
use crate::{for_arms_of_3_4_and_7_joints, prop_close};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use supple_core::dynamics::{
    Momentum, Terms, aba, coriolis, coriolis_matrix, crba, gravity, jacobian, jacobian_dot_qd,
    kinetic_energy, momentum, parameters, regressor, regressor_times, rnea, terms, tip_pose,
};
use supple_core::linalg::Cholesky;
use supple_core::{Arm, Vector};

type Outcome = Result<(), TestCaseError>;

/// Magnitude of the torques \[N m\], the scale of rounding errors.
pub fn torque_scale<const N: usize>(case: &Case<N>, arm: &Arm<N>) -> f64 {
    let speeds = case.qd.norm_squared() + case.qdd.norm();
    1.0 + size(&crba(arm, &case.q)) * (1.0 + speeds) + size(&gravity(arm, &case.q))
}

for_arms_of_3_4_and_7_joints!(
    mass_matrix_is_symmetric_and_positive_definite,
    inverse_dynamics_is_the_sum_of_its_parts,
    inverse_dynamics_without_acceleration_or_velocity,
    forward_dynamics_inverts_inverse_dynamics,
    coriolis_torque_is_the_matrix_times_the_velocity,
    kinetic_energy_is_half_the_momentum_times_the_velocity,
    momentum_and_the_gradient_of_the_kinetic_energy,
    regressor_is_linear_in_the_parameters,
    terms_are_the_results_of_the_separate_functions,
    terms_do_not_depend_on_the_previous_content,
);

fn mass_matrix_is_symmetric_and_positive_definite<const N: usize>(case: &Case<N>) -> Outcome {
    let mass_matrix = crba(&case.arm(), &case.q);
    prop_assert_eq!(mass_matrix, mass_matrix.transpose());
    let factor = Cholesky::new(&mass_matrix);
    prop_assert!(factor.is_some(), "not positive definite: {mass_matrix}");
    // Rotors only add to the diagonal.
    let mut rotorless = case.clone();
    for joint in &mut rotorless.joints {
        joint.armature_kg_m2 = 0.0;
    }
    let mut difference = mass_matrix - crba(&rotorless.arm(), &case.q);
    for i in 0..N {
        difference[(i, i)] -= case.joints[i].armature_kg_m2;
    }
    prop_assert!(size(&difference) <= 1e-14 * size(&mass_matrix));
    Ok(())
}

fn inverse_dynamics_is_the_sum_of_its_parts<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd, qdd) = (case.arm(), &case.q, &case.qd, &case.qdd);
    let sum = crba(&arm, q) * qdd + coriolis(&arm, q, qd) + gravity(&arm, q);
    prop_close!(rnea(&arm, q, qd, qdd), sum, torque_scale(case, &arm), 1e-13);
    Ok(())
}

fn inverse_dynamics_without_acceleration_or_velocity<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let (zero, scale) = (Vector::zeros(), torque_scale(case, &arm));
    let bias = coriolis(&arm, q, qd) + gravity(&arm, q);
    prop_close!(rnea(&arm, q, qd, &zero), bias, scale, 1e-13);
    prop_close!(rnea(&arm, q, &zero, &zero), gravity(&arm, q), scale, 1e-13);
    prop_close!(coriolis(&arm, q, &zero), zero, scale, 1e-13);
    // The Coriolis and centrifugal torque is quadratic in the velocity.
    let doubled = coriolis(&arm, q, &(qd * 2.0));
    prop_close!(doubled, coriolis(&arm, q, qd) * 4.0, scale, 1e-13);
    Ok(())
}

/// Backward error: inverse dynamics of the result gives the input torque. Forward error: the result agrees
/// with the Cholesky solution as far as the condition number permits. The random `qdd` serves as torque.
fn forward_dynamics_inverts_inverse_dynamics<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let tau = case.qdd;
    let qdd = aba(&arm, q, qd, &tau);
    let mass_matrix = crba(&arm, q);
    let scale = torque_scale(case, &arm) + size(&mass_matrix) * qdd.norm();
    prop_close!(rnea(&arm, q, qd, &qdd), tau, scale, 1e-13);

    let factor = Cholesky::new(&mass_matrix).expect("positive definite");
    let bias = rnea(&arm, q, qd, &Vector::zeros());
    let solved = factor.solve(&(tau - bias));
    prop_close!(qdd, solved, 1.0 + qdd.norm(), 1e-9);

    let back = aba(&arm, q, qd, &rnea(&arm, q, qd, &case.qdd));
    prop_close!(back, case.qdd, torque_scale(case, &arm), 1e-9);
    Ok(())
}

fn coriolis_torque_is_the_matrix_times_the_velocity<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let product = coriolis_matrix(&arm, q, qd) * qd;
    prop_close!(
        coriolis(&arm, q, qd),
        product,
        torque_scale(case, &arm),
        1e-13
    );
    Ok(())
}

fn kinetic_energy_is_half_the_momentum_times_the_velocity<const N: usize>(
    case: &Case<N>,
) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let expected = 0.5 * qd.dot(&(crba(&arm, q) * qd));
    let found = kinetic_energy(&arm, q, qd);
    prop_close!(
        scalar(found),
        scalar(expected),
        torque_scale(case, &arm),
        1e-13
    );
    prop_assert!(found > 0.0);
    Ok(())
}

fn momentum_and_the_gradient_of_the_kinetic_energy<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let scale = torque_scale(case, &arm);
    let found = momentum(&arm, q, qd);
    prop_close!(found.momentum, crba(&arm, q) * qd, scale, 1e-13);
    let gradient = coriolis_matrix(&arm, q, qd).transpose() * qd;
    prop_close!(found.kinetic_gradient, gradient, scale, 1e-13);
    Ok(())
}

fn regressor_is_linear_in_the_parameters<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd, qdd) = (case.arm(), &case.q, &case.qd, &case.qdd);
    let rows = regressor(&arm, q, qd, qdd);
    let without_rotors = regressor_times(&rows, &parameters(&arm));
    let expected = without_rotors + case.armature().component_mul(qdd);
    prop_close!(
        rnea(&arm, q, qd, qdd),
        expected,
        torque_scale(case, &arm),
        1e-13
    );
    for (i, row) in rows.iter().enumerate() {
        // The torque of a joint does not depend on the links before it.
        prop_assert!(row[..i].iter().all(|y| *y == Vector::<10>::zeros()));
    }

    // The regressor does not depend on the inertial parameters.
    let mut other_bodies = case.clone();
    other_bodies.tool = None;
    for joint in &mut other_bodies.joints {
        joint.body.mass_kg *= 3.0;
        joint.body.com_m *= -0.5;
    }
    prop_assert_eq!(rows, regressor(&other_bodies.arm(), q, qd, qdd));
    Ok(())
}

fn terms_are_the_results_of_the_separate_functions<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let scale = torque_scale(case, &arm);
    let mut found = Terms::default();
    terms(&arm, q, qd, &mut found);
    let pose = tip_pose(&arm, q);
    let Momentum {
        momentum,
        kinetic_gradient,
    } = momentum(&arm, q, qd);
    let bias = rnea(&arm, q, qd, &Vector::zeros());
    prop_close!(found.mass_matrix, crba(&arm, q), scale, 1e-13);
    prop_close!(found.coriolis_gravity, bias, scale, 1e-13);
    prop_close!(found.gravity, gravity(&arm, q), scale, 1e-13);
    prop_close!(found.base_from_tip.rotation, pose.rotation, 1.0, 1e-13);
    prop_close!(
        found.base_from_tip.translation,
        pose.translation,
        1.0,
        1e-13
    );
    prop_close!(found.jacobian, jacobian(&arm, q), 1.0, 1e-13);
    let accel_scale = 1.0 + qd.norm_squared() + case.gravity.norm();
    prop_close!(
        found.jacobian_dot_qd,
        jacobian_dot_qd(&arm, q, qd),
        accel_scale,
        1e-13
    );
    prop_close!(found.momentum, momentum, scale, 1e-13);
    prop_close!(found.kinetic_gradient, kinetic_gradient, scale, 1e-13);
    Ok(())
}

fn terms_do_not_depend_on_the_previous_content<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let mut fresh = Terms::default();
    terms(&arm, q, qd, &mut fresh);
    let mut used = Terms::default();
    terms(&arm, &(q * -0.7), &(qd * 5.0), &mut used);
    terms(&arm, q, qd, &mut used);
    prop_assert_eq!(format!("{fresh:?}"), format!("{used:?}"));
    Ok(())
}
