//! Relations between functions and their time derivatives, by central differences.

use crate::common::numeric::{derivative, scalar, size, unit};
use crate::common::random::Case;
use crate::{for_arms_of_3_4_and_7_joints, prop_close};
use proptest::test_runner::TestCaseError;
use supple_core::dynamics::{
    aba, coriolis_matrix, crba, gravity, jacobian, jacobian_dot_qd, kinetic_energy, momentum,
    potential_energy, tip_pose,
};
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Matrix, Vector};

type Outcome = Result<(), TestCaseError>;

for_arms_of_3_4_and_7_joints!(
    mass_matrix_rate_minus_twice_coriolis_is_skew,
    gravity_is_the_gradient_of_potential_energy,
    kinetic_gradient_is_the_gradient_of_kinetic_energy,
    jacobian_maps_joint_rates_to_the_tip_twist,
    jacobian_dot_qd_is_the_rate_of_the_twist,
    momentum_obeys_its_balance,
);

fn mass_matrix_rate_minus_twice_coriolis_is_skew<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let c = coriolis_matrix(&arm, q, qd);
    let rate = derivative(|t| crba(&arm, &(q + qd * t)));
    prop_close!(rate, c + c.transpose(), 10.0 + size(&rate), 1e-9);
    let skew = rate - c * 2.0;
    prop_close!(skew, -skew.transpose(), 10.0 + size(&rate), 1e-9);
    Ok(())
}

fn gravity_is_the_gradient_of_potential_energy<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q) = (case.arm(), &case.q);
    let slope = |i| derivative(|h| potential_energy(&arm, &(q + unit::<N>(i) * h)));
    let gradient = Vector::<N>::from_fn(|i, _| slope(i));
    prop_close!(gravity(&arm, q), gradient, 100.0, 1e-10);
    Ok(())
}

fn kinetic_gradient_is_the_gradient_of_kinetic_energy<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let slope = |i| derivative(|h| kinetic_energy(&arm, &(q + unit::<N>(i) * h), qd));
    let gradient = Vector::<N>::from_fn(|i, _| slope(i));
    let scale = 10.0 + kinetic_energy(&arm, q, qd);
    prop_close!(
        momentum(&arm, q, qd).kinetic_gradient,
        gradient,
        scale,
        1e-10
    );
    Ok(())
}

/// Linear and angular velocity of the tip for `q` moving along `qd`.
fn twist_by_differences<const N: usize>(case: &Case<N>) -> Vector<6> {
    let arm = case.arm();
    let along = |t: f64| tip_pose(&arm, &(case.q + case.qd * t));
    let linear = derivative(|t| along(t).translation);
    let spin: Matrix3<f64> = derivative(|t| along(t).rotation) * along(0.0).rotation.transpose();
    let angular = Vector3::new(
        spin.m32 - spin.m23,
        spin.m13 - spin.m31,
        spin.m21 - spin.m12,
    ) * 0.5;
    Vector::<6>::from_fn(|i, _| if i < 3 { linear[i] } else { angular[i - 3] })
}

fn jacobian_maps_joint_rates_to_the_tip_twist<const N: usize>(case: &Case<N>) -> Outcome {
    let twist = jacobian(&case.arm(), &case.q) * case.qd;
    prop_close!(twist, twist_by_differences(case), 10.0, 1e-10);
    Ok(())
}

fn jacobian_dot_qd_is_the_rate_of_the_twist<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let rate: Matrix<6, N> = derivative(|t| jacobian(&arm, &(q + qd * t)));
    let scale = 1.0 + qd.norm_squared();
    prop_close!(jacobian_dot_qd(&arm, q, qd), rate * qd, scale, 1e-9);
    Ok(())
}

/// `p' = tau - G + dT/dq` along the motion under `tau`.
fn momentum_obeys_its_balance<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let tau = case.qdd * 3.0;
    let qdd = aba(&arm, q, qd, &tau);
    let drift = momentum(&arm, q, qd).kinetic_gradient;
    let expected = tau - gravity(&arm, q) + drift;
    // To first order in t the motion is q + qd t, qd + qdd t; its curvature does not enter.
    let rate = derivative(|t| momentum(&arm, &(q + qd * t), &(qd + qdd * t)).momentum);
    let scale = 10.0 + size(&expected) + size(&crba(&arm, q)) * qdd.norm();
    prop_close!(rate, expected, scale, 1e-9);
    // Energy balance: power is torque times velocity.
    let energy = |t: f64| {
        let (q, qd) = (q + qd * t, qd + qdd * t);
        kinetic_energy(&arm, &q, &qd) + potential_energy(&arm, &q)
    };
    let power = derivative(energy);
    prop_close!(
        scalar(power),
        scalar(tau.dot(qd)),
        scale * (1.0 + qd.norm()),
        1e-9
    );
    Ok(())
}
