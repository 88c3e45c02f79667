//! Generalised momentum and the terms of its rate of change, for the external-torque observer.
//!
//! `p = H qd` obeys `p' = tau + tau_ext - D - G + dT/dq`, with `dT/dq = C^T qd`. Rotating joint `i`
//! rotates all links after it relative to the velocity of its parent, so `dT/dq_i = -h_i . (S_i x
//! v_i)` with `h_i` the momentum of all links that joint `i` moves: one sweep out and one back, no
//! matrix.

use super::sweep::Sweep;
use crate::math::Vector;
use crate::math::lanes::{in_groups, per_joint};
use crate::model::arm::Arm;

/// Generalised momentum and kinetic gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum<const N: usize> {
    /// `p = H qd` \[kg m^2/s\].
    pub momentum: Vector<N>,
    /// `dT/dq = C^T qd` \[N m\].
    pub kinetic_gradient: Vector<N>,
}

/// Returns momentum and kinetic gradient at `q` \[rad\], `qd` \[rad/s\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn momentum<const N: usize>(arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>) -> Momentum<N> {
    in_groups!(N, of_state(arm, q, qd))
}

#[cfg_attr(not(debug_assertions), inline)]
fn of_state<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
) -> Momentum<N> {
    let projection = Sweep::<G>::new(arm, q, qd).projection();
    Momentum {
        momentum: Vector::from(per_joint(&projection.momentum)) + arm.armature.component_mul(qd),
        kinetic_gradient: Vector::from(per_joint(&projection.kinetic_gradient)),
    }
}
