//! The impedance law in one piece, all joints active: of the tip's position, or of its whole pose.
//!
//! It is Eq. (3.6) with the arm's own inertia and without friction, its terms already summed; where each
//! term must be seen apart, or joints are held, [`crate::impedance`] is the law. With
//! `A = J H^-1 J^T` and `H Jb = J^T A^-1`:
//!
//! ```text
//! tau = G + C qd + J^T [A^-1 (Xo'' - J' qd) + K (Xo - X) + B (Xo' - X')] - d N^T N qd
//! N   = 1 - H^-1 J^T A^-1 J
//! ```
//!
//! With `H = L D L^T` and `Y = J L^-T`, `A = Y D^-1 Y^T`: `H^-1 J^T` is never formed.
//!
//! **Orientation.** The error is `e = (r1 x r1o + r2 x r2o + r3 x r3o) / 2 = sin(angle) axis`, with `ri`
//! and `rio` the axes of the tip and of its reference (Luh, Walker and Paul, "Resolved-acceleration
//! control of mechanical manipulators", 1980). For equal stiffness `k` about all axes it is the gradient
//! of `k (1 - cos(angle))`: beyond 90 degrees it weakens, at 180 degrees it vanishes.
//!
//! **Near singular poses** the position's `A` is damped as [`crate::impedance`] says. The pose's is damped
//! in its Cholesky pivots: pivot `p` is the inverse of the mass or inertia that is felt along its
//! direction with the directions before it free of force, and becomes `p + f(p m) / m` with
//! `f(x) = (1 - x^2)^2` below 1 and zero above: no more than about `m` is commanded, [`GREATEST_TASK_MASS_KG`]
//! along the axes and [`GREATEST_TASK_INERTIA_KG_M2`] about them.

use crate::arm::Arm;
use crate::config::Gains;
use crate::dynamics::{Terms, fill};
use crate::impedance::{GREATEST_TASK_MASS_KG, SINGULAR_BELOW_M, singularity_damping_per_kg};
use crate::lanes::in_groups;
use crate::linalg::{
    Cholesky, least_singular_value, singular_values_exceed, times, transpose_times,
};
use crate::math::{Matrix, Matrix3, Vector, Vector3};
use crate::pose::Pose;
use crate::trajectory::Reference;

/// Greatest moment of inertia that the damped inverse commands about a lost direction \[kg m^2\].
pub const GREATEST_TASK_INERTIA_KG_M2: f64 = 2.0;

/// Where the tip's frame should be and how it should move, base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseReference {
    /// `Xo`.
    pub base_from_tip: Pose,
    /// `Xo'`, of the frame's origin \[m/s\].
    pub velocity_m_per_s: Vector3<f64>,
    /// Angular velocity \[rad/s\].
    pub angular_velocity_rad_per_s: Vector3<f64>,
    /// `Xo''`, of the frame's origin \[m/s^2\].
    pub acceleration_m_per_s2: Vector3<f64>,
    /// Angular acceleration \[rad/s^2\].
    pub angular_acceleration_rad_per_s2: Vector3<f64>,
}

impl PoseReference {
    /// At rest there.
    pub fn at_rest(base_from_tip: Pose) -> PoseReference {
        PoseReference {
            base_from_tip,
            velocity_m_per_s: Vector3::zeros(),
            angular_velocity_rad_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            angular_acceleration_rad_per_s2: Vector3::zeros(),
        }
    }
}

/// Impedance of the tip's pose, diagonal in base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseGains {
    /// `K` and `B` along the axes.
    pub linear: Gains,
    /// Stiffness about the axes \[N m/rad\], zero or more.
    pub stiffness_nm_per_rad: Vector3<f64>,
    /// Damping about the axes \[N m s/rad\], zero or more.
    pub damping_nm_s_per_rad: Vector3<f64>,
}

/// `sin(angle) axis` of the rotation from `found` to `wanted`, base axes.
#[inline]
pub fn orientation_error(wanted: &Matrix3<f64>, found: &Matrix3<f64>) -> Vector3<f64> {
    let column = |i: usize| found.column(i).cross(&wanted.column(i));
    (column(0) + column(1) + column(2)) * 0.5
}

/// Joint torques that give the tip's position the impedance `gains` \[N m\]. `q` \[rad\], `qd` \[rad/s\].
///
/// `nullspace_damping_nm_s_per_rad` damps motion that leaves the tip's position alone, zero or more. `None`
/// where the mass matrix is not positive definite.
#[inline]
pub fn position_torque<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    reference: &Reference,
    gains: &Gains,
    nullspace_damping_nm_s_per_rad: f64,
) -> Option<Vector<N>> {
    const { assert!(N >= 3, "a position takes three joints") };
    let damping = nullspace_damping_nm_s_per_rad;
    in_groups!(N, position(arm, q, qd, reference, gains, damping))
}

#[inline]
fn position<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    reference: &Reference,
    gains: &Gains,
    nullspace_damping: f64,
) -> Option<Vector<N>> {
    let mut terms = Terms::default();
    fill::<N, G>(arm, q, qd, &mut terms);
    let mut jacobian = Matrix::<3, N>::zeros();
    for (linear, column) in jacobian.data.0.iter_mut().zip(&terms.jacobian.data.0) {
        linear.copy_from_slice(&column[..3]);
    }
    let damping = if singular_values_exceed(&jacobian, SINGULAR_BELOW_M) {
        0.0
    } else {
        singularity_damping_per_kg(least_singular_value(&jacobian))
    };
    let error = reference.position - terms.base_from_tip.translation;
    let rate = times(&jacobian, qd);
    let drift = &terms.jacobian_dot_qd;
    let task = Task {
        jacobian,
        acceleration: reference.acceleration - Vector3::new(drift[0], drift[1], drift[2]),
        force: gains.stiffness_n_per_m.component_mul(&error)
            + gains
                .damping_n_s_per_m
                .component_mul(&(reference.velocity - rate)),
        rate,
    };
    if N == 3 && damping == 0.0 {
        return task.square_torque(&terms);
    }
    task.torque(&terms, qd, nullspace_damping, |a| {
        Cholesky::new(&(a + Matrix3::from_diagonal_element(damping)))
    })
}

/// Joint torques that give the tip's pose the impedance `gains` \[N m\]. `q` \[rad\], `qd` \[rad/s\].
///
/// `nullspace_damping_nm_s_per_rad` damps motion that leaves the tip's pose alone, zero or more. `None` where
/// the mass matrix is not positive definite.
#[inline]
pub fn pose_torque<const N: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    reference: &PoseReference,
    gains: &PoseGains,
    nullspace_damping_nm_s_per_rad: f64,
) -> Option<Vector<N>> {
    const { assert!(N >= 6, "a pose takes six joints") };
    let damping = nullspace_damping_nm_s_per_rad;
    in_groups!(N, pose(arm, q, qd, reference, gains, damping))
}

#[inline]
fn pose<const N: usize, const G: usize>(
    arm: &Arm<N>,
    q: &Vector<N>,
    qd: &Vector<N>,
    reference: &PoseReference,
    gains: &PoseGains,
    nullspace_damping: f64,
) -> Option<Vector<N>> {
    let mut terms = Terms::default();
    fill::<N, G>(arm, q, qd, &mut terms);
    let rate = times(&terms.jacobian, qd);
    let position = reference.base_from_tip.translation - terms.base_from_tip.translation;
    let orientation = orientation_error(
        &reference.base_from_tip.rotation,
        &terms.base_from_tip.rotation,
    );
    let pair = |linear: &Vector3<f64>, angular: &Vector3<f64>| {
        Vector::<6>::new(
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        )
    };
    let velocity = pair(
        &reference.velocity_m_per_s,
        &reference.angular_velocity_rad_per_s,
    );
    let acceleration = pair(
        &reference.acceleration_m_per_s2,
        &reference.angular_acceleration_rad_per_s2,
    );
    let stiffness = pair(&gains.linear.stiffness_n_per_m, &gains.stiffness_nm_per_rad);
    let damping = pair(&gains.linear.damping_n_s_per_m, &gains.damping_nm_s_per_rad);
    let task = Task {
        jacobian: terms.jacobian,
        acceleration: acceleration - terms.jacobian_dot_qd,
        force: stiffness.component_mul(&pair(&position, &orientation))
            + damping.component_mul(&(velocity - rate)),
        rate,
    };
    task.torque(&terms, qd, nullspace_damping, |a| {
        Cholesky::with_pivots(a, damped_pivot)
    })
}

/// A task of `D` dimensions, and what is asked of it.
struct Task<const D: usize, const N: usize> {
    jacobian: Matrix<D, N>,
    /// `Xo'' - J' qd`.
    acceleration: Vector<D>,
    /// `K (Xo - X) + B (Xo' - X')`.
    force: Vector<D>,
    /// `J qd`.
    rate: Vector<D>,
}

impl<const D: usize, const N: usize> Task<D, N> {
    /// The law; `factor` turns `A` into its factors, damped where it must be.
    #[inline]
    fn torque(
        &self,
        terms: &Terms<N>,
        qd: &Vector<N>,
        nullspace_damping: f64,
        factor: impl FnOnce(&Matrix<D, D>) -> Option<Cholesky<D>>,
    ) -> Option<Vector<N>> {
        let mass_matrix = Cholesky::new(&terms.mass_matrix)?;
        let half = mass_matrix.solve_lower_right(&self.jacobian);
        let mobility = factor(&mass_matrix.gram(&half))?;
        let mut acceleration = self.acceleration;
        let mut tau = terms.coriolis_gravity;
        if N > D {
            // H^-1 J^T x = L^-T D^-1 Y^T x, and its transpose.
            let along = transpose_times(&half, &mobility.solve(&self.rate));
            let loose = qd - mass_matrix.solve_upper(&mass_matrix.divide(&along));
            let damping = loose * nullspace_damping;
            let back = mass_matrix.divide(&mass_matrix.solve_lower(&damping));
            acceleration += times(&half, &back);
            tau -= damping;
        }
        let force = mobility.solve(&acceleration) + self.force;
        Some(tau + transpose_times(&self.jacobian, &force))
    }
}

impl<const N: usize> Task<3, N> {
    /// Three joints, away from singular poses: `H J^-1` in place of `J^T A^-1`.
    #[inline]
    fn square_torque(&self, terms: &Terms<N>) -> Option<Vector<N>> {
        let column = |i: usize| self.jacobian.fixed_view::<3, 1>(0, i).into_owned();
        let (a, b, c) = (column(0), column(1), column(2));
        let (bc, ca, ab) = (b.cross(&c), c.cross(&a), a.cross(&b));
        let x = &self.acceleration;
        let scale = 1.0 / a.dot(&bc);
        let mut qdd = Vector::zeros();
        for (i, row) in [bc, ca, ab].iter().enumerate() {
            qdd[i] = row.dot(x) * scale;
        }
        let tau = terms.coriolis_gravity + times(&terms.mass_matrix, &qdd);
        Some(tau + transpose_times(&self.jacobian, &self.force))
    }
}

/// Pivot `i` of the pose's mobility, damped as the module says.
#[inline]
fn damped_pivot(i: usize, pivot: f64) -> f64 {
    let greatest = if i < 3 {
        GREATEST_TASK_MASS_KG
    } else {
        GREATEST_TASK_INERTIA_KG_M2
    };
    let x = pivot * greatest;
    if x < 1.0 {
        let f = 1.0 - x * x;
        pivot + f * f / greatest
    } else {
        pivot
    }
}
