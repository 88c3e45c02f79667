//! Direction of the dry friction that the law feeds forward, for joints whose presliding travel is known.
//!
//! The direction follows the joint velocities of the reference, see [`crate::friction`]. While the reference rests, the
//! direction fades, so that an arm at rest has no friction feed-forward. In contact the arm does not follow the reference: there the
//! direction follows the measured angles, as the friction itself does, through the impact, the rebounds and the rest. Of the
//! force on the obstacle then that of the spring remains; a direction from the reference would leave the difference
//! between the fed-forward and the real friction, which is several times as large at low stiffness. In free motion the measured
//! direction would make the arm unstable where the model has too much friction. Modes with stiff joint loops do not use either.
//!
//! The joint velocities are computed for a tip at its reference. At the measured pose the same tip velocity gives others: at
//! 5 N/m the tip is millimetres away from its reference, and a joint that does not move along the reference would seem to
//! move by some milliradians, over which its dry friction reverses.

use super::Controller;
use super::activity::Activity;
use super::state::State;
use crate::config::{FrictionVelocity, STRIBECK_AVERAGING_S};
use crate::dynamics::Terms;
use crate::law::impedance::Task;
use crate::math::{Vector, Vector3, abs, exp, sqrt};
use crate::trajectory::Reference;

/// Fraction of the friction model's velocity band below which the reference of a joint counts as resting.
const REST_SHARE: f64 = 0.1;
/// Time constant with which the direction fades at rest \[s\].
const REST_S: f64 = 0.5;
/// Maximum distance of the tip from its reference over which the Jacobian is extrapolated \[m\].
const EXTRAPOLATED_M: f64 = 0.05;

impl<const N: usize> State<N> {
    /// Updates the velocities at which the Stribeck effect is evaluated: the steps of a coarse encoder in a period are as large as the
    /// Stribeck speed.
    #[inline(never)]
    pub(super) fn update_stribeck_velocity(&mut self, elapsed_s: f64) {
        let share = 1.0 - exp(-elapsed_s / STRIBECK_AVERAGING_S);
        let change = self.estimator.velocity_rad_per_s - self.stribeck_velocity_rad_per_s;
        self.stribeck_velocity_rad_per_s += change * share;
    }

    /// Updates the direction of the dry friction and the joint velocities of the reference for one cycle.
    #[inline(never)]
    pub(super) fn update_dry_direction(
        &mut self,
        controller: &Controller<N>,
        tracking: Option<(&Task<N>, &Reference)>,
        pose: bool,
        elapsed_s: f64,
    ) {
        let config = controller.config();
        let play_rad = self.stuck_encoders.resolution_rad(controller.encoders());
        self.measured_direction
            .update(&self.friction, &self.position, &play_rad);
        let tracks = matches!(self.activity, Activity::Track(_) | Activity::SetPoints(_))
            && config.law.friction_velocity == FrictionVelocity::Reference
            && !pose;
        let Some((task, reference)) = tracking.filter(|_| tracks) else {
            self.dry_direction = None;
            self.velocity_at_reference_rad_per_s = None;
            return;
        };
        let mut directions = self.dry_direction.unwrap_or_else(Vector::zeros);
        let velocity = velocity_at_reference(&self.terms, task, reference);
        let in_contact = self.latch.in_contact();
        let blocked = in_contact && config.latch.fade && config.latch.hold_friction;
        for (i, friction) in self.friction.iter().enumerate() {
            let direction = directions[i];
            let rests = abs(velocity[i]) < REST_SHARE * friction.band_rad_per_s;
            directions[i] = if friction.presliding_rad == 0.0 {
                friction.direction(velocity[i])
            } else if blocked {
                self.measured_direction.of_joint(i)
            } else if in_contact {
                direction
            } else if rests {
                direction * exp(-elapsed_s / REST_S)
            } else {
                friction.direction_after(
                    direction,
                    velocity[i] * elapsed_s / config.law.presliding_share,
                )
            };
        }
        self.dry_direction = Some(directions);
        self.velocity_at_reference_rad_per_s = Some(velocity);
    }
}

/// Returns the joint velocities of the reference for a tip at its reference, to first order in the tip's distance \[rad/s\].
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
    // The motion of joint i changes column j of the Jacobian by the cross product of that column with the axis of i if i <= j,
    // and with the axis of j otherwise.
    let (mut turned, mut turning) = (Vector3::zeros(), Vector3::zeros());
    let mut bias = Vector3::zeros();
    for j in 0..N {
        let [lx, ly, lz, ax, ay, az] = terms.jacobian.data.0[j];
        let (lever, axis) = (Vector3::new(lx, ly, lz), Vector3::new(ax, ay, az));
        turned += axis * change[j];
        bias += turned.cross(&(lever * velocity[j])) + turning.cross(&(lever * change[j]));
        turning += axis * velocity[j];
    }
    velocity - task.inverse * bias
}
