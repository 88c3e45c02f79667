//! The tip's task on the active joints: `D` = 3 directions for its position, 6 for its pose.
//!
//! [`Task`] holds the task's Jacobian and the dynamically consistent inverse `Jb = H^-1 J^T A^-1`,
//! `A = J H^-1 J^T`. Held joints do not belong to the task: their columns of `J` are zero, and in `Jb` their rows
//! of `H` are those of the identity. With as many active joints as directions `Jb` equals `J^-1`; for three
//! directions it is computed as `J^-1`, independent of the mass matrix.
//!
//! **Near singular poses** the position's `A` is damped: `A + f(sigma) / m_max I`, with `sigma` the
//! smallest singular value of the active Jacobian, `f = (1 - (sigma / 0.18)^2)^2` below 0.18 and zero
//! above (the paper's sinusoid stays above), `m_max` = 20 kg. At a singular pose the mass that the
//! inertial terms command along the lost direction is thus `m_max` instead of infinite; on the way
//! there it may be greater, about twice that for an arm like the WAM.
//!
//! The pose's `A` is damped in its Cholesky pivots: pivot `p` is the inverse of the apparent mass or
//! inertia along its direction with the preceding directions free of force, and becomes `p + f(p m)
//! / m` with `f(x) = (1 - x^2)^2` below 1 and zero above, so that at most about `m` is commanded:
//! [`MAX_TASK_MASS_KG`] along the axes and [`MAX_TASK_INERTIA_KG_M2`] about them.

use super::consistent_inverse::consistent_inverse;
use crate::config::Role;
use crate::dynamics::{Sweep, Terms};
use crate::math::lanes::{Columns, LANES, Lanes, columns, entry, in_groups};
use crate::math::linalg::{
    Inverse3, first_rows, is_positive_definite_3, min_singular_value, singular_values_exceed,
};
use crate::math::{Matrix, Matrix3};

/// Smallest singular value of the active Jacobian below which the position's inverse is damped \[m\].
pub const SINGULAR_BELOW_M: f64 = 0.18;
/// Mass that the damped inverse commands along a lost direction at a singular pose \[kg\]; near the pose up to twice as much.
pub const MAX_TASK_MASS_KG: f64 = 20.0;
/// Greatest moment of inertia that the damped inverse commands about a lost direction \[kg m^2\].
pub const MAX_TASK_INERTIA_KG_M2: f64 = 2.0;

/// Returns the damping of the position's inverse at the smallest singular value `sigma_m` \[1/kg\]: zero from
/// [`SINGULAR_BELOW_M`] on, `1 / MAX_TASK_MASS_KG` at zero.
#[inline]
pub fn singularity_damping_per_kg(sigma_m: f64) -> f64 {
    if sigma_m >= SINGULAR_BELOW_M {
        return 0.0;
    }
    let x = sigma_m / SINGULAR_BELOW_M;
    let f = 1.0 - x * x;
    f * f / MAX_TASK_MASS_KG
}

/// Returns the damped pivot `i` of the pose's mobility matrix.
#[inline]
fn damped_pivot(i: usize, pivot: f64) -> f64 {
    let max_mass_or_inertia = if i < 3 {
        MAX_TASK_MASS_KG
    } else {
        MAX_TASK_INERTIA_KG_M2
    };
    let x = pivot * max_mass_or_inertia;
    if x < 1.0 {
        let f = 1.0 - x * x;
        pivot + f * f / max_mass_or_inertia
    } else {
        pivot
    }
}

/// The task in the first `D` directions of the tip's motion, base axes.
#[derive(Clone, Copy, Debug)]
pub struct Task<const N: usize, const D: usize = 3> {
    /// Jacobian with the columns of held joints zero.
    pub jacobian: Matrix<D, N>,
    /// `Jb`, joint motion per tip motion; rows of held joints zero.
    pub inverse: Matrix<N, D>,
    /// Smallest singular value of the position's rows of `jacobian` \[m\].
    pub min_singular_value_m: f64,
    /// Whether the inverse is damped, because the pose is near a singular one.
    pub is_damped: bool,
}

impl<const N: usize> Task<N, 3> {
    /// Returns the task of the tip's position. `None` where the mass matrix of the active joints is not
    /// positive definite.
    #[inline(always)]
    pub fn new(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, 3>> {
        Task::from_terms(terms, roles)
    }
}

impl<const N: usize> Task<N, 6> {
    /// Returns the task of the tip's pose. `None` where the mass matrix of the active joints is not positive
    /// definite, or where fewer than six joints are active.
    pub fn of_pose(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, 6>> {
        Task::from_terms(terms, roles)
    }
}

impl<const N: usize, const D: usize> Task<N, D> {
    #[inline(always)]
    fn from_terms(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N, D>> {
        in_groups!(N, from_terms[D](terms, roles))
    }

    /// Returns the task of a swept arm with its mass matrix, as [`Task::new`] and [`Task::of_pose`].
    #[inline(always)]
    pub(crate) fn from_sweep<const G: usize>(
        sweep: &Sweep<G>,
        mass_matrix: Columns<N, G>,
        roles: &[Role; N],
    ) -> Option<Task<N, D>> {
        // From the lanes, not from a matrix: a vector load of numbers that were just stored one by one stalls.
        let mut jacobian = Matrix::<D, N>::zeros();
        for (joint, column) in jacobian.data.0.iter_mut().enumerate() {
            for (direction, x) in column.iter_mut().enumerate() {
                *x = entry(&sweep.motions[direction], joint);
            }
        }
        Task::from_matrices(jacobian, mass_matrix, roles)
    }

    /// The task from the Jacobian of all joints and the columns of the mass matrix.
    ///
    /// Far from a singular pose a cheap bound shows that the position needs no damping: nothing else then depends on the smallest
    /// singular value, whose computation takes as long as the rest and is left out where nobody reads it.
    #[inline(always)]
    fn from_matrices<const G: usize>(
        mut jacobian: Matrix<D, N>,
        mut mass_matrix: Columns<N, G>,
        roles: &[Role; N],
    ) -> Option<Task<N, D>> {
        const { assert!(D == 3 || D == 6, "a task is a position or a pose") };
        let active = count_active(roles);
        if D == 6 && active < D {
            return None;
        }
        if active != N {
            remove_held(&mut jacobian, roles);
        }
        let position: Matrix<3, N> = first_rows(&jacobian);
        let sigma = min_singular_value(&position);
        let damping = if D == 3 && !singular_values_exceed(&position.data.0, SINGULAR_BELOW_M) {
            singularity_damping_per_kg(sigma)
        } else {
            0.0
        };
        let mut is_damped = damping != 0.0;
        let three_joints = if N == 3 && active == 3 {
            Some([0, 1, 2])
        } else if active == 3 {
            three_active(roles)
        } else {
            None
        };
        let inverse = match three_joints {
            Some(joints) if D == 3 && damping == 0.0 => {
                // The inverse does not use the mass matrix, but a matrix that is not positive definite is rejected here too.
                if !is_positive_definite_3(|i, j| entry(&mass_matrix[j], i), joints) {
                    return None;
                }
                inverse_of_three(&jacobian, joints)
            }
            _ => {
                if active != N {
                    decouple_held(&mut mass_matrix, roles);
                }
                consistent_inverse(&mass_matrix, &jacobian, |i, pivot| {
                    if D == 3 {
                        return pivot + damping;
                    }
                    let damped = damped_pivot(i, pivot);
                    is_damped |= damped != pivot;
                    damped
                })?
            }
        };
        Some(Task {
            jacobian,
            inverse,
            min_singular_value_m: sigma,
            is_damped,
        })
    }
}

#[inline(always)]
fn from_terms<const D: usize, const N: usize, const G: usize>(
    terms: &Terms<N>,
    roles: &[Role; N],
) -> Option<Task<N, D>> {
    let mass_matrix: Columns<N, G> = columns(&terms.mass_matrix);
    Task::from_matrices(first_rows(&terms.jacobian), mass_matrix, roles)
}

/// The position task of an arm with three joints, all active, independent of the mass matrix; `None` near singular
/// poses. `columns` are those of the Jacobian.
#[inline(always)]
pub(crate) fn square_task<const N: usize, const D: usize>(
    columns: [[f64; 3]; 3],
) -> Option<Task<N, D>> {
    let inverse = Inverse3::new(columns);
    let regular = inverse.exceeds_conservatively(SINGULAR_BELOW_M)
        || singular_values_exceed(&columns, SINGULAR_BELOW_M);
    regular.then(|| Task {
        jacobian: Matrix::from_fn(|direction, joint| columns[joint][direction]),
        inverse: spread(inverse.rows(), [0, 1, 2]),
        min_singular_value_m: min_singular_value(&Matrix3::from(columns)),
        is_damped: false,
    })
}

/// Sets the columns of held joints to zero.
#[inline(always)]
fn remove_held<const N: usize, const D: usize>(jacobian: &mut Matrix<D, N>, roles: &[Role; N]) {
    for (column, role) in jacobian.data.0.iter_mut().zip(roles) {
        if *role != Role::Active {
            *column = [0.0; D];
        }
    }
}

/// Sets the rows and columns of held joints to those of the identity.
#[inline(always)]
fn decouple_held<const N: usize, const G: usize>(
    mass_matrix: &mut Columns<N, G>,
    roles: &[Role; N],
) {
    let is_active = |i: usize| i < N && roles[i] == Role::Active;
    for (j, column) in mass_matrix.iter_mut().enumerate() {
        for (group, x) in column.iter_mut().enumerate() {
            let mut lanes = x.to_array();
            for (lane, number) in lanes.iter_mut().enumerate() {
                let i = group * LANES + lane;
                if !(is_active(i) && is_active(j)) {
                    *number = if i == j { 1.0 } else { 0.0 };
                }
            }
            *x = Lanes::new(lanes);
        }
    }
}

/// Returns the number of active joints.
#[inline]
pub(crate) fn count_active<const N: usize>(roles: &[Role; N]) -> usize {
    roles.iter().filter(|role| **role == Role::Active).count()
}

/// Returns the active joints if their number is three, the number of directions of a position.
#[inline]
fn three_active<const N: usize>(roles: &[Role; N]) -> Option<[usize; 3]> {
    let mut joints = [0; 3];
    let mut active = 0;
    for (joint, role) in roles.iter().enumerate() {
        if *role == Role::Active {
            *joints.get_mut(active)? = joint;
            active += 1;
        }
    }
    (active == 3).then_some(joints)
}

/// `J^-1` on three joints.
#[inline]
fn inverse_of_three<const N: usize, const D: usize>(
    jacobian: &Matrix<D, N>,
    joints: [usize; 3],
) -> Matrix<N, D> {
    let column = |joint: usize| core::array::from_fn(|k| jacobian.data.0[joint][k]);
    spread(Inverse3::new(joints.map(column)).rows(), joints)
}

/// Returns a matrix with `rows` for the joints `joints`, and zeros for all others.
#[inline(always)]
fn spread<const N: usize, const D: usize>(rows: [[f64; 3]; 3], joints: [usize; 3]) -> Matrix<N, D> {
    let mut inverse = Matrix::zeros();
    for (joint, row) in joints.into_iter().zip(rows) {
        for (direction, entry) in row.into_iter().enumerate() {
            inverse[(joint, direction)] = entry;
        }
    }
    inverse
}
