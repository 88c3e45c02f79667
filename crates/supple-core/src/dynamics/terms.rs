//! Everything that the impedance law needs, in one sweep out and one back.

use super::kinematics::jacobian_of;
use super::{Composite, parent_rotations, wrench_to_parent};
use crate::arm::Arm;
use crate::math::{Matrix, Vector, Vector3};
use crate::pose::Pose;

/// What [`terms`] fills.
#[derive(Clone, Copy, Debug)]
pub struct Terms<const N: usize> {
    // Depends on position.
    /// Pose of the tip in the base.
    pub base_from_tip: Pose,
    /// Tip Jacobian `J`, linear rows first, base axes.
    pub jacobian: Matrix<6, N>,
    /// Mass matrix `H` with rotor inertias \[kg m^2\].
    pub mass_matrix: Matrix<N, N>,
    /// Gravity torque `G` \[N m\].
    pub gravity: Vector<N>,
    // Depends on velocity too.
    /// `C qd + G` \[N m\].
    pub coriolis_gravity: Vector<N>,
    /// `J' qd`, classical acceleration of the tip at `qdd = 0` \[m/s^2, rad/s^2\].
    pub jacobian_dot_qd: Vector<6>,
    /// Generalised momentum `p = H qd` \[kg m^2/s\].
    pub momentum: Vector<N>,
    /// `dT/dq = C^T qd` \[N m\].
    pub kinetic_gradient: Vector<N>,
}

impl<const N: usize> Default for Terms<N> {
    fn default() -> Self {
        Terms {
            base_from_tip: Pose::IDENTITY,
            jacobian: Matrix::zeros(),
            mass_matrix: Matrix::zeros(),
            gravity: Vector::zeros(),
            coriolis_gravity: Vector::zeros(),
            jacobian_dot_qd: Vector::zeros(),
            momentum: Vector::zeros(),
            kinetic_gradient: Vector::zeros(),
        }
    }
}

/// Motion of one joint frame and the wrenches it collects, in that frame.
#[derive(Clone, Copy)]
struct Sweep {
    omega: Vector3<f64>,
    velocity: Vector3<f64>,
    moment: Vector3<f64>,
    force: Vector3<f64>,
    angular: Vector3<f64>,
    linear: Vector3<f64>,
    fall: Vector3<f64>,
}

/// Fills `out` for the state `q` \[rad\], `qd` \[rad/s\].
pub fn terms<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>, out: &mut Terms<N>) {
    let rotations = parent_rotations(arm, q);
    let mut pose = Pose::IDENTITY;
    let mut poses = [Pose::IDENTITY; N];
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = -arm.gravity;
    let mut velocity = Vector3::zeros();
    let mut fall = arm.gravity;
    let mut sweeps: [Sweep; N] = core::array::from_fn(|i| {
        let link = &arm.links[i];
        let origin = &link.parent_from_joint.translation;
        pose = Pose {
            rotation: pose.rotation * rotations[i],
            translation: pose.transform_point(origin),
        };
        poses[i] = pose;
        let swing = omega.cross(origin);
        accel += alpha.cross(origin) + omega.cross(&swing);
        velocity += swing;
        accel = rotations[i].tr_mul(&accel);
        velocity = rotations[i].tr_mul(&velocity);
        fall = rotations[i].tr_mul(&fall);
        omega = rotations[i].tr_mul(&omega);
        alpha = rotations[i].tr_mul(&alpha);
        alpha += Vector3::new(omega.y * qd[i], -omega.x * qd[i], 0.0);
        omega.z += qd[i];
        let h = &link.first_moment;
        let spin = omega.cross(h);
        let angular = link.inertia * omega;
        Sweep {
            omega,
            velocity,
            force: accel * link.mass + alpha.cross(h) + omega.cross(&spin),
            moment: link.inertia * alpha + omega.cross(&angular) + h.cross(&accel),
            linear: velocity * link.mass + spin,
            angular: angular + h.cross(&velocity),
            fall,
        }
    });

    let to_tip = &arm.joint_from_tip.translation;
    let tip_accel = accel + alpha.cross(to_tip) + omega.cross(&omega.cross(to_tip)) + fall;
    let (tip_accel, tip_alpha) = (pose.rotation * tip_accel, pose.rotation * alpha);
    out.base_from_tip = pose * arm.joint_from_tip;
    out.jacobian = jacobian_of(&poses, &out.base_from_tip.translation);
    out.jacobian_dot_qd
        .fixed_rows_mut::<3>(0)
        .copy_from(&tip_accel);
    out.jacobian_dot_qd
        .fixed_rows_mut::<3>(3)
        .copy_from(&tip_alpha);

    let mut composites: [Composite; N] = core::array::from_fn(|i| Composite::of(&arm.links[i]));
    out.mass_matrix = Matrix::from_diagonal(&arm.armature);
    for j in (0..N).rev() {
        let here = sweeps[j];
        let composite = composites[j];
        let (h, fall) = (&composite.first_moment, &here.fall);
        out.gravity[j] = h.y * fall.x - h.x * fall.y;
        out.coriolis_gravity[j] = here.moment.z;
        out.momentum[j] = here.angular.z + arm.armature[j] * qd[j];
        out.kinetic_gradient[j] = here.angular.x * here.omega.y - here.angular.y * here.omega.x
            + here.linear.x * here.velocity.y
            - here.linear.y * here.velocity.x;

        let (mut moment, mut force) = composite.unit_wrench();
        out.mass_matrix[(j, j)] += moment.z;
        for i in (0..j).rev() {
            let origin = &arm.links[i + 1].parent_from_joint.translation;
            (moment, force) = wrench_to_parent(&moment, &force, &rotations[i + 1], origin);
            out.mass_matrix[(i, j)] = moment.z;
            out.mass_matrix[(j, i)] = moment.z;
        }
        if j > 0 {
            let origin = &arm.links[j].parent_from_joint.translation;
            composites[j - 1].add(&composite, &rotations[j], origin);
            let parent = &mut sweeps[j - 1];
            let (moment, force) =
                wrench_to_parent(&here.moment, &here.force, &rotations[j], origin);
            parent.moment += moment;
            parent.force += force;
            let (angular, linear) =
                wrench_to_parent(&here.angular, &here.linear, &rotations[j], origin);
            parent.angular += angular;
            parent.linear += linear;
        }
    }
}
