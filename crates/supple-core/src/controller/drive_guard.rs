//! Independent check of the controller's commands on the side of the drives. Every torque passes it
//! before it reaches a motor.
//!
//! The controller may be faulty, or not the expected program. The guard uses only the arm's limits
//! and the encoder readings:
//!
//! - a torque that is not finite becomes zero (the plant loop counts such a command as missing beforehand);
//! - torque and torque rate are limited again;
//! - drives become active only in gravity hold;
//! - a joint at twice its speed limit ends the torque;
//! - while the controller reports a fault, a joint that still moves after 0.25 s, or that accelerates, ends the torque.
//!
//! The guard latches nothing: its caller ends the torque at the first reason and decides when torque may
//! return (`supple-drive/src/guard.rs`).

use super::words::{JointLabel, NamesJoints};
use crate::config::{Config, Limits};
use crate::controller::estimator::{Estimator, EstimatorGains};
use crate::controller::{Mode, MotorGroups, limit, limit_torque};
use crate::math::{Vector, abs, all_finite};
use crate::record::Text;
use core::fmt;

/// Ratio of joint speed to its limit at which the guard ends the torque, whatever the controller
/// commands.
const OVERSPEED: f64 = 2.0;
/// Fraction of a joint's speed limit above which it counts as moving.
const MOVING_SHARE: f64 = 0.25;
/// Time after a fault within which the arm must come to rest \[s\]: a little more than the
/// controller's own limit.
const STOP_TIMEOUT_S: f64 = 0.25;
/// Settling time of the velocity estimate after a fault \[s\]; speeds within this time count as speeds before the
/// fault.
const ESTIMATOR_SETTLING_S: f64 = 0.02;
/// Ratio to the speed before the fault above which a joint counts as accelerating.
const SPEED_GROWTH_LIMIT: f64 = 1.25;
/// Time in which the torque of a safe action or the fallback torque may ramp a joint from full torque to zero \[s\].
const STOP_TORQUE_S: f64 = 0.005;

/// Reason for which the guard ended the torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GuardReason {
    /// A joint is far above its speed limit.
    Overspeed {
        /// Joint index.
        joint: usize,
        /// Speed \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// While the controller reports a fault, a joint still moves or accelerates.
    NotStopped {
        /// Joint index.
        joint: usize,
        /// Speed \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// Drives were activated in a mode other than gravity hold.
    NotInGravityHold,
}

impl NamesJoints for GuardReason {
    fn write(&self, f: &mut fmt::Formatter<'_>, names: &[Text]) -> fmt::Result {
        let label = |joint: usize| JointLabel::new(joint, names);
        match *self {
            GuardReason::Overspeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "{} turns at {value_rad_per_s:.3} rad/s, the drives end torque at \
                 {limit_rad_per_s:.3} rad/s",
                label(joint)
            ),
            GuardReason::NotStopped {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "the controller is in a fault and {} still turns at {value_rad_per_s:.3} rad/s, \
                 limit {limit_rad_per_s:.3} rad/s",
                label(joint)
            ),
            GuardReason::NotInGravityHold => f.write_str(
                "the drives were activated while the controller was not in gravity hold",
            ),
        }
    }
}

impl fmt::Display for GuardReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &[])
    }
}

/// The part of a command that the guard checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveCommand<const N: usize> {
    /// Joint torques \[N m\].
    pub torque_nm: Vector<N>,
    /// The controller's mode, if known.
    pub mode: Option<Mode>,
    /// Whether the controller reports a fault.
    pub fault: bool,
}

/// The guard of one arm's drives.
#[derive(Clone, Copy, Debug)]
pub struct DriveGuard<const N: usize> {
    limits: Limits<N>,
    groups: MotorGroups<N>,
    period_s: f64,
    /// Time between the previous angles and those of this cycle \[s\].
    elapsed_s: f64,
    bandwidth_rad_per_s: f64,
    estimator: Option<Estimator<N>>,
    /// Last torque sent \[N m\].
    last_nm: Vector<N>,
    /// Time since the controller first reported its fault \[s\]; `None` without a fault.
    fault_s: Option<f64>,
    /// Joint speeds before the fault \[rad/s\].
    speed_before_fault_rad_per_s: Vector<N>,
    /// Whether the drives were active in the last cycle and their activation was accepted.
    activation_accepted: bool,
}

impl<const N: usize> DriveGuard<N> {
    /// Returns a guard with the limits, the transmission and the period of `config`.
    pub fn new(config: &Config<N>) -> Self {
        DriveGuard {
            limits: config.limits,
            groups: MotorGroups::new(&config.joint_from_motor),
            period_s: config.period_s,
            elapsed_s: 0.0,
            bandwidth_rad_per_s: config.estimator_rad_per_s,
            estimator: None,
            last_nm: Vector::zeros(),
            fault_s: None,
            speed_before_fault_rad_per_s: Vector::zeros(),
            activation_accepted: false,
        }
    }

    /// Updates the guard with the angles of a cycle \[rad\], `periods` after the previous ones; an
    /// angle that is missing or not finite is bridged by prediction.
    pub fn observe(&mut self, position_rad: &[Option<f64>; N], periods: u64) {
        self.elapsed_s = periods as f64 * self.period_s;
        let measured = position_rad.map(|angle| angle.filter(|angle| angle.is_finite()));
        match &mut self.estimator {
            Some(estimator) => {
                let gains = EstimatorGains::new(self.elapsed_s, self.bandwidth_rad_per_s);
                estimator.update(&measured, &gains);
            }
            None if measured.iter().all(Option::is_some) => {
                let position = Vector::from(measured.map(Option::unwrap_or_default));
                self.estimator = Some(Estimator::at_rest(position));
            }
            None => {}
        }
    }

    /// Returns the joint speeds as the guard estimates them \[rad/s\]; none before the first complete angles.
    pub fn velocity_rad_per_s(&self) -> Option<Vector<N>> {
        let estimator = self.estimator.as_ref()?;
        Some(estimator.velocity_rad_per_s)
    }

    /// Checks a command before the drives apply it. `command` is `None` if the controller did not
    /// answer; `active` is whether the motors apply torques.
    ///
    /// # Errors
    /// The [`GuardReason`] for ending the torque.
    pub fn check_command(
        &mut self,
        command: Option<&DriveCommand<N>>,
        active: bool,
    ) -> Result<(), GuardReason> {
        let activated = active && !self.activation_accepted;
        self.activation_accepted = active;
        if !active {
            self.fault_s = None;
            return Ok(());
        }
        if activated {
            let mode = command.map(|command| command.mode);
            // Without an answer the activation is neither accepted nor rejected until the first answer.
            self.activation_accepted = mode == Some(Some(Mode::GravityHold));
            if mode.is_some() && !self.activation_accepted {
                return Err(GuardReason::NotInGravityHold);
            }
        }
        let Some(estimator) = &self.estimator else {
            return Ok(());
        };
        let speed = estimator.velocity_rad_per_s.map(abs);
        let find = |limit: Vector<N>| (0..N).find(|joint| speed[*joint] > limit[*joint]);
        let limit = self.limits.joint_speed_rad_per_s * OVERSPEED;
        if let Some(joint) = find(limit) {
            return Err(GuardReason::Overspeed {
                joint,
                value_rad_per_s: speed[joint],
                limit_rad_per_s: limit[joint],
            });
        }
        // Without an answer the previous fault state is kept.
        if command.is_some_and(|command| !command.fault) {
            self.fault_s = None;
        }
        let faulty = command.is_some_and(|command| command.fault) || self.fault_s.is_some();
        if !faulty {
            self.speed_before_fault_rad_per_s = speed;
            return Ok(());
        }
        let since_s = self.fault_s.map_or(0.0, |since_s| since_s + self.elapsed_s);
        self.fault_s = Some(since_s);
        if since_s <= ESTIMATOR_SETTLING_S {
            self.speed_before_fault_rad_per_s =
                self.speed_before_fault_rad_per_s.zip_map(&speed, f64::max);
            return Ok(());
        }
        let moving = self.limits.joint_speed_rad_per_s * MOVING_SHARE;
        let limit = if since_s > STOP_TIMEOUT_S {
            moving
        } else {
            // Coupled joints exchange energy, so compare each speed with the fastest joint before
            // the fault.
            let fastest = self.speed_before_fault_rad_per_s.max() * SPEED_GROWTH_LIMIT;
            moving.map(|moving| moving.max(fastest))
        };
        match find(limit) {
            Some(joint) => Err(GuardReason::NotStopped {
                joint,
                value_rad_per_s: speed[joint],
                limit_rad_per_s: limit[joint],
            }),
            None => Ok(()),
        }
    }

    /// Returns the torque with magnitude and rate limited; a torque that is not finite becomes zero. With `fast_ramp`
    /// (fallback torque or safe action) the rate limit is higher.
    pub fn limited_nm(&mut self, torque_nm: &Vector<N>, fast_ramp: bool) -> Vector<N> {
        let rate = if fast_ramp {
            Vector::from_fn(|i, _| {
                let fast = self.limits.joint_torque_nm[i] / STOP_TORQUE_S;
                fast.max(self.limits.torque_rate_nm_per_s[i])
            })
        } else {
            self.limits.torque_rate_nm_per_s
        };
        let step = rate * self.period_s;
        let limited = limit(&self.limits, &self.groups, &self.last_nm, torque_nm, &step);
        self.last_nm = limited.torque_nm;
        limited.torque_nm
    }

    /// Resets the rate limiter to the limited `torque_nm`, while the motors are idle. Returns the limited
    /// torque; zero if it is not finite.
    pub fn reset_rate_limit(&mut self, torque_nm: &Vector<N>) -> Vector<N> {
        let (allowed_nm, _) = limit_torque(&self.limits, &self.groups, torque_nm);
        self.last_nm = if all_finite(&allowed_nm) {
            allowed_nm
        } else {
            Vector::zeros()
        };
        self.last_nm
    }
}
