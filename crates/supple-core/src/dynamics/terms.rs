//! Everything that the impedance law needs, in one sweep out and one back.

use super::crba::symmetric;
use super::frames::matrix;
use super::sweep::Sweep;
use crate::arm::Arm;
use crate::lanes::{in_groups, per_joint};
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

#[inline(always)]
fn fill<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    out: &mut Terms<N>,
) {
    let sweep = Sweep::<G>::new(arm, q, qd);
    let held = sweep.held();
    out.base_from_tip = sweep.chain.tip.pose();
    out.jacobian = matrix(&sweep.motions);
    out.jacobian_dot_qd = Vector::from(sweep.tip_drift::<N>());
    out.gravity = Vector::from(per_joint(&sweep.gravity(arm)));
    out.coriolis_gravity = Vector::from(per_joint(&held.torque));
    out.momentum = Vector::from(per_joint(&held.momentum)) + arm.armature.component_mul(qd);
    out.kinetic_gradient = Vector::from(per_joint(&held.kinetic_gradient));
    out.mass_matrix = symmetric(&sweep.mass(arm));
}
