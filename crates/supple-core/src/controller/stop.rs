//! The safe action: how a fault stops the motion, and when the drives brake instead.
//!
//! ```text
//! tau = G - k p / t_stop        p = H qd        0 <= k <= 1        t_stop = 4 delay
//! ```
//!
//! with the gravity compensation `G`, the generalised momentum `p`, and a scale `k` that keeps the torque limits. A joint whose gravity
//! compensation alone exceeds its limit does not reduce `k`; only the torque of that joint is limited.
//!
//! **It cannot excite the arm.** Its power `-k qd^T H qd / t_stop` takes energy from any motion, as Coriolis torques have
//! zero power; if a joint or motor limit applies, `k` scales all joints alike, so that this remains true. Without delay every
//! motion decays with the single time constant `t_stop`, independent of the arm, its pose and its inertia. With a delay `d`,
//! each mode of the arm obeys `v' = -v(t - d) / t_stop`, which decays without overshoot up to `d / t_stop = 1/e` and is stable
//! up to `pi/2`. With `delay` for `d` ([`super::Controller::delay_s`]: 3.5 cycles and the estimator's lag) the ratio is 1/4:
//! inertia or delay may be wrong by a factor of 1.5 without overshoot, and by a factor of six without instability. The rate
//! limit adds no lag: the damping torque changes by at most a joint's torque limit within `t_stop`, and the rate limit of
//! the safe action allows that change within 5 ms.
//!
//! **Braking replaces it** (no torque, drives that short their motors) if the arm does not come to rest because of a defective
//! encoder, a defective motor or a wrong model. The arm *moves* if a joint or the tip is faster than a fifth of its speed limit;
//! external torques are *large* if the norm of `tau_i / limit_i` over the joints exceeds a twentieth. The drives brake
//!
//! 1. if a motion fault occurs (see `is_of_motion`) and, at the fault or within the loop's delay after it, the external torques
//!    match those of a missing or reversed gravity compensation, see `resembles_gravity_failure`. Dead motors, reversed motors
//!    and gravity of the wrong sign cause them. An obstacle takes power from the arm, and an impact causes larger torques;
//!    neither matches;
//! 2. if the arm moves and its kinetic energy exceeds 1.2 times its recent peak (decaying within 0.2 s, and including the first
//!    averaging window after the fault), see `stopping_motion.rs`;
//! 3. if the arm still moves 0.2 s after the fault;
//! 4. if an external torque above a tenth of a joint's limit acts for 50 ms, either later than 0.15 s after the fault or at a
//!    joint whose encoder is unchanged and may be stuck;
//! 5. at once, if a speed limit was exceeded after large external torques had acted for 50 ms, while the arm followed a
//!    reference out of contact.

use super::Controller;
use super::activity::Activity;
use super::fault::{Fault, SafeAction};
use super::prepared::LARGE_TORQUE_SHARE;
use super::state::State;
use super::stopping_motion::is_moving;
use crate::law::impedance::Torques;
use crate::math::{Vector, Vector3, abs};

/// Settling time of the velocity estimate after a step in speed, as a multiple of the delay.
const ESTIMATOR_SETTLING_DELAYS: f64 = 2.0;
/// Time within which the arm must become slower than a fifth of its speed limits \[s\].
pub(crate) const STOP_TIMEOUT_S: f64 = 0.2;
/// Fraction of a joint's torque limit above which an external torque in a fault would move a joint at rest.
const RESIDUAL_TORQUE_SHARE: f64 = 0.1;
/// Time for which such a torque may act \[s\].
const RESIDUAL_TORQUE_S: f64 = 0.05;
/// Time for which large external torques must have acted before a speed limit is exceeded, so that the drives brake at once
/// \[s\].
const LARGE_TORQUE_S: f64 = 0.05;
/// Time after which an impact and the observer's response to it have decayed \[s\].
const IMPACT_S: f64 = 0.15;
/// Ratio of the estimated inertial torque to the largest that reversed motors can cause, above which an impact is assumed.
/// Greater than one, because a motor that drives through an elastic cable accelerates against its rotor's inertia alone.
const IMPACT_RATIO: f64 = 4.0;
/// Minimum power of the external torques if gravity compensation fails, as a fraction of their power with every joint at its
/// speed limit in their direction.
const MIN_SPEED_FRACTION: f64 = 0.05;
/// Maximum ratio of the external torque to the gravity compensation if the compensation is missing or reversed: two for a
/// reversed one, plus one for the torque that a position loop adds.
const MAX_GRAVITY_RATIO: f64 = 3.0;
/// Minimum of this ratio.
const MIN_GRAVITY_RATIO: f64 = 1.1;
/// Minimum of this ratio in modes in which a hand may guide the arm.
const MIN_GRAVITY_RATIO_GUIDED: f64 = 1.4;
/// Decay time of the peak kinetic energy \[s\].
const ENERGY_PEAK_DECAY_S: f64 = 0.2;

impl<const N: usize> State<N> {
    /// Returns the gravity compensation and damping of the momentum within the limits.
    pub(super) fn stopping(&self, controller: &Controller<N>) -> Torques<N> {
        let limits = &controller.config().limits;
        let gravity = self.terms.gravity;
        let damping = self.terms.momentum / -controller.stop_s();
        let motors = controller.motors();
        let share = fraction_within_limit(&limits.joint_torque_nm, &gravity, &damping).min(
            fraction_within_limit(
                &limits.motor_torque_nm,
                &motors.motor_torque_nm(&gravity),
                &motors.motor_torque_nm(&damping),
            ),
        );
        Torques {
            gravity,
            damping: damping * share,
            ..Torques::zeros()
        }
    }

    /// Tracks the recent peak of kinetic energy; in a fault switches to braking if the arm does not
    /// stop.
    pub(super) fn supervise_stop(
        &mut self,
        controller: &Controller<N>,
        tip_velocity: &Vector3<f64>,
        elapsed_s: f64,
    ) {
        let velocity = self.estimator.velocity_rad_per_s;
        let energy_j = 0.5 * self.terms.momentum.dot(&velocity);
        let config = controller.config();
        if !matches!(self.activity, Activity::Fault(SafeAction::Stop)) {
            let kept = (1.0 - elapsed_s / ENERGY_PEAK_DECAY_S).max(0.0);
            self.peak_energy_j = energy_j.max(self.peak_energy_j * kept);
            if self.has_large_external_torque(controller) && self.follows_reference() {
                self.large_torque_s += elapsed_s;
            } else {
                self.large_torque_s = 0.0;
            }
            return;
        }
        self.relax_position_limits(config);
        let time_s = self.activity_s(config);
        let motion = &mut self.stopping_motion;
        let resolution_rad = self.stuck_encoders.resolution_rad(controller.encoders());
        let accelerates =
            motion.gains_energy(config, &self.position, &resolution_rad, &self.terms, time_s);
        let late = time_s > STOP_TIMEOUT_S && is_moving(&config.limits, &velocity, tip_velocity);
        // The observer follows the velocity estimate.
        let settling_s = ESTIMATOR_SETTLING_DELAYS * controller.delay_s();
        let residual = time_s > settling_s && self.has_residual_torque(controller);
        let motion = &mut self.stopping_motion;
        motion.residual_torque_s = match residual {
            true => motion.residual_torque_s + elapsed_s,
            false => 0.0,
        };
        let gravity_fails = time_s <= controller.delay_s()
            && self.fault.is_some_and(|fault| is_of_motion(&fault))
            && self.resembles_gravity_failure(controller, self.stopping_motion.follows_reference);
        if accelerates
            || late
            || gravity_fails
            || self.stopping_motion.residual_torque_s > RESIDUAL_TORQUE_S
        {
            self.activity = Activity::Fault(SafeAction::Brake);
        }
    }

    /// Returns the safe action of a fault. The drives brake at once if gravity compensation has failed, or if a speed limit was
    /// exceeded after large external torques had acted while the arm followed a reference out of contact: a dead motor causes
    /// such torques, and damping by the other motors could accelerate the arm.
    pub(super) fn action_of(&self, controller: &Controller<N>, fault: &Fault) -> SafeAction {
        let too_fast = matches!(fault, Fault::JointSpeed { .. } | Fault::TipSpeed { .. });
        if self.activity.is_torque_off()
            || too_fast && self.large_torque_s > LARGE_TORQUE_S
            || is_of_motion(fault)
                && self.resembles_gravity_failure(controller, self.follows_reference())
        {
            SafeAction::Brake
        } else {
            fault.safe_action()
        }
    }

    /// Returns whether the arm follows a reference out of contact, so that nobody is expected to move it.
    pub(super) fn follows_reference(&self) -> bool {
        let may_be_led = matches!(
            self.activity,
            Activity::GravityHold | Activity::Float | Activity::JointImpedance { .. }
        );
        !(may_be_led || self.latch.in_contact())
    }

    /// Returns whether the external torques are large.
    fn has_large_external_torque(&self, controller: &Controller<N>) -> bool {
        let external_nm = self.observer.external_torque_nm();
        let squares = external_nm.component_mul(&external_nm);
        squares.dot(&controller.large_torque_weight_per_nm2) > 1.0
    }

    /// Returns whether the external torques match those of a missing or reversed gravity compensation:
    ///
    /// - they are large, their power is positive, and the arm accelerates;
    /// - at every joint where they are large, their ratio to the gravity compensation is within the limits, with the same sign
    ///   at all joints;
    /// - no joint accelerates as in an impact.
    #[cold]
    #[inline(never)]
    fn resembles_gravity_failure(
        &self,
        controller: &Controller<N>,
        follows_reference: bool,
    ) -> bool {
        let config = controller.config();
        let external_nm = self.observer.external_torque_nm();
        let slow = config.limits.joint_speed_rad_per_s * MIN_SPEED_FRACTION;
        let power_w = external_nm.dot(&self.estimator.velocity_rad_per_s);
        if !(self.has_large_external_torque(controller) && power_w > external_nm.abs().dot(&slow)) {
            return false;
        }
        let innovation_rad =
            self.position + self.elastic_deflection_rad - self.estimator.position_rad;
        let gains = controller.estimator_gains(1);
        let inertial_torque_nm =
            self.terms.mass_matrix * gains.acceleration_rad_per_s2(&innovation_rad);
        if inertial_torque_nm.dot(&self.estimator.velocity_rad_per_s) <= 0.0 {
            return false;
        }
        let min_ratio = match follows_reference {
            true => MIN_GRAVITY_RATIO,
            false => MIN_GRAVITY_RATIO_GUIDED,
        };
        let against_weight = external_nm.dot(&self.terms.gravity) > 0.0;
        let mut any_multiple = false;
        let all_consistent = (0..N).all(|joint| {
            let (external, gravity) = (external_nm[joint], self.terms.gravity[joint]);
            let large_nm = LARGE_TORQUE_SHARE * config.limits.joint_torque_nm[joint];
            let reversed_nm = MAX_GRAVITY_RATIO * abs(gravity);
            let struck = abs(inertial_torque_nm[joint]) > IMPACT_RATIO * (reversed_nm + large_nm);
            let small = abs(external) <= large_nm;
            let multiple = (external * gravity > 0.0) == against_weight
                && (min_ratio * abs(gravity)..=reversed_nm).contains(&abs(external));
            any_multiple |= !small && multiple;
            (small || multiple) && !struck
        });
        any_multiple && all_consistent
    }

    /// Returns whether an external torque acts that should move the arm: on a joint with an unchanged
    /// encoder, or on any joint after an impact has decayed.
    fn has_residual_torque(&self, controller: &Controller<N>) -> bool {
        let (config, encoders) = (controller.config(), controller.encoders());
        let external_nm = self.observer.external_torque_nm();
        let limits = &config.limits;
        let settled = self.activity_s(config) > IMPACT_S;
        (0..N).any(|joint| {
            let torque_nm = abs(external_nm[joint]);
            let threshold_nm = RESIDUAL_TORQUE_SHARE * limits.joint_torque_nm[joint];
            torque_nm > threshold_nm
                && (settled || self.stuck_encoders.any_unchanged_of(encoders, joint))
        })
    }
}

/// Returns whether the fault reports an abnormal motion: a limit of position, speed, workspace or tracking, or a collision.
fn is_of_motion(fault: &Fault) -> bool {
    matches!(
        fault,
        Fault::JointPosition { .. }
            | Fault::JointSpeed { .. }
            | Fault::TipSpeed { .. }
            | Fault::TrackingError { .. }
            | Fault::RotationError { .. }
            | Fault::JointTrackingError { .. }
            | Fault::JointCollision { .. }
            | Fault::TipCollision { .. }
            | Fault::Workspace { .. }
    )
}

/// Returns the largest fraction of `more`, 0 to 1, that keeps `base` plus this fraction within `limit`.
fn fraction_within_limit<const N: usize>(
    limit: &Vector<N>,
    base: &Vector<N>,
    more: &Vector<N>,
) -> f64 {
    (0..N).fold(1.0_f64, |share, i| {
        let margin = if more[i] > 0.0 {
            limit[i] - base[i]
        } else {
            limit[i] + base[i]
        };
        // If `base` alone exceeds the limit of a joint, skip it here: the limiter reduces that
        // joint, and the other joints keep their full damping.
        if margin > 0.0 && abs(more[i]) > margin {
            share.min(margin / abs(more[i]))
        } else {
            share
        }
    })
}
