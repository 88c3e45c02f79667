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
pub use mode::{Mode, Refusal, Request};
pub use output::{Input, Output};
pub use state::State;
pub use step::step;
pub use validate::ConfigError;

use crate::config::Config;

/// A configuration that was found sound, and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Controller<const N: usize> {
    config: Config<N>,
    groups: MotorGroups<N>,
}

impl<const N: usize> Controller<N> {
    /// Checks every entry.
    ///
    /// # Errors
    /// [`ConfigError`] names the entry, the joint and the value.
    pub fn new(config: Config<N>) -> Result<Self, ConfigError> {
        validate::validate(&config)?;
        Ok(Controller {
            groups: MotorGroups::new(&config.joint_from_motor),
            config,
        })
    }

    /// What it was built from.
    pub fn config(&self) -> &Config<N> {
        &self.config
    }

    /// Motors behind the joints.
    pub fn motors(&self) -> &MotorGroups<N> {
        &self.groups
    }
}
