//! Direction of the dry friction that the law feeds forward, where the travel of a reversal is known.
//!
//! It follows the joints of the reference, see [`crate::friction`]. While the reference rests it fades, so that an arm at
//! rest is left without friction feed-forward; in contact it stays as it is. Modes with stiff joint loops have no use for
//! it.

use super::activity::Activity;
use super::state::State;
use crate::config::{Config, FrictionVelocity};
use crate::law::impedance::Task;
use crate::math::{Vector, abs, exp};
use crate::trajectory::Reference;

/// Share of the band below which a joint of the reference rests.
const REST_SHARE: f64 = 0.1;
/// Time constant with which the direction fades at rest \[s\].
const REST_S: f64 = 0.5;

impl<const N: usize> State<N> {
    /// Follows the reference for a cycle.
    #[inline(never)]
    pub(super) fn follow_presliding(
        &mut self,
        config: &Config<N>,
        tracking: Option<(&Task<N>, &Reference)>,
        pose: bool,
        elapsed_s: f64,
    ) {
        let tracks = matches!(self.activity, Activity::Track(_) | Activity::SetPoints(_))
            && config.law.friction_velocity == FrictionVelocity::Reference
            && !pose;
        let Some((task, reference)) = tracking.filter(|_| tracks) else {
            self.dry_direction = None;
            return;
        };
        let mut directions = self.dry_direction.unwrap_or_else(Vector::zeros);
        let velocity = task.inverse * reference.velocity;
        let in_contact = self.latch.in_contact();
        for (i, friction) in config.friction.iter().enumerate() {
            let direction = directions[i];
            let rests = abs(velocity[i]) < REST_SHARE * friction.band_rad_per_s;
            directions[i] = if friction.presliding_rad == 0.0 {
                friction.direction(velocity[i])
            } else if in_contact {
                direction
            } else if rests {
                direction * exp(-elapsed_s / REST_S)
            } else {
                friction.direction_after(direction, velocity[i] * elapsed_s)
            };
        }
        self.dry_direction = Some(directions);
    }
}
