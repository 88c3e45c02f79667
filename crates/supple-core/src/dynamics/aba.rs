//! Articulated bodies: forward dynamics.

use super::{parent_rotations, wrench_to_parent, z_cross};
use crate::arm::Arm;
use crate::math::{Matrix3, Vector, Vector3, skew};

/// Articulated inertia about the joint frame's origin, `(moment, force) = [A B; B^T C] (alpha, a)`,
/// and the bias wrench.
#[derive(Clone, Copy)]
struct Articulated {
    a: Matrix3<f64>,
    b: Matrix3<f64>,
    c: Matrix3<f64>,
    moment: Vector3<f64>,
    force: Vector3<f64>,
}

/// Joint accelerations \[rad/s^2\] under the torques `tau` \[N m\], without friction.
///
/// `q` \[rad\], `qd` \[rad/s\]. The inverse of [`rnea`](super::rnea).
pub fn aba<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    tau: &Vector<N>,
) -> Vector<N> {
    let rotations = parent_rotations(arm, q);
    // Velocity-dependent part of each joint's acceleration, beside what the parent passes on.
    let mut bias_alpha = [Vector3::zeros(); N];
    let mut bias_accel = [Vector3::zeros(); N];
    let mut omega = Vector3::zeros();
    let mut bodies: [Articulated; N] = core::array::from_fn(|i| {
        let link = &arm.links[i];
        let origin = &link.parent_from_joint.translation;
        bias_accel[i] = rotations[i].tr_mul(&omega.cross(&omega.cross(origin)));
        omega = rotations[i].tr_mul(&omega);
        bias_alpha[i] = -z_cross(&omega) * qd[i];
        omega.z += qd[i];
        Articulated {
            a: link.inertia,
            b: skew(&link.first_moment),
            c: Matrix3::from_diagonal_element(link.mass),
            moment: omega.cross(&(link.inertia * omega)),
            force: omega.cross(&omega.cross(&link.first_moment)),
        }
    });
    let mut u_moment = [Vector3::zeros(); N];
    let mut u_force = [Vector3::zeros(); N];
    let mut inverse_d = [0.0; N];
    let mut drive = [0.0; N];
    for i in (0..N).rev() {
        let body = bodies[i];
        u_moment[i] = body.a.column(2).into_owned();
        u_force[i] = body.b.row(2).transpose();
        inverse_d[i] = 1.0 / (u_moment[i].z + arm.armature[i]);
        drive[i] = tau[i] - body.moment.z;
        if i == 0 {
            break;
        }
        let (um, uf) = (&u_moment[i], &u_force[i]);
        let a = body.a - um * um.transpose() * inverse_d[i];
        let b = body.b - um * uf.transpose() * inverse_d[i];
        let c = body.c - uf * uf.transpose() * inverse_d[i];
        let gain = drive[i] * inverse_d[i];
        let moment = body.moment + a * bias_alpha[i] + b * bias_accel[i] + um * gain;
        let force = body.force + b.tr_mul(&bias_alpha[i]) + c * bias_accel[i] + uf * gain;

        let r = &rotations[i];
        let origin = &arm.links[i].parent_from_joint.translation;
        let p = skew(origin);
        let (a, b, c) = (
            r * a * r.transpose(),
            r * b * r.transpose(),
            r * c * r.transpose(),
        );
        let (moment, force) = wrench_to_parent(&moment, &force, r, origin);
        let pc = p * c;
        let bp = b * p;
        let parent = &mut bodies[i - 1];
        // p is antisymmetric: p b^T = -(b p)^T, and so (b p)^T stands with a minus sign.
        parent.a += a - bp - bp.transpose() - pc * p;
        parent.b += b + pc;
        parent.c += c;
        parent.moment += moment;
        parent.force += force;
    }
    let mut qdd = Vector::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = -arm.gravity;
    for i in 0..N {
        let origin = &arm.links[i].parent_from_joint.translation;
        accel = rotations[i].tr_mul(&(accel + alpha.cross(origin))) + bias_accel[i];
        alpha = rotations[i].tr_mul(&alpha) + bias_alpha[i];
        qdd[i] = (drive[i] - u_moment[i].dot(&alpha) - u_force[i].dot(&accel)) * inverse_d[i];
        alpha.z += qdd[i];
    }
    qdd
}
