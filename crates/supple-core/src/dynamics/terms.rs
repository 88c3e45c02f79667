//! Everything that the impedance law needs, in one sweep out and one back.

use super::chain::Chain;
use super::crba::mass_matrix;
use super::frames::{bodies, joint_motions, matrix};
use super::inertia::weight_on;
use super::motion::{Motion, split};
use super::vec3::dot6;
use crate::arm::Arm;
use crate::lanes::{for_each_joint, in_groups, per_joint, splat, sums_inward};
use crate::math::{Matrix, Vector};
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

/// Fills `out` for the state `q` \[rad\], `qd` \[rad/s\].
#[inline]
pub fn terms<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>, out: &mut Terms<N>) {
    in_groups!(N, fill(arm, q, qd, out));
}

/// In a caller that reads some of the terms only, the compiler leaves out what the others need.
#[inline(always)]
pub(crate) fn fill<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    out: &mut Terms<N>,
) {
    let chain = Chain::<G>::new(arm, q);
    let motions = joint_motions(&chain);
    let bodies = bodies(arm, &chain);
    out.base_from_tip = chain.tip.pose();
    out.jacobian = matrix(&motions);

    let gravity = arm.gravity.data.0[0];
    let motion = Motion::<G>::new(&motions, qd, gravity);
    out.jacobian_dot_qd = motion.tip_drift::<N>(gravity);
    let held = sums_inward(motion.forces(&bodies));
    let carried = sums_inward(bodies);
    let falls = splat(gravity);
    let [weight] = for_each_joint(&motions, &carried, &[], |axis, body, []| {
        [weight_on(axis, body, falls)]
    });
    let [torque, momentum, gradient] =
        for_each_joint(&motions, &motion.rates, &held, |axis, rate, held| {
            let (force, momentum) = split(held);
            [
                dot6(axis, force),
                dot6(axis, momentum),
                dot6(rate, momentum),
            ]
        });
    out.gravity = Vector::from(per_joint(&weight));
    out.coriolis_gravity = Vector::from(per_joint(&torque));
    out.momentum = Vector::from(per_joint(&momentum)) + arm.armature.component_mul(qd);
    out.kinetic_gradient = Vector::from(per_joint(&gradient));
    out.mass_matrix = mass_matrix(arm, &motions, &carried);
}
