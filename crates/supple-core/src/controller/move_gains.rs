//! Gains of the move mode that the delay of the loop allows in a pose.
//!
//! With a delayed velocity, damping `D` of joints with mass matrix `H` is stable while the greatest eigenvalue of
//! `H^-1 D` times the delay stays below `pi/2`. A joint whose axis the arm lies along has little inertia: there its
//! gains are reduced, stiffness and damping by the same share, so that its loop keeps its shape in time scaled by
//! that share. The eigenvalues of `S D^1/2 H^-1 D^1/2`, with the diagonal `S` of the shares, are at most its
//! greatest row sum (Gershgorin).

use super::Controller;
use crate::config::JointGains;
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Vector, abs, sqrt};

/// Greatest eigenvalue of `H^-1 D` times the delay: three quarters of the stability limit.
const MOVE_DAMPING_MARGIN: f64 = 0.75 * core::f64::consts::FRAC_PI_2;

impl<const N: usize> Controller<N> {
    /// Gains of the move mode with this mass matrix \[kg m^2\]: those of the configuration, less where the delay of the
    /// loop does not allow them.
    #[inline(never)]
    pub fn move_gains(&self, mass_matrix: &Matrix<N, N>) -> JointGains<N> {
        let gains = &self.config.move_gains;
        let Some(mass) = Cholesky::new(mass_matrix) else {
            return *gains;
        };
        let inverse = mass.solve(&Matrix::<N, N>::identity());
        let root = gains.damping_nm_s_per_rad.map(sqrt);
        let share = Vector::from_fn(|joint, _| {
            let mut sum = 0.0;
            for other in 0..N {
                sum += abs(inverse[(joint, other)]) * root[other];
            }
            let rate_times_delay = root[joint] * sum * self.delay_s;
            if rate_times_delay > MOVE_DAMPING_MARGIN {
                MOVE_DAMPING_MARGIN / rate_times_delay
            } else {
                1.0
            }
        });
        JointGains {
            stiffness_nm_per_rad: gains.stiffness_nm_per_rad.component_mul(&share),
            damping_nm_s_per_rad: gains.damping_nm_s_per_rad.component_mul(&share),
        }
    }
}
