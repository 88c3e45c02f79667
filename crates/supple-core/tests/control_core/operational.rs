//! The law as a single sum: the resulting accelerations of the tip, and agreement with the law term
//! by term.

use crate::common::numeric::mixed_error;
use crate::common::random::{Case, check};
use crate::support::{self, inverse};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use supple_core::config::{Gains, Law, Role};
use supple_core::dynamics::{Terms, aba, crba, terms};
use supple_core::impedance::{LawInput, MAX_TASK_MASS_KG, SINGULAR_BELOW_M, Task, impedance};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::{Rotation3, Unit};
use supple_core::operational::{
    MAX_TASK_INERTIA_KG_M2, PoseGains, PoseReference, orientation_error, pose_torque,
    position_torque,
};
use supple_core::{Arm, Friction, Matrix, Pose, Reference, Vector};

type Outcome = Result<(), TestCaseError>;

const DAMPING: f64 = 1.7;

fn filled<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Terms<N> {
    let mut filled = Terms::default();
    terms(arm, q, qd, &mut filled);
    filled
}

fn gains() -> PoseGains {
    PoseGains {
        linear: Gains {
            stiffness_n_per_m: Vector3::new(40.0, 90.0, 20.0),
            damping_n_s_per_m: Vector3::new(8.0, 3.0, 12.0),
        },
        stiffness_nm_per_rad: Vector3::new(4.0, 2.0, 6.0),
        damping_nm_s_per_rad: Vector3::new(0.4, 0.7, 0.2),
    }
}

/// A reference at a random distance from the tip, derived from the case's accelerations.
fn reference<const N: usize>(case: &Case<N>, terms: &Terms<N>) -> PoseReference {
    let [a, b, c] = [case.qdd[0], case.qdd[1], case.qdd[2]].map(|x| 0.05 * x);
    let turn = Pose::from_xyz_rpy([0.0; 3], [a, b, c]).rotation;
    PoseReference {
        base_from_tip: Pose {
            rotation: terms.base_from_tip.rotation * turn,
            translation: terms.base_from_tip.translation + Vector3::new(b, c, a),
        },
        velocity_m_per_s: Vector3::new(c, b, a),
        angular_velocity_rad_per_s: Vector3::new(a, c, b),
        acceleration_m_per_s2: Vector3::new(a, b, -c),
        angular_acceleration_rad_per_s2: Vector3::new(-b, a, c),
    }
}

fn pair(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector<6> {
    Vector::<6>::from_iterator(linear.iter().chain(angular.iter()).copied())
}

/// Whether the inverse of the pose's mobility is undamped.
fn regular<const N: usize>(mobility: &Matrix<6, 6>) -> bool {
    let felt = inverse(mobility).diagonal();
    felt.fixed_rows::<3>(0).max() < MAX_TASK_MASS_KG
        && felt.fixed_rows::<3>(3).max() < MAX_TASK_INERTIA_KG_M2
}

/// The tip accelerates with the reference, plus the force of spring and damper through its own
/// mobility.
fn tip_moves_as_stated<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let terms = filled(&arm, q, qd);
    let j = terms.jacobian;
    let mobility = j * inverse(&crba(&arm, q)) * j.transpose();
    if mobility.symmetric_eigenvalues().min() < 1e-3 || !regular::<N>(&mobility) {
        return Ok(());
    }
    let (reference, gains) = (reference(case, &terms), gains());
    let tau = pose_torque(&arm, q, qd, &reference, &gains, DAMPING).expect("positive definite");
    let found = j * aba(&arm, q, qd, &tau) + terms.jacobian_dot_qd;

    let now = &terms.base_from_tip;
    let relative = Rotation3::from_matrix_unchecked(
        reference.base_from_tip.rotation * now.rotation.transpose(),
    );
    let turn = relative
        .axis()
        .map_or(Vector3::zeros(), |axis| axis.into_inner())
        * relative.angle().sin();
    let error = pair(
        &(reference.base_from_tip.translation - now.translation),
        &turn,
    );
    let wanted = pair(
        &reference.velocity_m_per_s,
        &reference.angular_velocity_rad_per_s,
    );
    let stiffness = pair(&gains.linear.stiffness_n_per_m, &gains.stiffness_nm_per_rad);
    let damping = pair(&gains.linear.damping_n_s_per_m, &gains.damping_nm_s_per_rad);
    let force = stiffness.component_mul(&error) + damping.component_mul(&(wanted - j * qd));
    let expected = pair(
        &reference.acceleration_m_per_s2,
        &reference.angular_acceleration_rad_per_s2,
    ) + mobility * force;
    let scale = 1.0 + expected.norm() + mobility.norm();
    prop_assert!(
        (found - expected).norm() < 1e-8 * scale,
        "{found} {expected}"
    );
    Ok(())
}

#[test]
fn tip_of_6_joints_moves_as_stated() {
    check(tip_moves_as_stated::<6>);
}

#[test]
fn tip_of_7_joints_moves_as_stated() {
    check(tip_moves_as_stated::<7>);
}

/// Motion that does not change the pose is damped; the damping never adds energy, also in singular
/// poses.
#[test]
fn null_space_damping_of_the_pose_only_takes_energy() {
    fn takes(case: &Case<7>) -> Outcome {
        let (arm, qd) = (case.arm(), &case.qd);
        let terms = filled(&arm, &case.q, qd);
        let reference = reference(case, &terms);
        let torque = |damping| pose_torque(&arm, &case.q, qd, &reference, &gains(), damping);
        let (with, without) = (torque(DAMPING), torque(0.0));
        let damping = with.expect("definite") - without.expect("definite");
        let power = damping.dot(qd);
        let size = 1.0 + with.expect("definite").norm() * qd.norm();
        prop_assert!(power <= 1e-12 * size, "{power} W added");
        Ok(())
    }
    check(takes);
}

/// Equal to the law computed term by term, also near singular poses.
fn is_the_law_in_terms<const N: usize>(case: &Case<N>) -> Outcome {
    let (arm, qd) = (case.arm(), &case.qd);
    let terms = filled(&arm, &case.q, qd);
    let pose = reference(case, &terms);
    let reference = Reference {
        position: pose.base_from_tip.translation,
        velocity: pose.velocity_m_per_s,
        acceleration: pose.acceleration_m_per_s2,
    };
    let gains = gains().linear;
    let law = Law {
        inertial_feedforward: true,
        nullspace_damping_nm_s_per_rad: DAMPING,
        ..Law::as_published(gains)
    };
    let roles = [Role::Active; N];
    let task = Task::new(&terms, &roles).expect("positive definite");
    let now = LawInput {
        spring_limit_n: f64::MAX,
        reference: &reference,
        velocity_rad_per_s: qd,
        gains: &gains,
        tip_force_n: None,
        friction_share: 1.0,
    };
    let apart = impedance(&law, &[Friction::NONE; N], &roles, &terms, &task, &now).total();
    let found = position_torque(&arm, &case.q, qd, &reference, &gains, DAMPING).expect("definite");
    // Both invert a mobility whose condition grows towards singular poses.
    let sigma = task.least_singular_value_m.max(0.02);
    let tolerance = 1e-10 / (sigma / SINGULAR_BELOW_M).min(1.0).powi(4);
    prop_assert!(
        mixed_error(&found, &apart) < tolerance * (1.0 + apart.norm()),
        "{found} {apart}, {sigma} m"
    );
    Ok(())
}

#[test]
fn position_of_3_joints_is_the_law_in_terms() {
    check(is_the_law_in_terms::<3>);
}

#[test]
fn position_of_4_joints_is_the_law_in_terms() {
    check(is_the_law_in_terms::<4>);
}

#[test]
fn position_of_7_joints_is_the_law_in_terms() {
    check(is_the_law_in_terms::<7>);
}

#[test]
fn orientation_error_is_the_sine_along_the_axis() {
    for (axis, angle) in [
        (Vector3::new(1.0, 0.0, 0.0), 0.3),
        (Vector3::new(0.6, 0.0, -0.8), -1.2),
        (Vector3::new(0.0, 1.0, 0.0), 3.0),
    ] {
        let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle);
        let found = Pose::from_xyz_rpy([0.0; 3], [0.4, -0.7, 1.9]).rotation;
        let error = orientation_error(&(turn.matrix() * found), &found);
        assert!((error - axis * angle.sin()).norm() < 1e-15);
    }
    assert_eq!(
        orientation_error(&Matrix3::identity(), &Matrix3::identity()),
        Vector3::zeros()
    );
}

/// Stretched straight, with its axes in one plane, the arm still gets a finite torque.
#[test]
fn singular_poses_have_a_finite_torque() {
    let arm = support::arms::wam7();
    for q in [Vector::<7>::zeros(), Vector::<7>::repeat(1e-9)] {
        let qd = Vector::<7>::repeat(0.3);
        let terms = filled(&arm, &q, &qd);
        let reference = PoseReference {
            acceleration_m_per_s2: Vector3::repeat(1.0),
            angular_acceleration_rad_per_s2: Vector3::repeat(1.0),
            ..PoseReference::at_rest(terms.base_from_tip)
        };
        let tau = pose_torque(&arm, &q, &qd, &reference, &gains(), DAMPING).expect("definite");
        // Bound: gravity, the motion, and accelerating 20 kg at 1 m.
        assert!(tau.norm() < 300.0, "{tau}");
    }
}
