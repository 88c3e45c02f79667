//! All dynamic terms of the impedance law, from one outward and one inward sweep.

use super::crba::symmetric;
use super::frames::matrix;
use super::sweep::Sweep;
use crate::math::lanes::{in_groups, per_joint};
use crate::math::{Matrix, Vector};
use crate::model::arm::Arm;
use crate::model::pose::Pose;

/// Dynamic terms in one state, computed by [`terms`].
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
    /// Gradient of `G` by gravity \[kg m\]: `G` is the product of its transpose with gravity in base axes.
    pub gravity_gradient: Matrix<3, N>,
    // Depends also on velocity.
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
            gravity_gradient: Matrix::zeros(),
            coriolis_gravity: Vector::zeros(),
            jacobian_dot_qd: Vector::zeros(),
            momentum: Vector::zeros(),
            kinetic_gradient: Vector::zeros(),
        }
    }
}

impl<const N: usize> Terms<N> {
    /// Returns the first `D` entries of the tip's velocity at the joint velocities `qd` \[rad/s\], linear first, base axes \[m/s, rad/s\].
    #[inline(always)]
    pub(crate) fn tip_velocity<const D: usize>(&self, qd: &Vector<N>) -> Vector<D> {
        let mut velocity = Vector::<D>::zeros();
        for (column, speed) in self.jacobian.data.0.iter().zip(&qd.data.0[0]) {
            for (sum, entry) in velocity.data.0[0].iter_mut().zip(column) {
                *sum += entry * speed;
            }
        }
        velocity
    }
}

/// Fills `out` for the state `q` \[rad\], `qd` \[rad/s\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn terms<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>, out: &mut Terms<N>) {
    in_groups!(N, swept(arm, q, qd, out));
}

#[inline(always)]
fn swept<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    out: &mut Terms<N>,
) {
    fill(&Sweep::<G>::new(arm, q, qd), arm, qd, out);
}

/// Fills `out` from a sweep. The function is inlined, so unused terms cost nothing.
#[inline(always)]
fn fill<const N: usize, const G: usize>(
    sweep: &Sweep<G>,
    arm: &Arm<N>,
    qd: &Vector<N>,
    out: &mut Terms<N>,
) {
    let projection = sweep.projection();
    out.base_from_tip = sweep.chain.tip.pose();
    out.jacobian = matrix(&sweep.motions);
    out.jacobian_dot_qd = Vector::from(sweep.tip_bias_acceleration::<N>());
    out.gravity = Vector::from(per_joint(&sweep.gravity(arm)));
    out.gravity_gradient = matrix(&sweep.gravity_gradient());
    out.coriolis_gravity = Vector::from(per_joint(&projection.torque));
    out.momentum = Vector::from(per_joint(&projection.momentum)) + arm.armature.component_mul(qd);
    out.kinetic_gradient = Vector::from(per_joint(&projection.kinetic_gradient));
    out.mass_matrix = symmetric(&sweep.mass(arm));
}
