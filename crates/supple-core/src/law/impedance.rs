//! The impedance law, Eq. (3.6), each term apart.
//!
//! With `Jb = H^-1 J^T (J H^-1 J^T)^-1`, the dynamically consistent inverse (`J^-1` where three joints
//! are active), and `A = J H^-1 J^T`:
//!
//! ```text
//! own inertia     tau = G + C qd + D + H Jb (Xo'' - J' qd) + J^T [K (Xo - X) + B (Xo' - X')]
//! chosen inertia  tau = G + C qd + D + H Jb (Xo'' - J' qd) - J^T F
//!                       + H Jb M^-1 [F + K (Xo - X) + B (Xo' - X')]
//! ```
//!
//! `F` is the measured force on the tip. `Xo''` is not in (3.6): it is the feed-forward `M Xo''` that
//! (3.3) lacks. Joints that are held take no part in the task: their columns of `J` are zero and their
//! rows of `H` are the identity in `Jb`; they receive the model's coupling torque `H Jb (..)`, and
//! their own stiff loop elsewhere.
//!
//! **With more than three active joints** motion that leaves the tip alone is damped by
//! `-d N^T N qd`, `N = 1 - Jb J`: `J H^-1 N^T = 0`, so the tip feels none of it, and with `N` on both
//! sides it takes energy however the arm moves (`-d N^T qd` alone can put some in).
//!
//! **Near singular poses** `A` is damped: `A + f(sigma) / m_max I`, with `sigma` the least singular
//! value of the active Jacobian, `f = (1 - (sigma / 0.18)^2)^2` below 0.18 and zero above (the paper's
//! sinusoid stays above), `m_max` = 20 kg. At a singular pose the mass that the inertial terms command
//! along the lost direction is thus `m_max` instead of infinite; on the way there it may be greater,
//! about twice that for an arm like the WAM.

use crate::config::{ApparentInertia, FrictionVelocity, Gains, Law, Role};
use crate::dynamics::Terms;
use crate::math::linalg::{
    Cholesky, Inverse3, is_positive_definite_3, min_singular_value, singular_values_exceed,
};
use crate::math::{Matrix, Matrix3, Vector, Vector3, sqrt};
use crate::model::friction::Friction;
use crate::trajectory::Reference;

pub use crate::law::torques::Torques;

/// Least singular value of the active Jacobian below which the inverse is damped \[m\].
pub const SINGULAR_BELOW_M: f64 = 0.18;
/// Greatest mass that the damped inverse commands along a lost direction \[kg\].
pub const MAX_TASK_MASS_KG: f64 = 20.0;

/// Damping of the task inverse at the least singular value `sigma_m` \[1/kg\]: zero from
/// [`SINGULAR_BELOW_M`] on, `1 / MAX_TASK_MASS_KG` at zero.
pub fn singularity_damping_per_kg(sigma_m: f64) -> f64 {
    if sigma_m >= SINGULAR_BELOW_M {
        return 0.0;
    }
    let x = sigma_m / SINGULAR_BELOW_M;
    let f = 1.0 - x * x;
    f * f / MAX_TASK_MASS_KG
}

/// The same of the columns of a Jacobian. Nothing waits for the singular value, which takes as long as the rest
/// of the law, where it is surely great enough.
#[inline]
pub(crate) fn singularity_damping<const N: usize>(jacobian: &[[f64; 3]; N]) -> f64 {
    if singular_values_exceed(jacobian, SINGULAR_BELOW_M) {
        return 0.0;
    }
    singularity_damping_per_kg(min_singular_value(&Matrix::from(*jacobian)))
}

/// The tip's position task on the active joints.
#[derive(Clone, Copy, Debug)]
pub struct Task<const N: usize> {
    /// Linear Jacobian with the columns of held joints zero.
    pub jacobian: Matrix<3, N>,
    /// `Jb`, joint motion per tip motion; rows of held joints zero.
    pub inverse: Matrix<N, 3>,
    /// Least singular value of `jacobian` \[m\].
    pub least_singular_value_m: f64,
}

impl<const N: usize> Task<N> {
    /// `None` where the mass matrix of the active joints is not positive definite.
    pub fn new(terms: &Terms<N>, roles: &[Role; N]) -> Option<Task<N>> {
        let mut jacobian: Matrix<3, N> = terms.jacobian.fixed_rows::<3>(0).into_owned();
        let mut mass_matrix = terms.mass_matrix;
        for (i, role) in roles.iter().enumerate() {
            if *role != Role::Active {
                jacobian.column_mut(i).fill(0.0);
                mass_matrix.row_mut(i).fill(0.0);
                mass_matrix.column_mut(i).fill(0.0);
                mass_matrix[(i, i)] = 1.0;
            }
        }
        let least_singular_value_m = min_singular_value(&jacobian);
        let damping = singularity_damping_per_kg(least_singular_value_m);
        let inverse = match three_active(roles) {
            Some(joints) if damping == 0.0 => {
                // What the inverse does not ask for, but the arm has to be.
                if !is_positive_definite_3(&mass_matrix, joints) {
                    return None;
                }
                inverse_of_three(&jacobian, joints)
            }
            _ => {
                let mobile = Cholesky::new(&mass_matrix)?.solve(&jacobian.transpose());
                let mobility = jacobian * mobile + Matrix3::from_diagonal_element(damping);
                let inverse = Cholesky::new(&mobility)?.solve(&mobile.transpose());
                inverse.transpose()
            }
        };
        Some(Task {
            jacobian,
            inverse,
            least_singular_value_m,
        })
    }
}

/// The active joints, where they are three: as many as the tip has directions.
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

/// `J^-1` on three joints: where only one motion of theirs moves the tip in a given way, no mass matrix has a say.
#[inline]
fn inverse_of_three<const N: usize>(jacobian: &Matrix<3, N>, joints: [usize; 3]) -> Matrix<N, 3> {
    let rows = Inverse3::new(joints.map(|joint| jacobian.data.0[joint])).rows();
    let mut inverse = Matrix::zeros();
    for (joint, row) in joints.into_iter().zip(rows) {
        for (direction, entry) in row.into_iter().enumerate() {
            inverse[(joint, direction)] = entry;
        }
    }
    inverse
}

/// What the law is given besides the model.
#[derive(Clone, Copy, Debug)]
pub struct LawInput<'a, const N: usize> {
    /// Where the tip should be.
    pub reference: &'a Reference,
    /// Joint velocities \[rad/s\].
    pub velocity_rad_per_s: &'a Vector<N>,
    /// Gains in force now.
    pub gains: &'a Gains,
    /// Measured force on the tip, base axes \[N\].
    pub tip_force_n: Option<Vector3<f64>>,
    /// Greatest force of the spring \[N\], positive; `f64::MAX` for none.
    pub spring_limit_n: f64,
    /// Share of the dry friction feed-forward to apply, 0 to 1.
    pub friction_share: f64,
}

/// The law. Adds nothing for held joints but the model's own terms.
pub fn impedance<const N: usize>(
    law: &Law,
    friction: &[Friction; N],
    roles: &[Role; N],
    terms: &Terms<N>,
    task: &Task<N>,
    now: &LawInput<'_, N>,
) -> Torques<N> {
    let tip_velocity = terms.jacobian.fixed_rows::<3>(0) * now.velocity_rad_per_s;
    let position_error = now.reference.position - terms.base_from_tip.translation;
    let velocity_error = now.reference.velocity - tip_velocity;
    let mut spring = now.gains.stiffness_n_per_m.component_mul(&position_error);
    let pull_n2 = spring.dot(&spring);
    if pull_n2 > now.spring_limit_n * now.spring_limit_n {
        spring *= now.spring_limit_n / sqrt(pull_n2);
    }
    let damper = now.gains.damping_n_s_per_m.component_mul(&velocity_error);
    let joints_of = |acceleration: Vector3<f64>| terms.mass_matrix * (task.inverse * acceleration);

    let mut torques = Torques {
        gravity: terms.gravity,
        coriolis: terms.coriolis_gravity - terms.gravity,
        jacobian_rate: joints_of(-terms.jacobian_dot_qd.fixed_rows::<3>(0).into_owned()),
        ..Torques::zeros()
    };
    if law.inertial_feedforward {
        torques.inertial = joints_of(now.reference.acceleration);
    }
    let chosen = match (law.inertia, now.tip_force_n) {
        (ApparentInertia::Chosen(mass), Some(force)) => {
            Cholesky::new(&mass).map(|mass| (mass, force))
        }
        _ => None,
    };
    if let Some((mass, force)) = chosen {
        torques.stiffness = joints_of(mass.solve(&spring));
        torques.damping = joints_of(mass.solve(&damper));
        torques.force = joints_of(mass.solve(&force)) - task.jacobian.tr_mul(&force);
    } else {
        torques.stiffness = task.jacobian.tr_mul(&spring);
        torques.damping = task.jacobian.tr_mul(&damper);
    }

    let reference_velocity = task.inverse * now.reference.velocity;
    // The part of the joints' motion that moves the tip; the rest is loose.
    let tip_motion = task.inverse * (task.jacobian * now.velocity_rad_per_s);
    let mut loose = Vector::zeros();
    let mut active = 0;
    for i in 0..N {
        let measured = now.velocity_rad_per_s[i];
        let is_active = roles[i] == Role::Active;
        let velocity = match law.friction_velocity {
            FrictionVelocity::Measured if is_active => measured,
            _ => reference_velocity[i],
        };
        torques.friction[i] = friction[i].torque_with_dry_share_nm(velocity, now.friction_share);
        if is_active {
            loose[i] = measured - tip_motion[i];
            active += 1;
        }
    }
    if active > 3 {
        let damping = loose * -law.nullspace_damping_nm_s_per_rad;
        torques.nullspace = damping - task.jacobian.tr_mul(&task.inverse.tr_mul(&damping));
    }
    torques
}
