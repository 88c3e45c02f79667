//! Checks that the loop's delay allows a requested damping in the pose of the request.

use super::Controller;
use super::checks::DAMPING_MARGIN;
use super::mode::Refusal;
use super::pose_task::DIRECTIONS;
use super::state::State;
use crate::config::{Gains, JointGains, Role};
use crate::law::impedance::Task;
use crate::math::linalg::Cholesky;
use crate::math::{Matrix, Matrix3, Vector, sqrt};

impl<const N: usize> State<N> {
    /// Refuses damping that would excite the arm at its current pose because of the loop delay.
    pub(super) fn check_damping(
        &self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        gains: &Gains,
    ) -> Result<(), Refusal> {
        let (Some(task), Some(mass)) = (task, Cholesky::new(&self.terms.mass_matrix)) else {
            return Ok(());
        };
        let mobility = task.jacobian * mass.solve(&task.jacobian.transpose());
        let root = Matrix3::from_diagonal(&gains.damping_n_s_per_m.map(sqrt));
        // Upper bound of the fastest damping rate, at most sqrt(3) times too large.
        let rate_per_s = sqrt((root * mobility * root).norm_squared());
        within_delay(
            "damping_n_s_per_m at the delay of this loop",
            gains.damping_n_s_per_m.max(),
            rate_per_s * controller.delay_s(),
        )
    }

    /// Refuses linear and rotational damping matrices about the base axes if the loop's delay does not allow every pair of them.
    pub(super) fn check_pose_damping(
        &self,
        controller: &Controller<N>,
        linear: &[Matrix3<f64>],
        rotational: &[Matrix3<f64>],
    ) -> Result<(), Refusal> {
        let Some(mass) = Cholesky::new(&self.terms.mass_matrix) else {
            return Ok(());
        };
        let roles = &controller.config().roles;
        let active = Matrix::<DIRECTIONS, N>::from_fn(|k, joint| match roles[joint] {
            Role::Active => self.terms.jacobian[(k, joint)],
            Role::Held { .. } => 0.0,
        });
        let mobility = active * mass.solve(&active.transpose());
        for linear in linear {
            for rotational in rotational {
                let mut damping = Matrix::<DIRECTIONS, DIRECTIONS>::zeros();
                damping.fixed_view_mut::<3, 3>(0, 0).copy_from(linear);
                damping.fixed_view_mut::<3, 3>(3, 3).copy_from(rotational);
                // Root of the sum of the squared eigenvalues, which are real and not negative: an upper bound of the fastest
                // damping rate, at most sqrt(6) times too large.
                let rates = damping * mobility;
                let rate_per_s = sqrt((rates * rates).trace().max(0.0));
                within_delay(
                    "rotational damping_nm_s_per_rad, with damping_n_s_per_m, at the delay of this loop",
                    rotational.diagonal().max(),
                    rate_per_s * controller.delay_s(),
                )?;
            }
        }
        Ok(())
    }

    /// Refuses damping at the active joints that the loop's delay does not allow.
    pub(super) fn check_joint_damping(
        &self,
        controller: &Controller<N>,
        gains: &JointGains<N>,
    ) -> Result<(), Refusal> {
        let Some(mass) = Cholesky::new(&self.terms.mass_matrix) else {
            return Ok(());
        };
        let damping = &gains.damping_nm_s_per_rad;
        let root = Vector::from_fn(|joint, _| match controller.config().roles[joint] {
            Role::Active => sqrt(damping[joint]),
            Role::Held { .. } => 0.0,
        });
        let root = Matrix::<N, N>::from_diagonal(&root);
        // Upper bound of the fastest damping rate, at most sqrt(N) times too large.
        let rate_per_s = sqrt((root * mass.solve(&root)).norm_squared());
        within_delay(
            "impedance_damping_nm_s_per_rad at the delay of this loop",
            damping.max(),
            rate_per_s * controller.delay_s(),
        )
    }
}

/// Refuses damping whose rate times the delay of the loop exceeds [`DAMPING_MARGIN`].
fn within_delay(entry: &'static str, value: f64, rate_times_delay: f64) -> Result<(), Refusal> {
    let share = rate_times_delay / DAMPING_MARGIN;
    if share > 1.0 {
        return Err(Refusal::Value {
            entry,
            value,
            limit: value / share,
        });
    }
    Ok(())
}
