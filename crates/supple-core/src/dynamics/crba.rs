//! Composite rigid bodies: the mass matrix, `H_ij = S_i . I_j S_j` with `I_j` all that joint `j` carries.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use super::chain::Chain;
use super::frames::{bodies, joint_motions};
use super::inertia::times;
use super::vec3::dot6;
use crate::arm::Arm;
use crate::lanes::{LANES, Rows, for_each_joint, in_groups, of_joint, splat, sums_inward};
use crate::math::{Matrix, Vector};

/// Mass matrix `H(q)`, symmetric, rotor inertias on the diagonal \[kg m^2\]. `q` \[rad\].
#[inline]
pub fn crba<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    in_groups!(N, of_position(arm, q))
}

#[inline]
fn of_position<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    let chain = Chain::<G>::new(arm, q);
    let carried = sums_inward(bodies(arm, &chain));
    mass_matrix(arm, &joint_motions(&chain), &carried)
}

/// From the joints' motions and what they carry.
#[inline(always)]
pub(super) fn mass_matrix<const N: usize, const G: usize>(
    arm: &Arm<N>,
    motions: &Rows<6, G>,
    carried: &Rows<10, G>,
) -> Matrix<N, N> {
    let forces = for_each_joint(motions, carried, &[], |axis, body, []| times(body, axis));
    let mut h = Matrix::<N, N>::zeros();
    let columns = &mut h.data.0;
    for j in 0..N {
        let f = splat(of_joint(&forces, j));
        // The force is that of all joint j carries: right for itself and for the joints before it.
        for group in 0..=j / LANES {
            let motion = core::array::from_fn(|k| motions[k][group]);
            let torques = dot6(motion, f).to_array();
            for lane in 0..LANES {
                let i = group * LANES + lane;
                if i <= j {
                    columns[j][i] = torques[lane];
                    columns[i][j] = torques[lane];
                }
            }
        }
        columns[j][j] += arm.armature[j];
    }
    h
}
