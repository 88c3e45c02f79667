//! Recursive Newton-Euler: inverse dynamics, and gravity alone.

use super::{parent_rotations, wrench_to_parent};
use crate::arm::Arm;
use crate::math::{Vector, Vector3};

/// Joint torques that give the accelerations `qdd`: `H qdd + C qd + G` \[N m\], without friction.
///
/// `q` \[rad\], `qd` \[rad/s\], `qdd` \[rad/s^2\]. Eq. (3.1).
pub fn rnea<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    qdd: &Vector<N>,
) -> Vector<N> {
    let rotations = parent_rotations(arm, q);
    let mut moments = [Vector3::zeros(); N];
    let mut forces = [Vector3::zeros(); N];
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut accel = -arm.gravity;
    for i in 0..N {
        let link = &arm.links[i];
        let origin = &link.parent_from_joint.translation;
        accel += alpha.cross(origin) + omega.cross(&omega.cross(origin));
        accel = rotations[i].tr_mul(&accel);
        omega = rotations[i].tr_mul(&omega);
        alpha = rotations[i].tr_mul(&alpha);
        // omega of the parent, crossed with z qd.
        alpha += Vector3::new(omega.y * qd[i], -omega.x * qd[i], qdd[i]);
        omega.z += qd[i];
        let h = &link.first_moment;
        forces[i] = accel * link.mass + alpha.cross(h) + omega.cross(&omega.cross(h));
        moments[i] = link.inertia * alpha + omega.cross(&(link.inertia * omega)) + h.cross(&accel);
    }
    let mut tau = arm.armature.component_mul(qdd);
    for i in (0..N).rev() {
        tau[i] += moments[i].z;
        if i > 0 {
            let origin = &arm.links[i].parent_from_joint.translation;
            let (moment, force) = wrench_to_parent(&moments[i], &forces[i], &rotations[i], origin);
            moments[i - 1] += moment;
            forces[i - 1] += force;
        }
    }
    tau
}

/// Joint torques that hold the arm still against gravity, `G(q)` \[N m\].
pub fn gravity<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Vector<N> {
    let rotations = parent_rotations(arm, q);
    let mut falls = [Vector3::zeros(); N];
    let mut fall = arm.gravity;
    for i in 0..N {
        fall = rotations[i].tr_mul(&fall);
        falls[i] = fall;
    }
    let mut mass = 0.0;
    let mut moment = Vector3::zeros();
    let mut tau = Vector::zeros();
    for i in (0..N).rev() {
        let link = &arm.links[i];
        mass += link.mass;
        moment += link.first_moment;
        tau[i] = moment.y * falls[i].x - moment.x * falls[i].y;
        moment = rotations[i] * moment + link.parent_from_joint.translation * mass;
    }
    tau
}
