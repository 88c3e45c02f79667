//! Mass matrix by the composite-rigid-body algorithm, `H_ij = S_i . I_j S_j` for `i <= j`, with `I_j` the composite
//! inertia of the links from `j` to the tip. With at most three joints, the contributions of the links are added up instead.
#![allow(
    clippy::needless_range_loop,
    reason = "the same index of a joint, group or lane is used for several arrays"
)]

use super::chain::Chain;
use super::frames::{bodies, joint_motions};
use super::inertia::{inertia_times, times};
use crate::math::lanes::{
    Columns, LANES, Lanes, Rows, broadcast_joint, entry, for_each_joint, in_groups, joint_values,
    load_group, splat, suffix_sums,
};
use crate::math::vec3::{add, cross, dot, dot6, rotate, rotate_back, scale, sub};
use crate::math::{Matrix, Vector};
use crate::model::arm::Arm;

/// Returns the symmetric mass matrix `H(q)`, with the rotor inertias added to its diagonal \[kg m^2\]. `q` \[rad\].
#[cfg_attr(not(debug_assertions), inline)]
pub fn crba<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    match N {
        ..=3 => link_by_link(arm, q),
        _ => in_groups!(N, of_position(arm, q)),
    }
}

#[cfg_attr(not(debug_assertions), inline)]
fn of_position<const N: usize, const G: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    let chain = Chain::<G>::new(arm, q);
    let last = joint_values(&chain.origins, N - 1);
    let carried = suffix_sums(bodies(arm, &chain, last));
    symmetric(&mass_columns(arm, &joint_motions(&chain, last), &carried))
}

/// Returns the mass matrix of up to three joints; each lane computes the contribution of one link to
/// `H_ij = sum over k >= max(i, j) of (m_k v_ik . v_jk + w_ik . I_k w_jk)`, with `v_ik` and `w_ik` the velocity of the centre
/// of mass and the angular velocity of link `k` for unit speed of joint `i` alone. `v` is in the frame of the first joint, `w`
/// in the frame of link `k`. Lanes of links that joint `j` does not move have meaningless values, which are not added.
#[cfg_attr(not(debug_assertions), inline)]
fn link_by_link<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    let chain = Chain::<1>::from_first_joint(arm, q);
    let (r, origin) = (
        load_group(&chain.rotations, 0),
        load_group(&chain.origins, 0),
    );
    let [mass] = load_group(&arm.rows.masses::<1>(), 0);
    let [cx, cy, cz, xx, xy, yy, xz, yz, zz] = load_group(&arm.rows.central::<1>(), 0);
    let com_from_link_origin = rotate(&r, [cx, cy, cz]);
    let com = add(origin, com_from_link_origin);
    let (mut v, mut w) = ([[Lanes::ZERO; 3]; N], [[Lanes::ZERO; 3]; N]);
    for joint in 0..N {
        let axis = match joint {
            0 => {
                // The first joint rotates about the z axis of its own frame, which is the one used here.
                (v[0], w[0]) = ([-com[1], com[0], Lanes::ZERO], [r[2], r[5], r[8]]);
                continue;
            }
            // The last joint moves the last link alone, about that link's z axis; its `w` is not used: `I w` is a column of `I`.
            last if last == N - 1 => {
                v[last] = cross([r[6], r[7], r[8]], com_from_link_origin);
                continue;
            }
            _ => splat(chain.frame(joint).axis()),
        };
        v[joint] = cross(axis, sub(com, splat(joint_values(&chain.origins, joint))));
        w[joint] = rotate_back(&r, axis);
    }
    let mut mass_matrix = Matrix::<N, N>::zeros();
    for j in 0..N {
        let momentum = scale(v[j], mass);
        let angular_momentum = match j {
            last if last > 0 && last == N - 1 => [xz, yz, zz],
            _ => inertia_times([xx, xy, yy, xz, yz, zz], w[j]),
        };
        for i in 0..=j {
            let rotational = match i {
                last if last > 0 && last == N - 1 => zz,
                _ => dot(w[i], angular_momentum),
            };
            let contributions = (dot(v[i], momentum) + rotational).to_array();
            // Joint `j` moves its own link and those after it.
            let mut sum = contributions[j];
            for link in j + 1..N {
                sum += contributions[link];
            }
            mass_matrix.data.0[j][i] = sum;
            mass_matrix.data.0[i][j] = sum;
        }
        mass_matrix.data.0[j][j] += arm.armature[j];
    }
    mass_matrix
}

/// Returns the columns of the mass matrix from the joint motions and the composite inertias; only the lower triangle is valid.
#[inline(always)]
pub(super) fn mass_columns<const N: usize, const G: usize>(
    arm: &Arm<N>,
    motions: &Rows<6, G>,
    carried: &Rows<10, G>,
) -> Columns<N, G> {
    // `I_j S_j`, the force that accelerates the composite body of joint `j`: used for joints `i <= j` only.
    let forces = for_each_joint!(axis in motions, body in carried => times(body, axis));
    let mut columns = [[Lanes::ZERO; G]; N];
    for j in 0..N {
        let motion = broadcast_joint(motions, j);
        for group in j / LANES..G {
            columns[j][group] = dot6(motion, load_group(&forces, group));
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

/// Returns the full symmetric matrix from its lower triangle.
#[inline(always)]
pub(crate) fn symmetric<const N: usize, const G: usize>(columns: &Columns<N, G>) -> Matrix<N, N> {
    let mut mass_matrix = Matrix::<N, N>::zeros();
    for j in 0..N {
        for i in j..N {
            let x = entry(&columns[j], i);
            mass_matrix.data.0[j][i] = x;
            mass_matrix.data.0[i][j] = x;
        }
    }
    mass_matrix
}
