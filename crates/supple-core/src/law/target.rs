//! Target of the law: reference and gains of the tip's position, or of its pose.
//!
//! **Orientation.** With the rotation from the tip to its reference by `angle` about the unit vector `a`,
//! a stiffness `K` about the base axes stores the energy `(1 - cos(angle)) a^T K a`, and its torque on the
//! tip is minus the gradient with respect to the tip's rotation: `sin(angle) K a + (1 - cos(angle)) (K a) x a`. For equal stiffness about all axes this is `K e`
//! with `e = sin(angle) a = (r1 x r1o + r2 x r2o + r3 x r3o) / 2`, `ri` and `rio` the axes of the tip and of
//! its reference (Luh, Walker and Paul, "Resolved-acceleration control of mechanical manipulators", 1980);
//! for other stiffness `K e` has no potential, and moving the tip round a closed path could put energy into the arm.
//! For equal stiffness the torque weakens beyond 90 degrees and vanishes at 180; otherwise `2 (K a) x a` is left there.
//!
//! `Xo` is the reference of the tip, `X` the tip, `K` and `B` stiffness and damping, as in the paper.

use crate::config::Gains;
use crate::math::linalg::symmetric_eigenvalues;
use crate::math::{Matrix3, Vector, Vector3, sqrt};
use crate::model::pose::Pose;
use crate::trajectory::Reference;

/// Reference and gains of the tip in the `D` directions of a task, base axes.
pub trait Target<const D: usize> {
    /// Returns `Xo'`.
    fn velocity(&self) -> Vector<D>;

    /// Returns `Xo''`.
    fn acceleration(&self) -> Vector<D>;

    /// Returns `K (Xo - X)`.
    fn spring(&self, base_from_tip: &Pose) -> Vector<D>;

    /// Returns `B (Xo' - X')`.
    fn damper(&self, tip_velocity: &Vector<D>) -> Vector<D>;
}

/// Target of the tip's position.
#[derive(Clone, Copy, Debug)]
pub struct PositionTarget<'a> {
    /// Where the tip should be.
    pub reference: &'a Reference,
    /// `K` and `B`.
    pub gains: &'a Gains,
    /// Greatest force of the spring \[N\], positive; `f64::MAX` for none.
    pub spring_limit_n: f64,
}

impl Target<3> for PositionTarget<'_> {
    #[inline(always)]
    fn velocity(&self) -> Vector<3> {
        self.reference.velocity
    }

    #[inline(always)]
    fn acceleration(&self) -> Vector<3> {
        self.reference.acceleration
    }

    #[inline(always)]
    fn spring(&self, base_from_tip: &Pose) -> Vector<3> {
        let error = self.reference.position - base_from_tip.translation;
        let mut spring = self.gains.stiffness_n_per_m.component_mul(&error);
        let pull_n2 = spring.dot(&spring);
        if pull_n2 > self.spring_limit_n * self.spring_limit_n {
            spring *= self.spring_limit_n / sqrt(pull_n2);
        }
        spring
    }

    #[inline(always)]
    fn damper(&self, tip_velocity: &Vector<3>) -> Vector<3> {
        let error = self.reference.velocity - tip_velocity;
        self.gains.damping_n_s_per_m.component_mul(&error)
    }
}

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
    /// Returns a reference at rest at `base_from_tip`.
    pub fn at_rest(base_from_tip: Pose) -> PoseReference {
        PoseReference {
            base_from_tip,
            velocity_m_per_s: Vector3::zeros(),
            angular_velocity_rad_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            angular_acceleration_rad_per_s2: Vector3::zeros(),
        }
    }

    /// Returns both velocities \[m/s, rad/s\].
    #[inline(always)]
    pub fn velocity(&self) -> Vector<6> {
        pair(&self.velocity_m_per_s, &self.angular_velocity_rad_per_s)
    }

    /// Returns both accelerations \[m/s^2, rad/s^2\].
    #[inline(always)]
    pub fn acceleration(&self) -> Vector<6> {
        pair(
            &self.acceleration_m_per_s2,
            &self.angular_acceleration_rad_per_s2,
        )
    }
}

/// Impedance of the tip's pose in base axes: every matrix symmetric and positive semi-definite, or the
/// law can put energy into the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseGains {
    /// Stiffness along the axes \[N/m\].
    pub stiffness_n_per_m: Matrix3<f64>,
    /// Damping along the axes \[N s/m\].
    pub damping_n_s_per_m: Matrix3<f64>,
    /// Stiffness about the axes \[N m/rad\].
    pub stiffness_nm_per_rad: Matrix3<f64>,
    /// Damping about the axes \[N m s/rad\].
    pub damping_nm_s_per_rad: Matrix3<f64>,
}

impl PoseGains {
    /// Returns the diagonal gains: those of the position, and stiffness \[N m/rad\] and damping \[N m s/rad\] about
    /// the axes.
    pub fn diagonal(
        position: &Gains,
        stiffness_nm_per_rad: &Vector3<f64>,
        damping_nm_s_per_rad: &Vector3<f64>,
    ) -> PoseGains {
        PoseGains {
            stiffness_n_per_m: Matrix3::from_diagonal(&position.stiffness_n_per_m),
            damping_n_s_per_m: Matrix3::from_diagonal(&position.damping_n_s_per_m),
            stiffness_nm_per_rad: Matrix3::from_diagonal(stiffness_nm_per_rad),
            damping_nm_s_per_rad: Matrix3::from_diagonal(damping_nm_s_per_rad),
        }
    }

    /// Returns whether every matrix is finite, symmetric and, to rounding, positive semi-definite.
    pub fn is_passive(&self) -> bool {
        [
            &self.stiffness_n_per_m,
            &self.damping_n_s_per_m,
            &self.stiffness_nm_per_rad,
            &self.damping_nm_s_per_rad,
        ]
        .into_iter()
        .all(|gain| {
            eigenvalue_range(gain).is_some_and(|(min, max)| min >= -EIGENVALUE_ROUNDING * max)
        })
    }
}

/// Tolerance for a negative minimum eigenvalue of a gain matrix due to rounding, relative to its maximum eigenvalue.
pub(crate) const EIGENVALUE_ROUNDING: f64 = 1e-8;

/// Returns the minimum and maximum eigenvalue of a symmetric matrix; `None` if it is not symmetric or not finite.
pub(crate) fn eigenvalue_range(matrix: &Matrix3<f64>) -> Option<(f64, f64)> {
    let [min, _, max] = symmetric_eigenvalues(matrix);
    let usable = *matrix == matrix.transpose() && min.is_finite() && max.is_finite();
    usable.then_some((min, max))
}

/// Target of the tip's pose.
#[derive(Clone, Copy, Debug)]
pub struct PoseTarget<'a> {
    /// Where the tip should be, and how it should be turned.
    pub reference: &'a PoseReference,
    /// `K` and `B`.
    pub gains: &'a PoseGains,
}

impl Target<6> for PoseTarget<'_> {
    #[inline(always)]
    fn velocity(&self) -> Vector<6> {
        self.reference.velocity()
    }

    #[inline(always)]
    fn acceleration(&self) -> Vector<6> {
        self.reference.acceleration()
    }

    #[inline(always)]
    fn spring(&self, base_from_tip: &Pose) -> Vector<6> {
        let wanted = &self.reference.base_from_tip;
        let error = wanted.translation - base_from_tip.translation;
        let stiffness = &self.gains.stiffness_nm_per_rad;
        pair(
            &(self.gains.stiffness_n_per_m * error),
            &orientation_torque(stiffness, &wanted.rotation, &base_from_tip.rotation),
        )
    }

    #[inline(always)]
    fn damper(&self, tip_velocity: &Vector<6>) -> Vector<6> {
        let (reference, gains) = (self.reference, self.gains);
        let linear = reference.velocity_m_per_s - tip_velocity.fixed_rows::<3>(0);
        let angular = reference.angular_velocity_rad_per_s - tip_velocity.fixed_rows::<3>(3);
        pair(
            &(gains.damping_n_s_per_m * linear),
            &(gains.damping_nm_s_per_rad * angular),
        )
    }
}

/// Returns the torque of a symmetric stiffness from the orientation `found` towards `wanted`, base axes
/// \[N m\].
#[inline]
pub fn orientation_torque(
    stiffness_nm_per_rad: &Matrix3<f64>,
    wanted: &Matrix3<f64>,
    found: &Matrix3<f64>,
) -> Vector3<f64> {
    // The energy is tr(G (1 - E)), with E the rotation from `found` to `wanted` and G = tr(K) / 2 - K.
    let half_trace = 0.5 * stiffness_nm_per_rad.trace();
    let weight = Matrix3::from_diagonal_element(half_trace) - stiffness_nm_per_rad;
    let moment = weight * (wanted * found.transpose());
    Vector3::new(
        moment.m32 - moment.m23,
        moment.m13 - moment.m31,
        moment.m21 - moment.m12,
    )
}

#[inline(always)]
fn pair(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector<6> {
    Vector::<6>::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// Stiffness of the joints towards a posture, with bounded torque: for the null space of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture<const N: usize> {
    /// Angles \[rad\].
    pub position_rad: Vector<N>,
    /// Stiffness of each joint \[N m/rad\], zero or more.
    pub stiffness_nm_per_rad: Vector<N>,
    /// Greatest torque of each joint \[N m\], zero or more.
    pub max_torque_nm: Vector<N>,
}

impl<const N: usize> Posture<N> {
    /// Returns the torque at the joint angles `position_rad` \[rad\], before its projection \[N m\].
    pub fn torque_nm(&self, position_rad: &Vector<N>) -> Vector<N> {
        let error = self.position_rad - position_rad;
        let torque = self.stiffness_nm_per_rad.component_mul(&error);
        torque.inf(&self.max_torque_nm).sup(&-self.max_torque_nm)
    }
}
