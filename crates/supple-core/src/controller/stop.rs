//! The safe action: how a fault stops the motion, and when the drives brake instead.
//!
//! ```text
//! tau = G - s p / t_s        p = H qd        0 <= s <= 1        t_s = 4 delay
//! ```
//!
//! **It cannot excite the arm.** Its power `-s qd^T H qd / t_s` takes energy from any motion, as
//! Coriolis torques have zero power; if a joint or motor limit applies, `s` scales all joints
//! alike, so that this remains true. Without delay every motion decays with the single time
//! constant `t_s`, independent of the arm, its pose and its inertia. With a delay `d`, each of the
//! arm's independent motions obeys `v' = -v(t - d) / t_s`, which decays without overshoot up to `d
//! / t_s = 1/e` and is stable up to `pi/2`. With `delay` for `d` ([`super::Controller::delay_s`]:
//! 3.5 cycles and the estimator's lag) the ratio is 1/4, so that an error of the inertia or of the
//! delay by half is tolerated before there is overshoot, and by a factor of six before it is
//! unstable. A rate limit lags behind a torque that changes faster: this one changes by no more
//! than the joint's limit in `t_s`, which is slower than the rate limit of the safe action (the
//! joint's limit in 5 ms) at any speed.
//!
//! **Braking replaces it** (no torque, drives that short their motors) if the arm does not come to
//! rest because of a defective encoder, a defective motor or a wrong model. "Moving" means faster
//! than a fifth of the speed limit of a joint or of the tip. The drives brake if (1) the arm moves
//! with over 1.25 times its kinetic energy before the fault; (2) the arm still moves 0.2 s after
//! the fault; (3) an external torque above a tenth of a joint's limit acts for 50 ms, either later
//! than 0.15 s after the fault or at a joint whose encoder is unchanged and may be stuck; (4) the
//! external torques, each divided by a twentieth of its joint's limit, had a root of the sum of
//! squares above one for 50 ms before a speed limit was exceeded, while the arm followed a
//! reference out of contact.

use super::Controller;
use super::activity::Activity;
use super::checks::MOVING_SHARE;
use super::fault::{Fault, SafeAction};
use super::state::State;
use crate::law::impedance::Torques;
use crate::math::{Vector, Vector3, abs};

/// Settling time of the velocity estimate after a step in speed, as a multiple of the delay.
const ESTIMATOR_SETTLING_DELAYS: f64 = 2.0;
/// Time within which the arm must come to rest \[s\].
pub(crate) const STOP_TIMEOUT_S: f64 = 0.2;
/// Ratio to the kinetic energy before the fault above which the arm counts as accelerating.
pub(crate) const ENERGY_GROWTH_LIMIT: f64 = 1.25;
/// Fraction of a joint's torque limit above which an external torque would move a joint at rest.
const UNEXPLAINED_SHARE: f64 = 0.1;
/// Time for which such a torque may act \[s\].
const UNEXPLAINED_S: f64 = 0.05;
/// Time after which an impact and the observer's response to it have decayed \[s\].
const IMPACT_S: f64 = 0.15;
/// Decay time of the peak kinetic energy \[s\].
const ENERGY_PEAK_DECAY_S: f64 = 0.2;

impl<const N: usize> State<N> {
    /// Gravity compensation and damping of the momentum within the limits.
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
        let velocity = &self.estimator.velocity_rad_per_s;
        let energy_j = 0.5 * self.terms.momentum.dot(velocity);
        let config = controller.config();
        if !matches!(self.activity, Activity::Fault(SafeAction::GravityHold)) {
            let kept = (1.0 - elapsed_s / ENERGY_PEAK_DECAY_S).max(0.0);
            self.peak_energy_j = energy_j.max(self.peak_energy_j * kept);
            if self.is_pushed(controller) && self.follows_reference() {
                self.unexplained_s += elapsed_s;
            } else {
                self.unexplained_s = 0.0;
            }
            return;
        }
        if self.activity_s(config) <= ESTIMATOR_SETTLING_DELAYS * controller.delay_s() {
            // The velocity estimate has not yet settled to the speed at the time of the fault.
            self.peak_energy_j = energy_j.max(self.peak_energy_j);
            return;
        }
        let limits = &config.limits;
        let tip_limit = MOVING_SHARE * limits.tip_speed_m_per_s;
        let mut moving = tip_velocity.dot(tip_velocity) > tip_limit * tip_limit;
        for joint in 0..N {
            moving |= abs(velocity[joint]) > MOVING_SHARE * limits.joint_speed_rad_per_s[joint];
        }
        let time_s = self.activity_s(config);
        let late = time_s > STOP_TIMEOUT_S;
        let accelerates = energy_j > ENERGY_GROWTH_LIMIT * self.peak_energy_j;
        self.unexplained_s = if self.has_unexplained_torque(controller) {
            self.unexplained_s + elapsed_s
        } else {
            0.0
        };
        if moving && (late || accelerates) || self.unexplained_s > UNEXPLAINED_S {
            self.activity = Activity::Fault(SafeAction::Idle);
        }
    }

    /// The action of a fault: braking without delay if the arm is too fast because of a torque that acted for some time
    /// before, out of contact. A dead motor gives it; damping by motors of which one is dead might drive the arm.
    pub(super) fn action_of(&self, fault: &Fault) -> SafeAction {
        let too_fast = matches!(fault, Fault::JointSpeed { .. } | Fault::TipSpeed { .. });
        if self.activity.is_torque_off() || too_fast && self.unexplained_s > UNEXPLAINED_S {
            SafeAction::Idle
        } else {
            fault.safe_action()
        }
    }

    /// Whether the arm follows a reference out of contact, so that nobody is expected to move it.
    fn follows_reference(&self) -> bool {
        let may_be_led = matches!(
            self.activity,
            Activity::GravityHold | Activity::Float | Activity::JointImpedance { .. }
        );
        !(may_be_led || self.latch.in_contact())
    }

    /// Whether the external torques, each as a share of what counts as strong, exceed one together.
    fn is_pushed(&self, controller: &Controller<N>) -> bool {
        let external_nm = self.observer.external_torque_nm();
        let squares = external_nm.component_mul(&external_nm);
        squares.dot(&controller.push_weight_per_nm2) > 1.0
    }

    /// Whether an external torque acts that should move the arm: on a joint with an unchanged
    /// encoder, or on any joint after an impact has decayed.
    fn has_unexplained_torque(&self, controller: &Controller<N>) -> bool {
        let (config, encoders) = (controller.config(), controller.encoders());
        let external_nm = self.observer.external_torque_nm();
        let limits = &config.limits;
        let settled = self.activity_s(config) > IMPACT_S;
        (0..N).any(|joint| {
            let torque_nm = abs(external_nm[joint]);
            let strong = UNEXPLAINED_SHARE * limits.joint_torque_nm[joint];
            torque_nm > strong && (settled || self.stuck_encoders.any_unchanged(encoders, joint))
        })
    }
}

/// Largest fraction of `more`, 0 to 1, that keeps `base` plus this fraction within `limit`.
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
