//! The controller: an immutable [`Controller`], a [`State`] that it advances, and [`step`], which does
//! so once a cycle.

mod activity;
mod checks;
mod fault;
mod limiter;
mod mode;
mod output;
mod state;
mod step;
mod validate;

pub use fault::{Fault, SafeAction};
pub use limiter::{MotorGroups, limit_torque};
pub use mode::{Breakaway, Mode, Refusal, Request};
pub use output::{Input, Output};
pub use state::State;
pub use step::step;
pub use validate::ConfigError;

use crate::config::Config;
use crate::linalg::Cholesky;
use crate::math::Matrix;

/// A configuration that was found sound, and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Controller<const N: usize> {
    config: Config<N>,
    groups: MotorGroups<N>,
    /// `j2mp`.
    motor_from_joint: Matrix<N, N>,
}

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
            config,
        })
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
