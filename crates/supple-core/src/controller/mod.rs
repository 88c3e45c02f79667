//! The controller: an immutable [`Controller`], a [`State`] that it advances, and [`step`], which does
//! so once a cycle.

mod activity;
mod checks;
mod fault;
mod limiter;
mod mode;
mod output;
mod plan;
mod plausibility;
mod requests;
mod state;
mod step;
mod stop;
mod validate;

pub use fault::{Fault, SafeAction};
pub use limiter::{Limited, MotorGroups, limit, limit_torque};
pub use mode::{Breakaway, Mode, Refusal, Request};
pub use output::{Input, Output};
pub use plan::plan;
pub use state::State;
pub use step::step;
pub use validate::ConfigError;

use crate::config::Config;
use crate::linalg::Cholesky;
use crate::math::{Matrix, Vector};

/// A configuration that was found sound, and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Controller<const N: usize> {
    config: Config<N>,
    groups: MotorGroups<N>,
    /// `j2mp`.
    motor_from_joint: Matrix<N, N>,
    delay_s: f64,
    torque_step_nm: Vector<N>,
    stop_step_nm: Vector<N>,
}

/// Cycles between a measurement and the torque that answers it, at most, with half a cycle for the torque that
/// is held meanwhile.
const DELAY_CYCLES: f64 = 3.5;
/// Time in which the safe action may take a joint's whole torque away \[s\].
const STOP_TORQUE_S: f64 = 0.005;

impl<const N: usize> Controller<N> {
    /// Checks every entry.
    ///
    /// # Errors
    /// [`ConfigError`] names the entry, the joint and the value.
    pub fn new(config: Config<N>) -> Result<Self, ConfigError> {
        validate::validate(&config)?;
        let to_joint = &config.joint_from_motor;
        // Validation has found the square positive definite.
        let motor_from_joint = Cholesky::new(&(to_joint.transpose() * to_joint))
            .map_or_else(Matrix::identity, |square| {
                square.solve(&to_joint.transpose())
            });
        Ok(Controller {
            motor_from_joint,
            groups: MotorGroups::new(&config.joint_from_motor),
            delay_s: DELAY_CYCLES * config.period_s + 2.0 / config.estimator_rad_per_s,
            torque_step_nm: config.limits.torque_rate_nm_per_s * config.period_s,
            stop_step_nm: Vector::from_fn(|i, _| {
                let slow = config.limits.torque_rate_nm_per_s[i];
                let fast = config.limits.joint_torque_nm[i] / STOP_TORQUE_S;
                slow.max(fast) * config.period_s
            }),
            config,
        })
    }

    /// From a motion to the torque that answers it, at most \[s\]: three and a half cycles, and the lag of the
    /// velocity estimate.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Greatest change of joint torque in a cycle \[N m\]: by the rate limit, or what the safe action needs to take
    /// a torque away.
    pub fn torque_step_nm(&self, stopping: bool) -> &Vector<N> {
        if stopping {
            &self.stop_step_nm
        } else {
            &self.torque_step_nm
        }
    }

    /// What it was built from.
    pub fn config(&self) -> &Config<N> {
        &self.config
    }

    /// `j2mp`: motor angles from joint angles.
    pub fn motor_from_joint(&self) -> &Matrix<N, N> {
        &self.motor_from_joint
    }

    /// Motors behind the joints.
    pub fn motors(&self) -> &MotorGroups<N> {
        &self.groups
    }
}
