//! With an exact model and no friction, the tip obeys (3.3) to rounding: accelerations by `aba`,
//! with held joints kept at rest by ideal torques.

use crate::support::arms::{wam3, wam4, wam7};
use crate::support::configs::{four, seven};
use crate::support::plant::{held_acceleration, push};
use crate::support::property::{Outcome, check, vector3};
use crate::support::states::{Scene, scene};
use crate::support::{assert_close, inverse};
use proptest::prelude::*;
use supple_core::config::{ApparentInertia, Gains, Law, Role};
use supple_core::dynamics::{crba, jacobian, jacobian_dot_qd};
use supple_core::impedance::SINGULAR_BELOW_M;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Arm, Friction, Matrix, Vector};

fn law(inertia: ApparentInertia) -> Law {
    Law {
        inertia,
        inertial_feedforward: true,
        ..Law::as_published(Gains::isotropic(0.0, 0.0))
    }
}

/// Linear Jacobian, columns of held joints zero.
fn active_jacobian<const N: usize>(arm: &Arm<N>, roles: &[Role; N], q: &Vector<N>) -> Matrix<3, N> {
    let mut j: Matrix<3, N> = jacobian(arm, q).fixed_rows::<3>(0).into_owned();
    for i in (0..N).filter(|i| roles[*i] != Role::Active) {
        j.column_mut(i).fill(0.0);
    }
    j
}

/// `(J H^-1 J^T)^-1` over the active joints.
fn task_inertia<const N: usize>(arm: &Arm<N>, roles: &[Role; N], q: &Vector<N>) -> Matrix3<f64> {
    let mut h = crba(arm, q);
    for i in (0..N).filter(|i| roles[*i] != Role::Active) {
        h.row_mut(i).fill(0.0);
        h.column_mut(i).fill(0.0);
        h[(i, i)] = 1.0;
    }
    let j = active_jacobian(arm, roles, q);
    inverse(&(j * inverse(&h) * j.transpose()))
}

/// Acceleration of the tip under `torque` and the external `force`.
fn tip_acceleration<const N: usize>(
    scene: &Scene<N>,
    arm: &Arm<N>,
    roles: &[Role; N],
    torque: &Vector<N>,
    force: &Vector3<f64>,
) -> Vector3<f64> {
    let (q, qd) = (&scene.q, &scene.qd);
    let pushed = torque + push(arm, q, force);
    let qdd = held_acceleration(arm, roles, q, qd, &pushed);
    jacobian(arm, q).fixed_rows::<3>(0) * qdd + jacobian_dot_qd(arm, q, qd).fixed_rows::<3>(0)
}

/// `K (Xo - X) + B (Xo' - X')`.
fn feedback<const N: usize>(scene: &Scene<N>, arm: &Arm<N>) -> Vector3<f64> {
    let terms = scene.terms(arm);
    let (k, b) = (scene.gains.stiffness_n_per_m, scene.gains.damping_n_s_per_m);
    let tip_velocity = terms.jacobian.fixed_rows::<3>(0) * scene.qd;
    k.component_mul(&(scene.reference.position - terms.base_from_tip.translation))
        + b.component_mul(&(scene.reference.velocity - tip_velocity))
}

/// Returns whether the inverse is undamped in this pose.
fn regular<const N: usize>(scene: &Scene<N>, arm: &Arm<N>, roles: &[Role; N]) -> bool {
    scene.task(arm, roles).min_singular_value_m > SINGULAR_BELOW_M
}

/// Checks `inertia (X'' - Xo'') = force + feedback` for the apparent inertia of `law`.
fn obeys<const N: usize>(
    scene: &Scene<N>,
    arm: &Arm<N>,
    roles: &[Role; N],
    apparent: ApparentInertia,
    measured: Option<Vector3<f64>>,
    inertia: &Matrix3<f64>,
) -> Outcome {
    let frictionless = [Friction::NONE; N];
    for feedforward in [true, false] {
        let law = Law {
            inertial_feedforward: feedforward,
            ..law(apparent)
        };
        let torque = scene
            .torques(&law, &frictionless, arm, roles, measured)
            .total();
        let acceleration = tip_acceleration(scene, arm, roles, &torque, &scene.force_n);
        let wanted = if feedforward {
            scene.reference.acceleration
        } else {
            Vector3::zeros()
        };
        let left = inertia * (acceleration - wanted);
        let right = scene.force_n + feedback(scene, arm);
        let scale = inertia.norm() * (1.0 + acceleration.norm()) + right.norm();
        let error = (left - right).norm() / scale;
        prop_assert!(error < 1e-10, "{error:.1e}: {left} is not {right}");
    }
    Ok(())
}

fn own_inertia<const N: usize>(arm: Arm<N>, roles: [Role; N]) {
    check(300, scene::<N>(), |scene| {
        if !regular(&scene, &arm, &roles) {
            return Ok(());
        }
        let inertia = task_inertia(&arm, &roles, &scene.q);
        obeys(&scene, &arm, &roles, ApparentInertia::Own, None, &inertia)
    });
}

fn mass() -> impl Strategy<Value = Matrix3<f64>> {
    (vector3(1.0), vector3(1.0), vector3(1.0), 0.2..5.0).prop_map(|(a, b, c, min)| {
        let root = Matrix3::from_columns(&[a, b, c]);
        let square = root * root.transpose();
        (square + square.transpose()) * 0.5 + Matrix3::from_diagonal_element(min)
    })
}

fn chosen_inertia<const N: usize>(arm: Arm<N>, roles: [Role; N]) {
    check(300, (scene::<N>(), mass()), |(scene, mass)| {
        if !regular(&scene, &arm, &roles) {
            return Ok(());
        }
        let chosen = ApparentInertia::Chosen(mass);
        obeys(&scene, &arm, &roles, chosen, Some(scene.force_n), &mass)?;
        // Without a force measurement the apparent inertia is the arm's own.
        let own = task_inertia(&arm, &roles, &scene.q);
        obeys(&scene, &arm, &roles, chosen, None, &own)
    });
}

#[test]
fn own_inertia_of_3_active_joints() {
    own_inertia(wam3(), [Role::Active; 3]);
}

#[test]
fn own_inertia_beside_a_held_joint() {
    own_inertia(wam4(), four().roles);
}

#[test]
fn own_inertia_of_4_active_joints() {
    own_inertia(wam4(), [Role::Active; 4]);
}

#[test]
fn own_inertia_of_4_active_joints_before_a_held_wrist() {
    own_inertia(wam7(), seven().roles);
}

#[test]
fn chosen_inertia_of_3_active_joints() {
    chosen_inertia(wam3(), [Role::Active; 3]);
}

#[test]
fn chosen_inertia_beside_a_held_joint() {
    chosen_inertia(wam4(), four().roles);
}

#[test]
fn chosen_inertia_of_4_active_joints() {
    chosen_inertia(wam4(), [Role::Active; 4]);
}

/// A measured force with the choice `M = Lambda` gives the same torque as no measurement.
#[test]
fn choosing_the_arms_own_inertia_does_not_change_the_torque() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    check(200, scene::<3>(), |scene| {
        if !regular(&scene, &arm, &roles) {
            return Ok(());
        }
        let inertia = task_inertia(&arm, &roles, &scene.q);
        let inertia = (inertia + inertia.transpose()) * 0.5;
        let none = [Friction::NONE; 3];
        let with = |inertia, force| {
            scene
                .torques(&law(inertia), &none, &arm, &roles, force)
                .total()
        };
        let own = with(ApparentInertia::Own, None);
        let chosen = with(ApparentInertia::Chosen(inertia), Some(scene.force_n));
        prop_assert!((own - chosen).norm() < 1e-9 * (1.0 + own.norm()));
        Ok(())
    });
}

#[test]
fn the_inverse_of_3_active_joints_is_the_jacobians() {
    let (arm, roles) = (wam3(), [Role::Active; 3]);
    check(300, scene::<3>(), |scene| {
        if !regular(&scene, &arm, &roles) {
            return Ok(());
        }
        let j: Matrix3<f64> = jacobian(&arm, &scene.q).fixed_rows::<3>(0).into_owned();
        let task = scene.task(&arm, &roles);
        prop_assert_eq!(task.jacobian, j);
        prop_assert!((task.inverse - inverse(&j)).norm() < 1e-12 * inverse(&j).norm());
        Ok(())
    });
}

/// With held joints `Jb` is a right inverse of the Jacobian that does not move them.
#[test]
fn the_inverse_does_not_move_held_joints() {
    let (arm, roles) = (wam7(), seven().roles);
    check(200, scene::<7>(), |scene| {
        let task = scene.task(&arm, &roles);
        for i in 4..7 {
            prop_assert_eq!(task.inverse.row(i).norm(), 0.0);
            prop_assert_eq!(task.jacobian.column(i).norm(), 0.0);
        }
        if regular(&scene, &arm, &roles) {
            assert_close(&(task.jacobian * task.inverse), &Matrix3::identity(), 1e-11);
        }
        Ok(())
    });
}
