//! Joint damping that the loop's delay allows in a pose, for the move mode and the soft stops.
//!
//! With a delayed velocity, damping `D` of joints with mass matrix `H` is stable while the maximum eigenvalue of
//! `H^-1 D` times the delay stays below `pi/2`. If the arm is aligned with the axis of a joint, that joint has little inertia.
//! Its stiffness and damping are then reduced by the same share, so that its loop keeps the same response, slowed by
//! that share. The eigenvalues of `S D^1/2 H^-1 D^1/2`, with the diagonal matrix `S` of the shares, are at most its
//! maximum row sum (Gershgorin).

use super::Controller;
use super::activity::Activity;
use super::checks::SoftStop;
use super::state::State;
use crate::config::{Config, JointGains, Role};
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector, abs, sqrt};

/// Maximum allowed eigenvalue of `H^-1 D` times the delay: three quarters of the stability limit.
const JOINT_DAMPING_MARGIN: f64 = 0.75 * core::f64::consts::FRAC_PI_2;

impl<const N: usize> Controller<N> {
    /// Returns the fraction of each joint's damping \[N m s/rad\] that the loop's delay allows with this mass matrix
    /// \[kg m^2\]: above 0, at most 1.
    #[inline(never)]
    pub fn allowed_damping_share(
        &self,
        mass_matrix: &Matrix<N, N>,
        damping_nm_s_per_rad: &Vector<N>,
    ) -> Vector<N> {
        let Some(mass) = Cholesky::new(mass_matrix) else {
            return Vector::repeat(1.0);
        };
        let inverse = mass.solve(&Matrix::<N, N>::identity());
        let root = damping_nm_s_per_rad.map(sqrt);
        Vector::from_fn(|joint, _| {
            let mut sum = 0.0;
            for other in 0..N {
                sum += abs(inverse[(joint, other)]) * root[other];
            }
            let rate_times_delay = root[joint] * sum * self.delay_s;
            if rate_times_delay > JOINT_DAMPING_MARGIN {
                JOINT_DAMPING_MARGIN / rate_times_delay
            } else {
                1.0
            }
        })
    }

    /// Returns the gains of the move mode with this mass matrix \[kg m^2\]: the configured gains, reduced for joints where the
    /// loop's delay does not allow them.
    pub fn move_gains(&self, mass_matrix: &Matrix<N, N>) -> JointGains<N> {
        let gains = &self.config.move_gains;
        let share = self.allowed_damping_share(mass_matrix, &gains.damping_nm_s_per_rad);
        JointGains {
            stiffness_nm_per_rad: gains.stiffness_nm_per_rad.component_mul(&share),
            damping_nm_s_per_rad: gains.damping_nm_s_per_rad.component_mul(&share),
        }
    }
}

impl<const N: usize> State<N> {
    /// Returns the soft stops in this pose: the configured ones, reduced for joints where the delay does not allow their damping
    /// in addition to the damping of the joint's own loop. `None` if no joint is in a soft zone, the common case.
    #[inline(always)]
    pub(super) fn soft_stops(&self, controller: &Controller<N>) -> Option<SoftStop<N>> {
        let zone_rad = controller.config().limits.soft_zone_rad;
        let depth = self
            .position_limits
            .soft_zone_depths(zone_rad, &self.position)?;
        Some(self.allowed_soft_stops(controller, &depth))
    }

    #[cold]
    #[inline(never)]
    fn allowed_soft_stops(&self, controller: &Controller<N>, depth: &Vector<N>) -> SoftStop<N> {
        let config = controller.config();
        let mut stop = SoftStop::new(&config.limits, depth);
        let of_loops = self.loop_damping_nm_s_per_rad(controller);
        let together = of_loops + stop.damping_nm_s_per_rad;
        let share = controller.allowed_damping_share(&self.terms.mass_matrix, &together);
        for joint in 0..N {
            stop.spring_nm[joint] *= share[joint];
            stop.damping_nm_s_per_rad[joint] =
                (share[joint] * together[joint] - of_loops[joint]).max(0.0);
        }
        stop
    }

    /// Returns the damping of the joints' own loops in this mode and pose \[N m s/rad\].
    fn loop_damping_nm_s_per_rad(&self, controller: &Controller<N>) -> Vector<N> {
        let config: &Config<N> = controller.config();
        if self.holds_pose() || self.activity.has_joint_loops() {
            return controller
                .move_gains(&self.terms.mass_matrix)
                .damping_nm_s_per_rad;
        }
        Vector::from_fn(|joint, _| match (&config.roles[joint], &self.activity) {
            (
                Role::Held {
                    damping_nm_s_per_rad,
                    ..
                },
                _,
            ) => *damping_nm_s_per_rad,
            (Role::Active, Activity::JointImpedance { .. }) => {
                self.joint_gains.current().damping_nm_s_per_rad[joint]
            }
            (Role::Active, Activity::GravityHold) => config.hold_damping_nm_s_per_rad[joint],
            (Role::Active, _) => 0.0,
        })
    }
}
