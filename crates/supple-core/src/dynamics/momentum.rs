//! Generalised momentum and its drift, for the external-torque observer.
//!
//! `p = H qd` obeys `p' = tau + tau_ext - D - G + dT/dq`, with `dT/dq = C^T qd`. Turning joint `i`
//! turns everything beyond it against the velocity that arrives from the base, so
//! `dT/dq_i = -h_i . (S_i x v_i)` with `h_i` the momentum of all that joint `i` carries: one sweep out
//! and one back, no matrix.

use super::{parent_rotations, wrench_to_parent};
use crate::arm::Arm;
use crate::math::{Vector, Vector3};

/// Generalised momentum and kinetic gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum<const N: usize> {
    /// `p = H qd` \[kg m^2/s\].
    pub momentum: Vector<N>,
    /// `dT/dq = C^T qd` \[N m\].
    pub kinetic_gradient: Vector<N>,
}

/// Momentum and kinetic gradient at `q` \[rad\], `qd` \[rad/s\].
pub fn momentum<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Momentum<N> {
    let rotations = parent_rotations(arm, q);
    let mut omegas = [Vector3::zeros(); N];
    let mut velocities = [Vector3::zeros(); N];
    let mut angular = [Vector3::zeros(); N];
    let mut linear = [Vector3::zeros(); N];
    let mut omega = Vector3::zeros();
    let mut velocity = Vector3::zeros();
    for i in 0..N {
        let link = &arm.links[i];
        velocity += omega.cross(&link.parent_from_joint.translation);
        velocity = rotations[i].tr_mul(&velocity);
        omega = rotations[i].tr_mul(&omega);
        omega.z += qd[i];
        omegas[i] = omega;
        velocities[i] = velocity;
        linear[i] = velocity * link.mass + omega.cross(&link.first_moment);
        angular[i] = link.inertia * omega + link.first_moment.cross(&velocity);
    }
    let mut result = Momentum {
        momentum: arm.armature.component_mul(qd),
        kinetic_gradient: Vector::zeros(),
    };
    for i in (0..N).rev() {
        let (l, p, w, v) = (&angular[i], &linear[i], &omegas[i], &velocities[i]);
        result.momentum[i] += l.z;
        result.kinetic_gradient[i] = l.x * w.y - l.y * w.x + p.x * v.y - p.y * v.x;
        if i > 0 {
            let origin = &arm.links[i].parent_from_joint.translation;
            let (up_angular, up_linear) =
                wrench_to_parent(&angular[i], &linear[i], &rotations[i], origin);
            angular[i - 1] += up_angular;
            linear[i - 1] += up_linear;
        }
    }
    result
}
