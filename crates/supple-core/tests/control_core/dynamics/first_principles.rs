//! Random arms compared with the same arms as point masses, with axes and frames as described:
//! tests the rotated joint frames, the sweeps and the merged tool.

use crate::common::cloud::{link_poses, point_jacobian, point_mass_reference};
use crate::common::numeric::{derivative, scalar, size, unit};
use crate::common::random::Case;
use crate::{for_arms_of_3_4_and_7_joints, prop_close};
use proptest::test_runner::TestCaseError;
use supple_core::dynamics::{
    coriolis_matrix, crba, jacobian, parameters, potential_energy, tip_pose,
};
use supple_core::math::Vector3;
use supple_core::{Matrix, Vector};

type Outcome = Result<(), TestCaseError>;

for_arms_of_3_4_and_7_joints!(
    mass_matrix_is_that_of_the_points,
    potential_energy_is_that_of_the_points,
    coriolis_matrix_is_made_of_christoffel_symbols,
    tip_and_jacobian_follow_the_axes,
    parameters_are_those_of_the_points,
);

fn mass_matrix_is_that_of_the_points<const N: usize>(case: &Case<N>) -> Outcome {
    let (links, _) = point_mass_reference(&case.joints, &case.carried(), &case.gravity, &case.q);
    let expected = links + Matrix::from_diagonal(&case.armature());
    prop_close!(crba(&case.arm(), &case.q), expected, size(&expected), 1e-13);
    Ok(())
}

fn potential_energy_is_that_of_the_points<const N: usize>(case: &Case<N>) -> Outcome {
    let (_, expected) = point_mass_reference(&case.joints, &case.carried(), &case.gravity, &case.q);
    let found = potential_energy(&case.arm(), &case.q);
    prop_close!(scalar(found), scalar(expected), 100.0, 1e-13);
    Ok(())
}

/// `C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) qd_k / 2`, with `M` from the points.
fn coriolis_matrix_is_made_of_christoffel_symbols<const N: usize>(case: &Case<N>) -> Outcome {
    let clouds = case.carried();
    let slope = |k: usize| {
        derivative(|h| {
            point_mass_reference(
                &case.joints,
                &clouds,
                &case.gravity,
                &(case.q + unit::<N>(k) * h),
            )
            .0
        })
    };
    let dm: [Matrix<N, N>; N] = std::array::from_fn(slope);
    let expected = Matrix::<N, N>::from_fn(|i, j| {
        (0..N)
            .map(|k| 0.5 * (dm[k][(i, j)] + dm[j][(i, k)] - dm[i][(j, k)]) * case.qd[k])
            .sum()
    });
    let found = coriolis_matrix(&case.arm(), &case.q, &case.qd);
    prop_close!(found, expected, 10.0 + size(&expected), 1e-9);
    Ok(())
}

fn tip_and_jacobian_follow_the_axes<const N: usize>(case: &Case<N>) -> Outcome {
    let poses = link_poses(&case.joints, &case.q);
    let expected = poses[N - 1] * case.last_link_from_tip;
    let arm = case.arm();
    let found = tip_pose(&arm, &case.q);
    prop_close!(found.rotation, expected.rotation, 1.0, 1e-13);
    prop_close!(found.translation, expected.translation, 1.0, 1e-13);

    let jacobian = jacobian(&arm, &case.q);
    let linear = point_jacobian(&case.joints, &poses, N - 1, &expected.translation);
    prop_close!(jacobian.fixed_rows::<3>(0).into_owned(), linear, 1.0, 1e-13);
    for i in 0..N {
        let axis: Vector3<f64> = poses[i].rotation * case.joints[i].axis;
        let angular = Vector3::new(jacobian[(3, i)], jacobian[(4, i)], jacobian[(5, i)]);
        prop_close!(angular, axis, 1.0, 1e-13);
    }
    Ok(())
}

fn parameters_are_those_of_the_points<const N: usize>(case: &Case<N>) -> Outcome {
    for (found, cloud) in parameters(&case.arm()).iter().zip(case.carried()) {
        let h = cloud.first_moment();
        let i = cloud.inertia_about(&Vector3::zeros());
        let expected = Vector::<10>::from_column_slice(&[
            cloud.mass_kg(),
            h.x,
            h.y,
            h.z,
            i.m11,
            i.m12,
            i.m22,
            i.m13,
            i.m23,
            i.m33,
        ]);
        prop_close!(*found, expected, 1.0, 1e-13);
    }
    Ok(())
}
