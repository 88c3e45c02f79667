//! The impedance law as a single sum with all joints active, for the tip's position or its full
//! pose.
//!
//! It is Eq. (3.6) with the arm's own inertia and without friction, with its terms already summed;
//! [`crate::law::impedance`] implements the law term by term and with held joints. With `A = J H^-1 J^T`
//! and `H Jb = J^T A^-1`:
//!
//! ```text
//! tau = G + C qd + J^T [A^-1 (Xo'' - J' qd) + K (Xo - X) + B (Xo' - X')] - d N^T N qd
//! N   = 1 - H^-1 J^T A^-1 J
//! ```
//!
//! With `H = L D L^T` and `Y = J L^-T`, `A = Y D^-1 Y^T`: `H^-1 J^T` is never formed. Three joints away from
//! singular poses need neither: `J^-1` gives their accelerations, and inverse dynamics the torques.
//!
//! **Orientation.** The error is `e = (r1 x r1o + r2 x r2o + r3 x r3o) / 2 = sin(angle) axis`, with `ri`
//! and `rio` the axes of the tip and of its reference (Luh, Walker and Paul, "Resolved-acceleration
//! control of mechanical manipulators", 1980). For equal stiffness `k` about all axes it is the gradient
//! of `k (1 - cos(angle))`: beyond 90 degrees it weakens, at 180 degrees it vanishes.
//!
//! **Near singular poses** the position's `A` is damped as described in [`crate::law::impedance`]. The
//! pose's `A` is damped in its Cholesky pivots: pivot `p` is the inverse of the apparent mass or
//! inertia along its direction with the preceding directions free of force, and becomes `p + f(p m)
//! / m` with `f(x) = (1 - x^2)^2` below 1 and zero above, so that at most about `m` is commanded:
//! [`MAX_TASK_MASS_KG`] along the axes and [`MAX_TASK_INERTIA_KG_M2`] about them.

use crate::config::Gains;
use crate::dynamics::Sweep;
use crate::law::impedance::{MAX_TASK_MASS_KG, SINGULAR_BELOW_M, singularity_damping};
use crate::math::factors::Factors;
use crate::math::lanes::{
    Column, Columns, Lanes, Number, column, entry, in_groups, joint_values, per_joint,
};
use crate::math::linalg::Inverse3;
use crate::math::{Matrix3, Vector, Vector3};
use crate::model::arm::Arm;
use crate::model::pose::Pose;
use crate::trajectory::Reference;
use core::array::from_fn;

/// Maximum moment of inertia that the damped inverse commands about a lost direction \[kg m^2\].
pub const MAX_TASK_INERTIA_KG_M2: f64 = 2.0;

/// Reference of the tip's pose, base axes.
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
    /// A reference at rest at `base_from_tip`.
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

/// `sin(angle) axis` of the rotation from `found` to `wanted`, in base axes.
#[inline]
pub fn orientation_error(wanted: &Matrix3<f64>, found: &Matrix3<f64>) -> Vector3<f64> {
    let column = |i: usize| found.column(i).cross(&wanted.column(i));
    (column(0) + column(1) + column(2)) * 0.5
}

/// Joint torques that give the tip's position the impedance `gains` \[N m\]. `q` \[rad\], `qd` \[rad/s\].
///
/// `nullspace_damping_nm_s_per_rad`, zero or more, damps motion that does not change the tip's
/// position. `None` if the mass matrix is not positive definite.
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
    let sweep = Sweep::<G>::new(arm, q, qd);
    let columns: [[f64; 3]; N] = from_fn(|i| first(joint_values(&sweep.motions, i)));
    let inverse = Inverse3::new(from_fn(|i| columns[i]));
    let singularity_damping = if N == 3 && inverse.exceeds_conservatively(SINGULAR_BELOW_M) {
        0.0
    } else {
        singularity_damping(&columns)
    };
    let position = Vector3::from(sweep.chain.tip.origin);
    let rate = Vector3::from(first(sweep.motion.tip_rate::<N>()));
    let bias = Vector3::from(first(sweep.tip_bias_acceleration::<N>()));
    let error = reference.position - position;
    let rate_error = reference.velocity - rate;
    let task = Task {
        rate: rate.data.0[0],
        acceleration: (reference.acceleration - bias).data.0[0],
        force: (gains.stiffness_n_per_m.component_mul(&error)
            + gains.damping_n_s_per_m.component_mul(&rate_error))
        .data
        .0[0],
    };
    if N == 3 && singularity_damping == 0.0 {
        return Some(task.square_torque(arm, sweep, &inverse));
    }
    let damped = |_, pivot| pivot + singularity_damping;
    if N == 3 {
        task.torque_out_of_line::<N, G, 1>(arm, q, qd, damped)
    } else {
        task.torque::<N, G, 1>(arm, &sweep, qd, nullspace_damping, damped)
    }
}

/// Joint torques that give the tip's pose the impedance `gains` \[N m\]. `q` \[rad\], `qd` \[rad/s\].
///
/// `nullspace_damping_nm_s_per_rad`, zero or more, damps motion that does not change the tip's
/// pose. `None` if the mass matrix is not positive definite.
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
    let sweep = Sweep::<G>::new(arm, q, qd);
    let (rate, bias) = (
        sweep.motion.tip_rate::<N>(),
        sweep.tip_bias_acceleration::<N>(),
    );
    let tip = sweep.chain.tip.pose();
    let wanted = &reference.base_from_tip;
    let error = pair(
        &(wanted.translation - tip.translation),
        &orientation_error(&wanted.rotation, &tip.rotation),
    );
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
        rate,
        acceleration: from_fn(|k| acceleration[k] - bias[k]),
        force: from_fn(|k| stiffness[k] * error[k] + damping[k] * (velocity[k] - rate[k])),
    };
    task.torque::<N, G, 2>(arm, &sweep, qd, nullspace_damping, damped_pivot)
}

#[inline(always)]
fn pair(linear: &Vector3<f64>, angular: &Vector3<f64>) -> [f64; 6] {
    [
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    ]
}

/// The first `D` of six numbers.
#[inline(always)]
fn first<const D: usize>(six: [f64; 6]) -> [f64; D] {
    from_fn(|k| six[k])
}

/// Task in the first `D` directions of the tip's motion.
struct Task<const D: usize> {
    /// `J qd`.
    rate: [f64; D],
    /// `Xo'' - J' qd`.
    acceleration: [f64; D],
    /// `K (Xo - X) + B (Xo' - X')`.
    force: [f64; D],
}

impl<const D: usize> Task<D> {
    /// Torque of the law; `adjust_pivot` damps the pivots of `A` near singular poses. `R` groups
    /// hold `D` directions.
    #[inline(always)]
    fn torque<const N: usize, const G: usize, const R: usize>(
        &self,
        arm: &Arm<N>,
        sweep: &Sweep<G>,
        qd: &Vector<N>,
        nullspace_damping: f64,
        adjust_pivot: impl Fn(usize, f64) -> f64,
    ) -> Option<Vector<N>> {
        let jacobian: Columns<N, R> =
            from_fn(|i| column::<D, R>(&first(joint_values(&sweep.motions, i))));
        let mass = Factors::new(sweep.mass(arm), |_, pivot| pivot)?;
        let mobility = Factors::<D, R>::new(mass.gram(&mass.solve_right(jacobian)), adjust_pivot)?;
        let mut acceleration = self.acceleration;
        let mut tau = Vector::from(per_joint(&sweep.projection().torque));
        if N > D {
            // J^T A^-1 J qd, then H^-1 of it: the motion that moves the tip.
            let moving = mass.solve(&per_joint(&self.joints(sweep, &mobility.solve(&self.rate))));
            let damping: [f64; N] = from_fn(|i| nullspace_damping * (qd[i] - moving[i]));
            let loose = mass.solve(&damping);
            for (k, x) in acceleration.iter_mut().enumerate() {
                for i in 0..N {
                    *x = entry(&jacobian[i], k).multiply_add(loose[i], *x);
                }
            }
            tau -= Vector::from(damping);
        }
        let inertial = mobility.solve(&acceleration);
        let force = from_fn(|k| inertial[k] + self.force[k]);
        Some(tau + Vector::from(per_joint(&self.joints(sweep, &force))))
    }

    /// As `torque`, not inlined: this path is rare, and inlining it would slow down the common one.
    #[cold]
    #[inline(never)]
    fn torque_out_of_line<const N: usize, const G: usize, const R: usize>(
        &self,
        arm: &Arm<N>,
        q: &Vector<N>,
        qd: &Vector<N>,
        adjust_pivot: impl Fn(usize, f64) -> f64,
    ) -> Option<Vector<N>> {
        let sweep = Sweep::<G>::new(arm, q, qd);
        self.torque::<N, G, R>(arm, &sweep, qd, 0.0, adjust_pivot)
    }

    /// `J^T f`.
    #[inline(always)]
    fn joints<const G: usize>(&self, sweep: &Sweep<G>, force: &[f64; D]) -> Column<G> {
        let mut sum = [Lanes::ZERO; G];
        for (row, f) in sweep.motions.iter().zip(force) {
            for (sum, x) in sum.iter_mut().zip(row) {
                *sum = x.multiply_add(Lanes::splat(*f), *sum);
            }
        }
        sum
    }
}

impl Task<3> {
    /// Torque of three joints away from singular poses: `J^-1` gives their accelerations.
    #[inline(always)]
    fn square_torque<const N: usize, const G: usize>(
        &self,
        arm: &Arm<N>,
        sweep: Sweep<G>,
        inverse: &Inverse3,
    ) -> Vector<N> {
        let rates = inverse.times(self.acceleration);
        let qdd = from_fn(|i| rates[i]);
        let force = per_joint(&self.joints(&sweep, &self.force));
        Vector::from(per_joint(&sweep.inverse_dynamics(arm, &qdd))) + Vector::from(force)
    }
}

/// Pivot `i` of the pose's mobility, damped as described in the module documentation.
#[inline]
fn damped_pivot(i: usize, pivot: f64) -> f64 {
    let max_inertia = if i < 3 {
        MAX_TASK_MASS_KG
    } else {
        MAX_TASK_INERTIA_KG_M2
    };
    let x = pivot * max_inertia;
    if x < 1.0 {
        let f = 1.0 - x * x;
        pivot + f * f / max_inertia
    } else {
        pivot
    }
}
