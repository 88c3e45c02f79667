//! Composite rigid bodies: the mass matrix, `H_ij = S_i . I_j S_j` with `I_j` all that joint `j` carries.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::chain::Chain;
use super::frames::{bodies, joint_motions};
use super::inertia::times;
use crate::arm::Arm;
use crate::lanes::{
    Columns, LANES, Lanes, Rows, entry, for_each_joint, in_groups, of_group, of_joint,
    of_joint_for_all, sums_inward,
};
use crate::math::{Matrix, Vector};
use crate::vec3::dot6;

/// Mass matrix `H(q)`, symmetric, rotor inertias on the diagonal \[kg m^2\]. `q` \[rad\].
#[inline]
pub fn crba<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    in_groups!(N, of_position(arm, q))
}

#[inline]
fn of_position<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    let chain = match N {
        ..=3 => Chain::<G>::from_first_joint(arm, q),
        _ => Chain::new(arm, q),
    };
    let last = of_joint(&chain.origins, N - 1);
    let carried = sums_inward(bodies(arm, &chain, last));
    symmetric(&mass_columns(arm, &joint_motions(&chain, last), &carried))
}

/// From the joints' motions and what they carry, right from the diagonal downwards.
#[inline(always)]
pub(super) fn mass_columns<const N: usize, const G: usize>(
    arm: &Arm<N>,
    motions: &Rows<6, G>,
    carried: &Rows<10, G>,
) -> Columns<N, G> {
    // The force is that of all a joint carries: right for itself and for the joints before it.
    let forces = for_each_joint!(axis in motions, body in carried => times(body, axis));
    let mut columns = [[Lanes::ZERO; G]; N];
    for j in 0..N {
        let motion = of_joint_for_all(motions, j);
        for group in j / LANES..G {
            columns[j][group] = dot6(motion, of_group(&forces, group));
        }
        let rotor = core::array::from_fn(|lane| {
            if lane == j % LANES {
                arm.armature[j]
            } else {
                0.0
            }
        });
        columns[j][j / LANES] += Lanes::new(rotor);
    }
    columns
}

/// The whole of a symmetric matrix of which the lower triangle is known.
#[inline(always)]
pub(super) fn symmetric<const N: usize, const G: usize>(columns: &Columns<N, G>) -> Matrix<N, N> {
    let mut whole = Matrix::<N, N>::zeros();
    for j in 0..N {
        for i in j..N {
            let x = entry(&columns[j], i);
            whole.data.0[j][i] = x;
            whole.data.0[i][j] = x;
        }
    }
    whole
}
