//! The dynamically consistent inverse equals its definition for every way of computing it.

use crate::support::arms::{wam3, wam4, wam7};
use crate::support::configs::{four, seven};
use crate::support::inverse;
use crate::support::property::{Outcome, check};
use crate::support::states::scene;
use proptest::prelude::*;
use supple_core::config::Role;
use supple_core::impedance::{SINGULAR_BELOW_M, Task, singularity_damping_per_kg};
use supple_core::math::Matrix3;
use supple_core::{Arm, Matrix};

/// `H^-1 J^T (J H^-1 J^T + damping)^-1` with the rows and columns of held joints as those of the identity.
fn as_defined<const N: usize>(
    mass_matrix: &Matrix<N, N>,
    task: &Task<N>,
    roles: &[Role; N],
) -> Matrix<N, 3> {
    let mass_matrix = Matrix::<N, N>::from_fn(|i, j| {
        let both_active = roles[i] == Role::Active && roles[j] == Role::Active;
        match both_active {
            true => mass_matrix[(i, j)],
            false => f64::from(u8::from(i == j)),
        }
    });
    let mobile = inverse(&mass_matrix) * task.jacobian.transpose();
    let damping = singularity_damping_per_kg(task.min_singular_value_m);
    let mobility = task.jacobian * mobile + Matrix3::from_diagonal_element(damping);
    mobile * inverse(&mobility)
}

fn is_as_defined<const N: usize>(arm: Arm<N>, roles: [Role; N]) {
    check(1000, scene::<N>(), |scene| -> Outcome {
        let mass_matrix = scene.terms(&arm).mass_matrix;
        let task = scene.task(&arm, &roles);
        let expected = as_defined(&mass_matrix, &task, &roles);
        let error = (task.inverse - expected).norm();
        prop_assert!(error < 1e-9 * expected.norm(), "{error:e}");
        if task.min_singular_value_m > SINGULAR_BELOW_M {
            let identity = task.jacobian * task.inverse;
            prop_assert!((identity - Matrix3::identity()).norm() < 1e-11);
        }
        Ok(())
    });
}

#[test]
fn of_three_joints() {
    is_as_defined(wam3(), [Role::Active; 3]);
}

#[test]
fn of_three_joints_beside_one_that_is_held() {
    let roles = four().roles;
    let held = roles.iter().filter(|role| **role != Role::Active).count();
    assert_eq!(held, 1);
    is_as_defined(wam4(), roles);
}

#[test]
fn of_four_joints() {
    is_as_defined(wam4(), [Role::Active; 4]);
}

#[test]
fn of_seven_joints_some_of_them_held() {
    is_as_defined(wam7(), seven().roles);
}

#[test]
fn an_indefinite_mass_matrix_has_no_inverse() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    check(100, scene::<3>(), |scene| {
        for entry in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for joint in 0..3 {
                let mut terms = scene.terms(&arm);
                terms.mass_matrix[(joint, joint)] = entry;
                prop_assert!(Task::new(&terms, &roles).is_none(), "{entry} of {joint}");
            }
        }
        Ok(())
    });
}
