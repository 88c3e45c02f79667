//! Composite rigid bodies: the mass matrix.

use super::{Composite, parent_rotations, wrench_to_parent};
use crate::arm::Arm;
use crate::math::{Matrix, Vector};

/// Mass matrix `H(q)`, symmetric, rotor inertias on the diagonal \[kg m^2\]. `q` \[rad\].
pub fn crba<const N: usize>(arm: &Arm<N>, q: &Vector<N>) -> Matrix<N, N> {
    let rotations = parent_rotations(arm, q);
    let mut composites: [Composite; N] = core::array::from_fn(|i| Composite::of(&arm.links[i]));
    let mut mass_matrix = Matrix::from_diagonal(&arm.armature);
    for j in (0..N).rev() {
        let (mut moment, mut force) = composites[j].unit_wrench();
        mass_matrix[(j, j)] += moment.z;
        for i in (0..j).rev() {
            let origin = &arm.links[i + 1].parent_from_joint.translation;
            (moment, force) = wrench_to_parent(&moment, &force, &rotations[i + 1], origin);
            mass_matrix[(i, j)] = moment.z;
            mass_matrix[(j, i)] = moment.z;
        }
        if j > 0 {
            let child = composites[j];
            let origin = &arm.links[j].parent_from_joint.translation;
            composites[j - 1].add(&child, &rotations[j], origin);
        }
    }
    mass_matrix
}
