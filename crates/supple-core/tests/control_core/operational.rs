//! Both forms of the law, for position and pose: the resulting accelerations of the tip, and the sum
//! beside the total of the terms.

use crate::common::numeric::mixed_error;
use crate::common::random::{Case, check};
use crate::support::configs::{friction, held};
use crate::support::plant::held_acceleration;
use crate::support::{self, inverse};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use supple_core::config::{FrictionVelocity, Gains, Role};
use supple_core::dynamics::{Terms, crba, terms};
use supple_core::impedance::{
    ChosenInertia, LawInput, MAX_TASK_INERTIA_KG_M2, MAX_TASK_MASS_KG, PositionTarget, Posture,
    SINGULAR_BELOW_M, Target, Task, Torques, impedance,
};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::{Rotation3, Unit};
use supple_core::target::{PoseGains, PoseReference, PoseTarget, orientation_torque};
use supple_core::{Arm, Matrix, Pose, Reference, Vector, impedance_torque};

type Outcome = Result<(), TestCaseError>;

const DAMPING: f64 = 1.7;

pub fn filled<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Terms<N> {
    let mut filled = Terms::default();
    terms(arm, q, qd, &mut filled);
    filled
}

/// With coupled axes.
pub fn coupled_gains() -> PoseGains {
    let coupled = |diagonal: [f64; 3], by: f64| {
        let axes = Pose::from_xyz_rpy([0.0; 3], [0.3 * by, -0.5, by]).rotation;
        let gain = axes * Matrix3::from_diagonal(&Vector3::from(diagonal)) * axes.transpose();
        (gain + gain.transpose()) * 0.5
    };
    let gains = PoseGains {
        stiffness_n_per_m: coupled([40.0, 90.0, 20.0], 0.4),
        damping_n_s_per_m: coupled([8.0, 3.0, 12.0], 1.1),
        stiffness_nm_per_rad: coupled([4.0, 0.0, 6.0], -0.7),
        damping_nm_s_per_rad: coupled([0.4, 0.7, 0.2], 0.2),
    };
    assert!(gains.is_passive());
    gains
}

fn position_gains() -> Gains {
    Gains {
        stiffness_n_per_m: Vector3::new(40.0, 90.0, 20.0),
        damping_n_s_per_m: Vector3::new(8.0, 3.0, 12.0),
    }
}

/// All active; or the last joint held, or joints of which `active` are left.
fn roles<const N: usize>(active: usize) -> [Role; N] {
    std::array::from_fn(|i| match i < active {
        true => Role::Active,
        false => held(0.0),
    })
}

fn damped<T, const N: usize, const D: usize>(
    target: T,
    qd: &Vector<N>,
    damping: f64,
) -> LawInput<'_, T, N, D> {
    LawInput {
        nullspace_damping_nm_s_per_rad: Vector::repeat(damping),
        ..LawInput::new(target, qd)
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

/// Returns whether the inverse of the pose's mobility is undamped.
fn regular(mobility: &Matrix<6, 6>) -> bool {
    let felt = inverse(mobility).diagonal();
    felt.fixed_rows::<3>(0).max() < MAX_TASK_MASS_KG
        && felt.fixed_rows::<3>(3).max() < MAX_TASK_INERTIA_KG_M2
}

/// The tip accelerates with the reference, plus the force of spring and damper through its own
/// mobility: in both forms, and beside held joints.
fn tip_moves_as_stated<const N: usize>(case: &Case<N>, active: usize) -> Outcome {
    let (arm, q, qd) = (case.arm(), &case.q, &case.qd);
    let roles = roles::<N>(active);
    let terms = filled(&arm, q, qd);
    let task = Task::of_pose(&terms, &roles).expect("positive definite");
    let mut mass_matrix = crba(&arm, q);
    for i in active..N {
        mass_matrix.row_mut(i).fill(0.0);
        mass_matrix.column_mut(i).fill(0.0);
        mass_matrix[(i, i)] = 1.0;
    }
    let mobility = task.jacobian * inverse(&mass_matrix) * task.jacobian.transpose();
    if mobility.symmetric_eigenvalues().min() < 1e-3 || !regular(&mobility) {
        return Ok(());
    }
    let (reference, gains) = (reference(case, &terms), coupled_gains());
    let target = PoseTarget {
        reference: &reference,
        gains: &gains,
    };
    let law = damped(target, qd, DAMPING);
    let sum = impedance_torque(&arm, &roles, q, &law).expect("positive definite");
    let apart = impedance(&roles, &terms, &task, &law);

    let now = &terms.base_from_tip;
    let relative = Rotation3::from_matrix_unchecked(
        reference.base_from_tip.rotation * now.rotation.transpose(),
    );
    let turn = relative.axis().map_or(Vector3::zeros(), |axis| {
        let (pull, angle) = (gains.stiffness_nm_per_rad * *axis, relative.angle());
        pull * angle.sin() + pull.cross(&axis) * (1.0 - angle.cos())
    });
    let error = reference.base_from_tip.translation - now.translation;
    let velocity = terms.jacobian * qd;
    let linear = reference.velocity_m_per_s - velocity.fixed_rows::<3>(0);
    let angular = reference.angular_velocity_rad_per_s - velocity.fixed_rows::<3>(3);
    let spring = pair(&(gains.stiffness_n_per_m * error), &turn);
    let damper = pair(
        &(gains.damping_n_s_per_m * linear),
        &(gains.damping_nm_s_per_rad * angular),
    );
    prop_assert!(mixed_error(&apart.stiffness, &task.jacobian.tr_mul(&spring)) < 1e-12);
    prop_assert!(mixed_error(&apart.damping, &task.jacobian.tr_mul(&damper)) < 1e-12);
    let expected = pair(
        &reference.acceleration_m_per_s2,
        &reference.angular_acceleration_rad_per_s2,
    ) + mobility * (spring + damper);
    let scale = 1.0 + expected.norm() + mobility.norm();
    for tau in [sum, apart.total()] {
        let found =
            terms.jacobian * held_acceleration(&arm, &roles, q, qd, &tau) + terms.jacobian_dot_qd;
        prop_assert!(
            (found - expected).norm() < 1e-8 * scale,
            "{found} {expected}"
        );
    }
    Ok(())
}

#[test]
fn tip_of_6_joints_moves_as_stated() {
    check::<6>(|case| tip_moves_as_stated(case, 6));
}

#[test]
fn tip_of_7_joints_moves_as_stated() {
    check::<7>(|case| tip_moves_as_stated(case, 7));
}

#[test]
fn tip_of_7_joints_moves_as_stated_beside_one_that_is_held() {
    check::<7>(|case| tip_moves_as_stated(case, 6));
}

#[test]
fn a_pose_takes_six_active_joints() {
    check::<7>(|case| {
        let (arm, roles) = (case.arm(), roles::<7>(5));
        let terms = filled(&arm, &case.q, &case.qd);
        let (reference, gains) = (reference(case, &terms), coupled_gains());
        let target = PoseTarget {
            reference: &reference,
            gains: &gains,
        };
        let law = LawInput::new(target, &case.qd);
        prop_assert!(Task::of_pose(&terms, &roles).is_none());
        prop_assert!(impedance_torque(&arm, &roles, &case.q, &law).is_none());
        Ok(())
    });
}

/// Motion that does not change the pose is damped; the damping never adds energy, also in singular
/// poses.
#[test]
fn null_space_damping_of_the_pose_only_removes_energy() {
    fn takes(case: &Case<7>) -> Outcome {
        let (arm, qd) = (case.arm(), &case.qd);
        let terms = filled(&arm, &case.q, qd);
        let (reference, gains, roles) = (reference(case, &terms), coupled_gains(), roles::<7>(7));
        let target = PoseTarget {
            reference: &reference,
            gains: &gains,
        };
        let torque =
            |damping| impedance_torque(&arm, &roles, &case.q, &damped(target, qd, damping));
        let (with, without) = (torque(DAMPING), torque(0.0));
        let damping = with.expect("definite") - without.expect("definite");
        let power = damping.dot(qd);
        let size = 1.0 + with.expect("definite").norm() * qd.norm();
        prop_assert!(power <= 1e-12 * size, "{power} W added");
        Ok(())
    }
    check(takes);
}

/// The sum beside the total of the terms.
fn agree<const N: usize, const D: usize>(
    sum: &Vector<N>,
    apart: &Torques<N>,
    task: &Task<N, D>,
    terms: &Terms<N>,
) -> Outcome {
    let total = apart.total();
    // The sum adds up what the inverse multiplies, before the terms of opposite signs cancel.
    let gain = 1.0 + task.inverse.norm() * (task.jacobian.norm() + terms.mass_matrix.norm());
    let size: f64 = apart.named().iter().map(|(_, term)| term.norm()).sum();
    let error = (sum - total).norm();
    prop_assert!(
        error < 1e-12 * gain * (1.0 + size),
        "{error:e}, {gain} {size}"
    );
    Ok(())
}

/// The law with all its optional terms: friction, a posture, a chosen inertia.
fn compare<T: Target<D> + Copy, const N: usize, const D: usize>(
    case: &Case<N>,
    roles: &[Role; N],
    target: T,
    terms: &Terms<N>,
    task: &Task<N, D>,
) -> Outcome {
    let arm = case.arm();
    let (friction, plain) = (friction::<N>(), damped(target, &case.qd, DAMPING));
    let posture = Posture {
        position_rad: Vector::zeros(),
        stiffness_nm_per_rad: Vector::repeat(3.0),
        max_torque_nm: Vector::repeat(2.0),
    }
    .torque_nm(&case.q);
    let inertia = Matrix::<D, D>::from_fn(|i, j| if i == j { 3.0 + i as f64 } else { 0.2 });
    let force = Vector::from_fn(|i, _| 4.0 - 2.0 * i as f64);
    let apparent = ChosenInertia::new(&inertia, force);
    assert!(apparent.is_some());
    let at = |velocity| Some((&friction, velocity));
    let laws = [
        plain,
        LawInput {
            friction: at(FrictionVelocity::Measured),
            friction_share: 0.4,
            inertial_feedforward: false,
            ..plain
        },
        LawInput {
            apparent,
            friction: at(FrictionVelocity::Reference),
            nullspace_torque_nm: Some(&posture),
            ..plain
        },
    ];
    for law in laws {
        let sum = impedance_torque(&arm, roles, &case.q, &law).expect("positive definite");
        agree(&sum, &impedance(roles, terms, task, &law), task, terms)?;
    }
    Ok(())
}

/// At random states, and at states near singular poses.
fn near_and_away<const N: usize>(case: &Case<N>, of: impl Fn(&Case<N>) -> Outcome) -> Outcome {
    let mut near = case.clone();
    near.q *= 1e-3;
    of(case)?;
    of(&near)
}

fn position_sum_is_the_total<const N: usize>(case: &Case<N>, active: usize) -> Outcome {
    near_and_away(case, |case| {
        let terms = filled(&case.arm(), &case.q, &case.qd);
        let pose = reference(case, &terms);
        let reference = Reference {
            position: pose.base_from_tip.translation,
            velocity: pose.velocity_m_per_s,
            acceleration: pose.acceleration_m_per_s2,
        };
        let (gains, roles) = (position_gains(), roles::<N>(active));
        let target = PositionTarget {
            reference: &reference,
            gains: &gains,
            spring_limit_n: 2.0,
        };
        let task = Task::new(&terms, &roles).expect("positive definite");
        compare(case, &roles, target, &terms, &task)?;
        let law = damped(target, &case.qd, DAMPING);
        let apart = impedance(&roles, &terms, &task, &law).total();
        let sum = impedance_torque(&case.arm(), &roles, &case.q, &law).expect("definite");
        // Both invert a mobility whose condition grows towards singular poses.
        let sigma = task.min_singular_value_m.max(0.02);
        let tolerance = 1e-10 / (sigma / SINGULAR_BELOW_M).min(1.0).powi(4);
        prop_assert!(
            mixed_error(&sum, &apart) < tolerance * (1.0 + apart.norm()),
            "{sum} {apart}, {sigma} m"
        );
        Ok(())
    })
}

fn pose_sum_is_the_total<const N: usize>(case: &Case<N>, active: usize) -> Outcome {
    near_and_away(case, |case| {
        let terms = filled(&case.arm(), &case.q, &case.qd);
        let (reference, gains) = (reference(case, &terms), coupled_gains());
        let roles = roles::<N>(active);
        let target = PoseTarget {
            reference: &reference,
            gains: &gains,
        };
        let task = Task::of_pose(&terms, &roles).expect("positive definite");
        compare(case, &roles, target, &terms, &task)
    })
}

#[test]
fn position_of_3_joints_is_the_law_in_terms() {
    check::<3>(|case| position_sum_is_the_total(case, 3));
}

#[test]
fn position_of_4_joints_is_the_law_in_terms() {
    check::<4>(|case| position_sum_is_the_total(case, 4));
}

#[test]
fn position_of_7_joints_is_the_law_in_terms() {
    check::<7>(|case| position_sum_is_the_total(case, 7));
}

#[test]
fn position_beside_held_joints_is_the_law_in_terms() {
    check::<3>(|case| position_sum_is_the_total(case, 2));
    check::<4>(|case| position_sum_is_the_total(case, 3));
    check::<7>(|case| position_sum_is_the_total(case, 4));
}

#[test]
fn pose_of_7_joints_is_the_law_in_terms() {
    check::<7>(|case| pose_sum_is_the_total(case, 7));
}

#[test]
fn pose_beside_a_held_joint_is_the_law_in_terms() {
    check::<7>(|case| pose_sum_is_the_total(case, 6));
}

/// The torque towards a posture is bounded and does not accelerate the tip.
#[test]
fn a_posture_does_no_work_at_the_tip() {
    check::<7>(|case| {
        let (arm, qd) = (case.arm(), Vector::zeros());
        let terms = filled(&arm, &case.q, &qd);
        let roles = roles::<7>(7);
        let task = Task::of_pose(&terms, &roles).expect("positive definite");
        let mobile = inverse(&terms.mass_matrix);
        let mobility = task.jacobian * mobile * task.jacobian.transpose();
        if mobility.symmetric_eigenvalues().min() < 1e-3 || !regular(&mobility) {
            return Ok(());
        }
        let posture = Posture {
            position_rad: case.q.map(|q| 0.5 * q),
            stiffness_nm_per_rad: Vector::repeat(3.0),
            max_torque_nm: Vector::repeat(1.5),
        };
        let pull = posture.torque_nm(&case.q);
        for i in 0..7 {
            prop_assert_eq!(pull[i], (-1.5 * case.q[i]).clamp(-1.5, 1.5));
        }
        let (reference, gains) = (PoseReference::at_rest(terms.base_from_tip), coupled_gains());
        let target = PoseTarget {
            reference: &reference,
            gains: &gains,
        };
        let law = LawInput {
            nullspace_torque_nm: Some(&pull),
            ..LawInput::new(target, &qd)
        };
        let torque = impedance(&roles, &terms, &task, &law).nullspace;
        let tip = task.jacobian * mobile * torque;
        let scale = (task.jacobian * mobile * pull).norm() + mobility.norm() * pull.norm();
        prop_assert!(tip.norm() < 1e-9 * (1.0 + scale), "{tip}");
        // It moves the joints towards the posture, if at all.
        prop_assert!((mobile * torque).dot(&pull) > -1e-9 * (1.0 + scale));
        Ok(())
    });
}

#[test]
fn gains_that_could_add_energy_are_not_passive() {
    let mut asymmetric = coupled_gains();
    asymmetric.damping_n_s_per_m[(0, 1)] += 0.1;
    let mut negative = coupled_gains();
    negative.stiffness_nm_per_rad -= Matrix3::identity() * 0.01;
    let mut unknown = coupled_gains();
    unknown.stiffness_n_per_m[(2, 2)] = f64::NAN;
    for gains in [asymmetric, negative, unknown] {
        assert!(!gains.is_passive());
    }
}

#[test]
fn the_torque_of_equal_stiffness_is_the_sine_of_the_angle_along_the_axis() {
    let stiffness = Matrix3::from_diagonal_element(2.0);
    for (axis, angle) in [
        (Vector3::new(1.0, 0.0, 0.0), 0.3),
        (Vector3::new(0.6, 0.0, -0.8), -1.2),
        (Vector3::new(0.0, 1.0, 0.0), 3.0),
    ] {
        let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle);
        let found = Pose::from_xyz_rpy([0.0; 3], [0.4, -0.7, 1.9]).rotation;
        let torque = orientation_torque(&stiffness, &(turn.matrix() * found), &found);
        assert!((torque - axis * (2.0 * angle.sin())).norm() < 1e-14);
    }
    let resting = Pose::from_xyz_rpy([0.0; 3], [0.4, -0.7, 1.9]).rotation;
    assert!(orientation_torque(&stiffness, &resting, &resting).norm() < 1e-15);
}

/// Energy of coupled stiffness `K` about the axes: `(1 - cos(angle)) a^T K a`.
pub fn orientation_energy_j(
    stiffness: &Matrix3<f64>,
    wanted: &Matrix3<f64>,
    found: &Matrix3<f64>,
) -> f64 {
    let turn = Rotation3::from_matrix_unchecked(wanted * found.transpose());
    turn.axis().map_or(0.0, |axis| {
        (1.0 - turn.angle().cos()) * axis.dot(&(stiffness * *axis))
    })
}

/// The work of the torque while the tip rotates equals the decrease of the energy, up to 179 degrees of error and for coupled
/// axes.
#[test]
fn the_torque_of_an_orientation_is_the_gradient_of_its_energy() {
    let turn = |axis: Vector3<f64>, angle: f64| {
        *Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle).matrix()
    };
    let stiffness = coupled_gains().stiffness_nm_per_rad;
    let wanted = Pose::from_xyz_rpy([0.0; 3], [0.4, -0.7, 1.9]).rotation;
    for degrees in [1.0_f64, 40.0, 90.0, 100.0, 170.0, 179.0] {
        for axis in [[1.0, 0.0, 0.0], [0.3, -0.5, 0.8], [-0.7, 0.7, 0.1]] {
            let found = turn(Vector3::from(axis), -degrees.to_radians()) * wanted;
            let torque = orientation_torque(&stiffness, &wanted, &found);
            for along in 0..3 {
                let mut direction = Vector3::zeros();
                direction[along] = 1.0;
                let energy = |by: f64| {
                    orientation_energy_j(&stiffness, &wanted, &(turn(direction, by) * found))
                };
                let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
                let pull = torque[along];
                assert!((slope + pull).abs() < 1e-7, "{degrees}: {slope} {pull}");
            }
        }
    }
}

/// An arm that is stretched straight, with its axes in one plane, gets a finite torque.
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
        let gains = coupled_gains();
        let target = PoseTarget {
            reference: &reference,
            gains: &gains,
        };
        let law = damped(target, &qd, DAMPING);
        let tau = impedance_torque(&arm, &[Role::Active; 7], &q, &law).expect("definite");
        // Bound: gravity, the motion, and accelerating 20 kg at 1 m.
        assert!(tau.norm() < 300.0, "{tau}");
    }
}
