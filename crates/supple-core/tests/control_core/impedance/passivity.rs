//! Terms that remove or add energy, in any pose, including singular poses: the section "Passivity" of `docs/theory.md`.

use crate::common::numeric::derivative;
use crate::common::random::{Case, check};
use crate::operational::{coupled_gains, filled, orientation_energy_j};
use crate::support::arms::{wam3, wam4, wam7};
use crate::support::inverse;
use crate::support::plant::{Plant, nothing};
use crate::support::property::Outcome;
use proptest::prelude::*;
use supple_core::config::{Gains, Role};
use supple_core::dynamics::{Terms, jacobian, kinetic_energy, tip_pose};
use supple_core::impedance::{
    LawInput, MAX_TASK_INERTIA_KG_M2, MAX_TASK_MASS_KG, PositionTarget, Target, Task, Torques,
    impedance, singularity_damping_per_kg,
};
use supple_core::linalg::symmetric_eigenvalues;
use supple_core::math::Vector3;
use supple_core::nalgebra::Rotation3;
use supple_core::target::{PoseGains, PoseReference, PoseTarget};
use supple_core::{Arm, Matrix, Pose, Reference, Vector};

/// A task in `D` directions for these tests, whose reference rests or accelerates at `at`.
trait Tip<const D: usize> {
    fn target(&self) -> impl Target<D>;
    fn task<const N: usize>(terms: &Terms<N>) -> Task<N, D>;
    /// Energy of the spring \[J\].
    fn energy_j(&self, tip: &Pose) -> f64;
    /// Diagonal that the law adds to the mobility `a` where the smallest singular value of the position's Jacobian is
    /// `sigma_m`.
    fn added(a: &Matrix<D, D>, sigma_m: f64) -> Vector<D>;
    fn damping(&self) -> Matrix<D, D>;
}

struct Position {
    reference: Reference,
    gains: Gains,
}

impl Tip<3> for Position {
    fn target(&self) -> impl Target<3> {
        PositionTarget {
            reference: &self.reference,
            gains: &self.gains,
            spring_limit_n: f64::MAX,
        }
    }

    fn task<const N: usize>(terms: &Terms<N>) -> Task<N, 3> {
        Task::new(terms, &[Role::Active; N]).expect("positive definite")
    }

    fn energy_j(&self, tip: &Pose) -> f64 {
        let error = self.reference.position - tip.translation;
        0.5 * error.dot(&self.gains.stiffness_n_per_m.component_mul(&error))
    }

    fn added(_: &Matrix<3, 3>, sigma_m: f64) -> Vector<3> {
        Vector::repeat(singularity_damping_per_kg(sigma_m))
    }

    fn damping(&self) -> Matrix<3, 3> {
        Matrix::from_diagonal(&self.gains.damping_n_s_per_m)
    }
}

struct Placed {
    reference: PoseReference,
    gains: PoseGains,
}

impl Tip<6> for Placed {
    fn target(&self) -> impl Target<6> {
        PoseTarget {
            reference: &self.reference,
            gains: &self.gains,
        }
    }

    fn task<const N: usize>(terms: &Terms<N>) -> Task<N, 6> {
        Task::of_pose(terms, &[Role::Active; N]).expect("positive definite")
    }

    fn energy_j(&self, tip: &Pose) -> f64 {
        let wanted = &self.reference.base_from_tip;
        let error = wanted.translation - tip.translation;
        let turn = &self.gains.stiffness_nm_per_rad;
        0.5 * error.dot(&(self.gains.stiffness_n_per_m * error))
            + orientation_energy_j(turn, &wanted.rotation, &tip.rotation)
    }

    fn added(a: &Matrix<6, 6>, _: f64) -> Vector<6> {
        let mut added = Vector::zeros();
        let mut lower = Matrix::<6, 6>::identity();
        let mut pivots = [0.0; 6];
        for i in 0..6 {
            let undamped = a[(i, i)]
                - (0..i)
                    .map(|k| lower[(i, k)] * lower[(i, k)] * pivots[k])
                    .sum::<f64>();
            let max = if i < 3 {
                MAX_TASK_MASS_KG
            } else {
                MAX_TASK_INERTIA_KG_M2
            };
            let x = undamped * max;
            added[i] = if x < 1.0 {
                (1.0 - x * x).powi(2) / max
            } else {
                0.0
            };
            pivots[i] = undamped + added[i];
            assert!(1.0 / pivots[i] < 1.08 * max, "pivot {i}: {}", pivots[i]);
            for j in i + 1..6 {
                let sum: f64 = (0..i)
                    .map(|k| lower[(i, k)] * lower[(j, k)] * pivots[k])
                    .sum();
                lower[(j, i)] = (a[(j, i)] - sum) / pivots[i];
            }
        }
        added
    }

    fn damping(&self) -> Matrix<6, 6> {
        let mut both = Matrix::<6, 6>::zeros();
        both.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&self.gains.damping_n_s_per_m);
        both.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.gains.damping_nm_s_per_rad);
        both
    }
}

/// A reference at a distance from the tip that is derived from the case's accelerations.
fn away<const N: usize>(case: &Case<N>, tip: &Pose) -> Pose {
    let by = Vector3::new(case.qdd[0], case.qdd[1], case.qdd[2]);
    Pose {
        rotation: Rotation3::new(by * 0.1).into_inner() * tip.rotation,
        translation: tip.translation + by * 0.05,
    }
}

fn position<const N: usize>(case: &Case<N>, at: &Pose) -> Position {
    Position {
        reference: Reference {
            acceleration: Vector3::new(case.qdd[2], -case.qdd[0], case.qdd[1]),
            ..Reference::at_rest(away(case, at).translation)
        },
        gains: Gains {
            stiffness_n_per_m: Vector3::new(40.0, 90.0, 20.0),
            damping_n_s_per_m: Vector3::new(8.0, 3.0, 12.0),
        },
    }
}

fn placed<const N: usize>(case: &Case<N>, at: &Pose) -> Placed {
    Placed {
        reference: PoseReference {
            acceleration_m_per_s2: Vector3::new(case.qdd[2], -case.qdd[0], case.qdd[1]),
            angular_acceleration_rad_per_s2: Vector3::new(case.qdd[1], case.qdd[2], case.qdd[0]),
            ..PoseReference::at_rest(away(case, at))
        },
        gains: coupled_gains(),
    }
}

/// The law of a random state, all joints active, with damping and a torque in the null space.
fn torques<P: Tip<D>, const N: usize, const D: usize>(
    tip: &P,
    terms: &Terms<N>,
    qd: &Vector<N>,
    nullspace: (Vector<N>, Option<&Vector<N>>),
) -> Torques<N> {
    let law = LawInput {
        nullspace_damping_nm_s_per_rad: nullspace.0,
        nullspace_torque_nm: nullspace.1,
        ..LawInput::new(tip.target(), qd)
    };
    impedance(&[Role::Active; N], terms, &P::task(terms), &law)
}

/// The case at a pose where `D` directions need as many joints and one direction is lost, to rounding: the root of
/// the Jacobian's determinant over the last joint but one that has one.
fn at_singular_pose<const N: usize>(case: &Case<N>, directions: usize) -> Option<Case<N>> {
    let arm = case.arm();
    for joint in (0..N).rev() {
        let at = |angle: f64| {
            let mut q = case.q;
            q[joint] = angle;
            let j = jacobian(&arm, &q);
            match directions {
                3 => (j.fixed_view::<3, 3>(0, 0).into_owned().determinant(), q),
                _ => (j.fixed_view::<6, 6>(0, 0).into_owned().determinant(), q),
            }
        };
        let grid: Vec<f64> = (0..=40).map(|k| -3.0 + 0.15 * f64::from(k)).collect();
        let crossing = grid.windows(2).find(|w| at(w[0]).0 * at(w[1]).0 < 0.0);
        let Some(&[mut below, mut above]) = crossing else {
            continue;
        };
        let sign = at(below).0.signum();
        while above - below > 1e-15 {
            let middle = 0.5 * (below + above);
            if middle <= below || middle >= above {
                break;
            }
            match at(middle).0.signum() == sign {
                true => below = middle,
                false => above = middle,
            }
        }
        let mut found = case.clone();
        found.q = at(below).1;
        return Some(found);
    }
    None
}

/// The power of stiffness and damping is the power that the spring loses, minus the power that the damper dissipates.
fn exchanges_stored_energy<P: Tip<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    tip: &P,
    q: &Vector<N>,
    qd: &Vector<N>,
) -> Outcome {
    let terms = filled(arm, q, qd);
    let found = torques(tip, &terms, qd, (Vector::zeros(), None));
    let power = found.feedback().dot(qd);
    let stored = derivative(|t| tip.energy_j(&tip_pose(arm, &(q + qd * t))));
    let velocity: Vector<D> = terms.jacobian.fixed_rows::<D>(0) * qd;
    let dissipated = velocity.dot(&(tip.damping() * velocity));
    prop_assert!(dissipated >= 0.0);
    let scale = 1.0 + stored.abs() + dissipated;
    let error = (power - (-stored - dissipated)).abs() / scale;
    prop_assert!(
        error < 1e-7,
        "{power} W, spring {stored} W, damper {dissipated} W"
    );
    Ok(())
}

/// The inertial terms are a force on the tip through the damped mobility, so that a singular direction gets no power.
fn inertial_terms_are_a_bounded_force<P: Tip<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    tip: &P,
    q: &Vector<N>,
    qd: &Vector<N>,
) -> Outcome {
    let terms = filled(arm, q, qd);
    let task = P::task(&terms);
    let found = torques(tip, &terms, qd, (Vector::zeros(), None));
    let mobility = task.jacobian * inverse(&terms.mass_matrix) * task.jacobian.transpose();
    let added = P::added(&mobility, task.min_singular_value_m);
    prop_assert!(added.min() >= 0.0);
    let inertia = inverse(&(mobility + Matrix::from_diagonal(&added)));
    let bias: Vector<D> = terms.jacobian_dot_qd.fixed_rows::<D>(0).into_owned();
    let acceleration = tip.target().acceleration() - bias;
    let torque = found.inertial + found.jacobian_rate;
    let force = inertia * acceleration;
    let gain = inertia.norm() * (1.0 + acceleration.norm()) * (1.0 + terms.jacobian.norm());
    prop_assert!((torque - task.jacobian.tr_mul(&force)).norm() < 1e-7 * gain);
    if D == 3 {
        let [.., greatest] = symmetric_eigenvalues(&inertia.fixed_view::<3, 3>(0, 0).into());
        let sigma = task.min_singular_value_m;
        // The norm is at least the greatest eigenvalue.
        let least = sigma * sigma / terms.mass_matrix.norm() + singularity_damping_per_kg(sigma);
        prop_assert!(
            greatest <= (1.0 + 1e-9) / least,
            "{greatest} kg at {sigma} m"
        );
    }
    let velocity = task.jacobian * qd;
    let bound = inertia.norm() * velocity.norm() * acceleration.norm();
    let power = torque.dot(qd);
    prop_assert!(
        power.abs() <= bound + 1e-7 * gain * (1.0 + qd.norm()),
        "{power} W of {bound} W"
    );
    Ok(())
}

/// In the null space damping only removes energy, a torque has its power on the null-space motion of the joints, and
/// neither is amplified. If no direction is damped, neither has power on the task's motion.
fn nullspace_torque_is_bounded<P: Tip<D>, const N: usize, const D: usize>(
    arm: &Arm<N>,
    tip: &P,
    case: &Case<N>,
) -> Outcome {
    let (q, qd) = (&case.q, &case.qd);
    let terms = filled(arm, q, qd);
    let task = P::task(&terms);
    let nullspace = Matrix::<N, N>::identity() - task.inverse * task.jacobian;
    let free = nullspace * qd;
    let damping = case.q.map(|x| 1.0 + x.abs());
    let pull = case.qdd * 0.3;
    let of =
        |damping, pull: Option<&Vector<N>>| torques(tip, &terms, qd, (damping, pull)).nullspace;
    let scale = 1.0 + (nullspace.norm() * (1.0 + qd.norm()) * (1.0 + pull.norm())).powi(2);

    let power = of(damping, None).dot(qd);
    let dissipated = free.dot(&damping.component_mul(&free));
    prop_assert!(
        (power + dissipated).abs() < 1e-9 * scale,
        "{power} W, {dissipated} W"
    );
    let torque = of(Vector::zeros(), Some(&pull));
    prop_assert!((torque.dot(qd) - pull.dot(&free)).abs() < 1e-9 * scale);

    // As accelerations, weighted with the mass matrix.
    let mobile = inverse(&terms.mass_matrix);
    let (before, after) = (pull.dot(&(mobile * pull)), torque.dot(&(mobile * torque)));
    prop_assert!(
        after <= before * (1.0 + 1e-7) + 1e-9 * scale,
        "{after} from {before}"
    );

    if !task.is_damped && task.inverse.norm() < 1e3 {
        let of_task = task.inverse * (task.jacobian * qd);
        let both = of(damping, Some(&pull));
        let gain = scale * (1.0 + task.inverse.norm() * task.jacobian.norm());
        let of_torque = torque.dot(&of_task);
        prop_assert!(of_torque.abs() < 1e-8 * gain, "{of_torque} W on the task");
        prop_assert!(both.dot(&of_task).abs() < 1e-8 * gain);
    }
    Ok(())
}

fn in_position<const N: usize>(case: &Case<N>) -> Outcome {
    let arm = case.arm();
    let mut near = case.clone();
    near.q *= 1e-6;
    let mut cases = vec![case.clone(), near];
    if N == 3 {
        cases.extend(at_singular_pose(case, 3));
    }
    for case in &cases {
        let tip = position(case, &tip_pose(&arm, &case.q));
        exchanges_stored_energy(&arm, &tip, &case.q, &case.qd)?;
        inertial_terms_are_a_bounded_force(&arm, &tip, &case.q, &case.qd)?;
        if N > 3 {
            nullspace_torque_is_bounded(&arm, &tip, case)?;
        }
    }
    Ok(())
}

fn in_pose<const N: usize>(case: &Case<N>) -> Outcome {
    let arm = case.arm();
    let mut cases = vec![case.clone()];
    if N == 6 {
        cases.extend(at_singular_pose(case, 6));
    }
    for case in &cases {
        let tip = placed(case, &tip_pose(&arm, &case.q));
        exchanges_stored_energy(&arm, &tip, &case.q, &case.qd)?;
        inertial_terms_are_a_bounded_force(&arm, &tip, &case.q, &case.qd)?;
        if N > 6 {
            nullspace_torque_is_bounded(&arm, &tip, case)?;
        }
    }
    Ok(())
}

#[test]
fn position_of_random_arms() {
    check::<3>(in_position);
    check::<4>(in_position);
    check::<7>(in_position);
}

#[test]
fn pose_of_random_arms() {
    check::<6>(in_pose);
    check::<7>(in_pose);
}

/// The poses that [`at_singular_pose`] finds lose a direction to rounding, and most arms have one.
#[test]
fn random_arms_have_exactly_singular_poses() {
    use std::sync::atomic::{AtomicU32, Ordering};
    static FOUND: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
    check::<3>(|case| {
        if let Some(found) = at_singular_pose(case, 3) {
            let terms = filled(&found.arm(), &found.q, &found.qd);
            let task = Position::task(&terms);
            // The root of an eigenvalue of J Jᵀ, which rounds as the square of J does.
            let rounding = 10.0 * f64::EPSILON.sqrt() * task.jacobian.norm();
            let sigma = task.min_singular_value_m;
            prop_assert!(sigma < rounding, "{sigma} m, rounding {rounding} m");
            FOUND[0].fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    });
    check::<6>(|case| {
        if let Some(found) = at_singular_pose(case, 6) {
            let terms = filled(&found.arm(), &found.q, &found.qd);
            prop_assert!(Placed::task(&terms).is_damped);
            FOUND[1].fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    });
    for found in &FOUND {
        let found = found.load(Ordering::Relaxed);
        assert!(found > 100, "{found} of 200 arms");
    }
}

/// Exactly singular poses of the WAM: stretched out, stretched up, folded back; all axes of the wrist aligned.
#[test]
fn singular_poses_of_the_wam() {
    check::<7>(|case| {
        for elbow in [0.0, std::f64::consts::PI] {
            for pitch in [0.0, std::f64::consts::FRAC_PI_2] {
                let mut at = case.clone();
                at.q = Vector::from([case.q[0], pitch, 0.0, elbow, case.q[4], 0.0, case.q[6]]);
                let tip = position(&at, &tip_pose(&wam7(), &at.q));
                exchanges_stored_energy(&wam7(), &tip, &at.q, &at.qd)?;
                inertial_terms_are_a_bounded_force(&wam7(), &tip, &at.q, &at.qd)?;
                nullspace_torque_is_bounded(&wam7(), &tip, &at)?;
                let tip = placed(&at, &tip_pose(&wam7(), &at.q));
                // Folded back to the side, the arm can still move and turn its tip in all directions.
                let may_be_regular = elbow != 0.0 && pitch != 0.0;
                let task = Placed::task(&filled(&wam7(), &at.q, &at.qd));
                prop_assert!(task.is_damped || may_be_regular);
                exchanges_stored_energy(&wam7(), &tip, &at.q, &at.qd)?;
                inertial_terms_are_a_bounded_force(&wam7(), &tip, &at.q, &at.qd)?;
                nullspace_torque_is_bounded(&wam7(), &tip, &at)?;
            }
        }
        Ok(())
    });
}

/// Results of a simulated run.
struct Run<const N: usize> {
    /// Kinetic energy of the arm and energy of the spring: initial, maximum and final \[J\].
    start_j: f64,
    max_j: f64,
    end_j: f64,
    /// Smallest singular value of the position's Jacobian during the run \[m\].
    min_sigma_m: f64,
    /// Whether the inverse was damped in some cycle.
    damped: bool,
    q: Vector<N>,
}

/// The arm without friction under the law at 1 kHz, from `q` and `qd`.
fn simulate<P: Tip<D>, const N: usize, const D: usize>(
    arm: Arm<N>,
    tip: &P,
    (q, qd): (Vector<N>, Vector<N>),
    nullspace_damping_nm_s_per_rad: f64,
    seconds: u32,
) -> Run<N> {
    let mut plant = Plant::at_rest(arm, q);
    plant.qd = qd;
    let energy_j = |plant: &Plant<N>| {
        kinetic_energy(&plant.arm, &plant.q, &plant.qd)
            + tip.energy_j(&tip_pose(&plant.arm, &plant.q))
    };
    let start_j = energy_j(&plant);
    let (mut max_j, mut min_sigma_m, mut damped) = (start_j, f64::MAX, false);
    for _ in 0..1000 * seconds {
        let terms = filled(&plant.arm, &plant.q, &plant.qd);
        let task = P::task(&terms);
        min_sigma_m = task.min_singular_value_m.min(min_sigma_m);
        damped |= task.is_damped;
        let damping = Vector::repeat(nullspace_damping_nm_s_per_rad);
        let torque = torques(tip, &terms, &plant.qd, (damping, None)).total();
        plant.advance(&torque, nothing, 1e-3, 2);
        max_j = energy_j(&plant).max(max_j);
    }
    Run {
        start_j,
        max_j,
        end_j: energy_j(&plant),
        min_sigma_m,
        damped,
        q: plant.q,
    }
}

impl<const N: usize> Run<N> {
    /// The terms that cancel the arm's own velocity products add energy while the tip moves towards poses with a greater
    /// effective mass; damping removes this energy again.
    #[track_caller]
    fn is_bounded(&self) {
        let Run {
            start_j,
            max_j,
            end_j,
            min_sigma_m,
            damped,
            q,
        } = self;
        let text = format!("{start_j} J, at most {max_j} J, then {end_j} J, {min_sigma_m} m, {q}");
        assert!(*damped, "not near a singular pose: {text}");
        assert!(*max_j < 2.0 * start_j, "{text}");
        assert!(end_j < start_j, "{text}");
    }
}

/// Beyond the arm's reach, outwards and upwards.
const PULLS_M: [[f64; 3]; 2] = [[0.6, 0.0, 0.0], [0.0, 0.0, 0.5]];

/// Pulled beyond its reach, the arm comes to rest stretched out, in a singular pose.
#[test]
fn energy_is_bounded_where_a_position_leads_into_a_singular_pose() {
    fn pulled<const N: usize>(arm: Arm<N>, (q, qd): (Vector<N>, Vector<N>), damping: f64) {
        for pull in PULLS_M {
            for speed in [0.5, 2.0] {
                let tip = Position {
                    reference: Reference::at_rest(
                        tip_pose(&arm, &q).translation + Vector3::from(pull),
                    ),
                    gains: Gains::isotropic(50.0, 8.0),
                };
                let run = simulate(arm, &tip, (q, qd * speed), damping, 8);
                run.is_bounded();
                assert!(run.min_sigma_m < 1e-3, "{} m", run.min_sigma_m);
            }
        }
    }
    let three = (
        Vector::<3>::new(0.2, 0.6, 0.8),
        Vector::<3>::new(0.1, 0.0, -1.0),
    );
    pulled(wam3(), three, 0.0);
    let four = (
        Vector::<4>::new(0.2, 0.6, 0.2, 0.8),
        Vector::<4>::new(0.1, 0.0, 0.2, -1.0),
    );
    pulled(wam4(), four, 1.0);
}
