//! Direction of the dry friction that the law feeds forward, where the travel of a reversal is known.
//!
//! It follows the joints of the reference, see [`crate::friction`]. While the reference rests it fades, so that an arm at
//! rest is left without friction feed-forward; in contact it stays as it is. Modes with stiff joint loops have no use for
//! it.
//!
//! The reference's joints are those of a tip that is at its reference. At the measured pose the same tip velocity takes
//! others: at 5 N/m the tip is millimetres away, and a joint that the motion leaves alone would seem to move by some
//! milliradians, over which its dry friction turns round.

use super::activity::Activity;
use super::state::State;
use crate::config::{Config, FrictionVelocity};
use crate::dynamics::Terms;
use crate::law::impedance::Task;
use crate::math::{Vector, Vector3, abs, exp, sqrt};
use crate::trajectory::Reference;

/// Share of the band below which a joint of the reference rests.
const REST_SHARE: f64 = 0.1;
/// Time constant with which the direction fades at rest \[s\].
const REST_S: f64 = 0.5;
/// Distance of the tip from its reference up to which the Jacobian there is extrapolated \[m\].
const EXTRAPOLATED_M: f64 = 0.05;

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
        let velocity = velocity_at_reference(&self.terms, task, reference);
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

/// Joint velocities of the reference where the tip is at its reference, to first order in its distance \[rad/s\].
fn velocity_at_reference<const N: usize>(
    terms: &Terms<N>,
    task: &Task<N>,
    reference: &Reference,
) -> Vector<N> {
    let mut away = reference.position - terms.base_from_tip.translation;
    let square = away.dot(&away);
    if square > EXTRAPOLATED_M * EXTRAPOLATED_M {
        away *= EXTRAPOLATED_M / sqrt(square);
    }
    let (change, velocity) = (task.inverse * away, task.inverse * reference.velocity);
    // A joint turns the lever arms of all joints from itself on: column j of the Jacobian changes by its cross product
    // with the axes of the joints up to j, or with the axis of j for a joint beyond.
    let (mut turned, mut turning) = (Vector3::zeros(), Vector3::zeros());
    let mut bias = Vector3::zeros();
    for j in 0..N {
        let axis = terms.jacobian.fixed_view::<3, 1>(3, j).into_owned();
        let lever = terms.jacobian.fixed_view::<3, 1>(0, j).into_owned();
        turned += axis * change[j];
        bias += turned.cross(&(lever * velocity[j])) + turning.cross(&(lever * change[j]));
        turning += axis * velocity[j];
    }
    velocity - task.inverse * bias
}
