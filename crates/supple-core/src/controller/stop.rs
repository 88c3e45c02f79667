//! The safe action: how motion is ended in a fault, and when that gives way to braking.
//!
//! ```text
//! tau = G - s p / t_s        p = H qd        0 <= s <= 1        t_s = 4 delay
//! ```
//!
//! **It cannot excite the arm.** Its power `-s qd^T H qd / t_s` takes energy from any motion, as Coriolis torques
//! have none; `s` scales all joints alike where a limit of joints or motors would cut, so that it stays so.
//! Without delay every motion decays with the one time constant `t_s`, whatever the arm, its pose and its
//! inertia. What is `d` old at the motors gives, for each of the arm's independent motions, `v' = -v(t - d) / t_s`,
//! which decays without overshoot up to `d / t_s = 1/e` and is stable up to `pi/2`. With `delay` for `d`
//! ([`super::Controller::delay_s`]: 3.5 cycles and the estimator's lag) it is at 1/4, so that the inertia may be
//! wrong by half, or the delay, before there is overshoot, and by six before it rings up. A rate limit lags
//! behind a torque that changes faster: this one changes by no more than the joint's limit in `t_s`, which is
//! slower than what the safe action is allowed (the joint's limit in 5 ms), whatever the speed.
//!
//! **It gives way to braking** (no torque, drives that short their motors) where the arm does not come to rest:
//! because an encoder, a motor or the model is not what it is taken for. Moving is faster than a fifth of a joint's
//! or of the tip's speed limit. An arm that moves with more kinetic energy than it had before the fault, by a
//! quarter, brakes from then on; an arm that still moves 0.2 s after the fault brakes too. So does one that bears,
//! for 50 ms, an external torque of a tenth of a joint's limit, 0.15 s after the fault or at a joint whose encoder says
//! the same angle again and again: it may be stuck.

use super::Controller;
use super::activity::Activity;
use super::fault::SafeAction;
use super::state::State;
use crate::config::Config;
use crate::impedance::Torques;
use crate::math::{Vector, Vector3, abs};

/// `t_s` over the delay.
const STOP_OVER_DELAY: f64 = 4.0;
/// Time in which the velocity estimate arrives at a speed that came at once, over the delay.
const SETTLES_OVER_DELAY: f64 = 2.0;
/// Share of a speed limit above which a joint or the tip moves.
pub(crate) const MOVING_SHARE: f64 = 0.2;
/// Time after which nothing moves any more \[s\].
pub(crate) const STOPPED_AFTER_S: f64 = 0.2;
/// Kinetic energy over that before the fault from which the arm gathers speed.
pub(crate) const GATHERS: f64 = 1.25;
/// Share of a joint's torque limit that does not go unnoticed by a joint that stands still.
const UNEXPLAINED_SHARE: f64 = 0.1;
/// Time for which such a torque may act, or such a joint be still \[s\].
const UNEXPLAINED_S: f64 = 0.05;
/// Time after which an impact, and what the observer makes of it, is over \[s\].
const IMPACT_S: f64 = 0.15;
/// Time in which the motion that the arm had is forgotten \[s\].
const MEMORY_S: f64 = 0.2;

impl<const N: usize> State<N> {
    /// Gravity, and what takes the momentum away within the limits.
    pub(super) fn stopping(&self, controller: &Controller<N>) -> Torques<N> {
        let limits = &controller.config().limits;
        let gravity = self.terms.gravity;
        let damping = self.terms.momentum / (-STOP_OVER_DELAY * controller.delay_s());
        let motors = controller.motors();
        let share = within(&limits.joint_torque_nm, &gravity, &damping).min(within(
            &limits.motor_torque_nm,
            &motors.motor_torque_nm(&gravity),
            &motors.motor_torque_nm(&damping),
        ));
        Torques {
            gravity,
            damping: damping * share,
            ..Torques::zeros()
        }
    }

    /// Remembers how much the arm moved of late, and in a fault goes on to braking where it does not stop.
    pub(super) fn watch_the_stop(
        &mut self,
        controller: &Controller<N>,
        tip_velocity: &Vector3<f64>,
        elapsed_s: f64,
    ) {
        let velocity = &self.estimator.velocity_rad_per_s;
        let energy_j = 0.5 * self.terms.momentum.dot(velocity);
        let config = controller.config();
        if !matches!(self.activity, Activity::Fault(SafeAction::GravityHold)) {
            let kept = (1.0 - elapsed_s / MEMORY_S).max(0.0);
            self.energy_j = energy_j.max(self.energy_j * kept);
            return;
        }
        if self.activity_s(config) <= SETTLES_OVER_DELAY * controller.delay_s() {
            // The estimate has yet to arrive at the speed at which the fault came.
            self.energy_j = energy_j.max(self.energy_j);
            return;
        }
        let limits = &config.limits;
        let tip_limit = MOVING_SHARE * limits.tip_speed_m_per_s;
        let mut moving = tip_velocity.dot(tip_velocity) > tip_limit * tip_limit;
        for joint in 0..N {
            moving |= abs(velocity[joint]) > MOVING_SHARE * limits.joint_speed_rad_per_s[joint];
        }
        let time_s = self.activity_s(config);
        let late = time_s > STOPPED_AFTER_S;
        let gathers = energy_j > GATHERS * self.energy_j;
        self.unexplained_s = if self.is_unexplained(config) {
            self.unexplained_s + elapsed_s
        } else {
            0.0
        };
        if moving && (late || gathers) || self.unexplained_s > UNEXPLAINED_S {
            self.activity = Activity::Fault(SafeAction::Idle);
        }
    }

    /// A joint whose encoder says the same angle again bears a torque that would move it; or any joint bears such a
    /// torque when an impact is long over.
    fn is_unexplained(&self, config: &Config<N>) -> bool {
        let external_nm = self.observer.external_torque_nm();
        let limits = &config.limits;
        let settled = self.activity_s(config) > IMPACT_S;
        (0..N).any(|joint| {
            let torque_nm = abs(external_nm[joint]);
            let strong = UNEXPLAINED_SHARE * limits.joint_torque_nm[joint];
            torque_nm > strong && (settled || self.plausibility.stands_still(joint))
        })
    }
}

/// Greatest share of `more` that stays within `limit` on top of `base`, 0 to 1.
fn within<const N: usize>(limit: &Vector<N>, base: &Vector<N>, more: &Vector<N>) -> f64 {
    (0..N).fold(1.0_f64, |share, i| {
        let room = if more[i] > 0.0 {
            limit[i] - base[i]
        } else {
            limit[i] + base[i]
        };
        if abs(more[i]) > room {
            share.min((room / abs(more[i])).max(0.0))
        } else {
            share
        }
    })
}
