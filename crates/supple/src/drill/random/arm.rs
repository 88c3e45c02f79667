//! The arm of all random cases, its random poses, and draws from ranges and lists.

use supple_core::config::Role;
use supple_core::{Config, Controller, Vector};
use supple_experiment::ExperimentError;
use supple_model::Description;
use supple_plant::{PlantConfig, PlantOptions};
use supple_random::Random;

/// Data that all cases of an arm share.
pub(super) struct Arm<const N: usize> {
    pub(super) controller: Controller<N>,
    pub(super) ideal: PlantConfig<N>,
    pub(super) realistic: PlantConfig<N>,
}

impl<const N: usize> Arm<N> {
    /// Creates the data of an arm.
    pub(super) fn new(description: &Description) -> Result<Arm<N>, ExperimentError> {
        let config = description.config::<N>()?;
        let controller = Controller::new(config)?;
        let ideal = PlantConfig::from_description(description)?;
        let realistic = PlantOptions::realistic_of(description).apply(ideal.clone())?;
        Ok(Arm {
            controller,
            ideal,
            realistic,
        })
    }

    pub(super) fn config(&self) -> &Config<N> {
        self.controller.config()
    }

    /// Draws a pose within the soft stops; held joints have their held angles.
    pub(super) fn pose(&self, random: &mut Random) -> Vector<N> {
        let config = self.config();
        let limits = &config.limits;
        Vector::from_fn(|joint, _| match config.roles[joint] {
            Role::Held { position_rad, .. } => position_rad,
            Role::Active => {
                let margin = 1.5 * limits.soft_zone_rad;
                between(
                    random,
                    limits.position_lower_rad[joint] + margin,
                    limits.position_upper_rad[joint] - margin,
                )
            }
        })
    }

    /// Whether a motor moves only this joint, so that a fault of its encoder affects only this joint.
    pub(super) fn has_own_motor(&self, joint: usize) -> bool {
        let row = self.config().joint_from_motor.row(joint).into_owned();
        row.iter().filter(|ratio| **ratio != 0.0).count() == 1
    }
}

/// Draws a number from a uniform distribution between two numbers.
pub(super) fn between(random: &mut Random, from: f64, to: f64) -> f64 {
    from + (to - from) * random.uniform()
}

/// Draws one of the items.
pub(super) fn pick<'a, T>(random: &mut Random, items: &'a [T]) -> &'a T {
    &items[random.index(items.len())]
}
