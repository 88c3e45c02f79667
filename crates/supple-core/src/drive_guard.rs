//! What the drives' own side makes of a controller's commands: nothing goes to a motor that was not looked at here.
//!
//! The controller may be wrong, or somebody else's. The guard knows the arm's limits and the encoders, and judges by
//! them alone:
//!
//! - a torque that is not finite counts as none sent;
//! - torque and torque rate are limited again;
//! - drives come to life in gravity hold alone;
//! - a joint that is twice as fast as it may be ends torque;
//! - in a fault, a joint that still moves after 0.25 s, or that gathers speed, ends torque.
//!
//! Ended torque stays ended until the controller wants none: [`DriveGuard::judge`] then says so again.

use crate::config::{Config, Limits};
use crate::controller::{Mode, MotorGroups, limit};
use crate::estimator::Estimator;
use crate::math::{Vector, abs, all_finite};
use core::fmt;

/// Joint speed over its limit at which torque ends, whatever the controller says.
const OVERSPEED: f64 = 2.0;
/// Share of a joint's speed limit above which it moves.
const MOVING_SHARE: f64 = 0.25;
/// Time after a fault from which nothing may move any more \[s\]: a little more than the controller gives itself.
const STOPPED_AFTER_S: f64 = 0.25;
/// Time after a fault in which a joint's speed is taken for what it had before it \[s\].
const SETTLES_S: f64 = 0.02;
/// Speed over that before the fault from which a joint gathers speed.
const GATHERS: f64 = 1.25;
/// Time in which the safe action, and a fallback torque, may take a joint's whole torque away \[s\].
const STOP_TORQUE_S: f64 = 0.005;

/// Why the guard ended torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GuardReason {
    /// A joint is far too fast.
    Overspeed {
        /// Joint index.
        joint: usize,
        /// Speed \[rad/s\].
        value_rad_per_s: f64,
        /// Limit \[rad/s\].
        limit_rad_per_s: f64,
    },
    /// In a fault of the controller, a joint still moves or gathers speed.
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

impl fmt::Display for GuardReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            GuardReason::Overspeed {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "joint {joint} turns at {value_rad_per_s:.3} rad/s, the drives end torque at \
                 {limit_rad_per_s:.3} rad/s"
            ),
            GuardReason::NotStopped {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            } => write!(
                f,
                "the controller is in a fault and joint {joint} still turns at {value_rad_per_s:.3} rad/s, \
                 limit {limit_rad_per_s:.3} rad/s"
            ),
            GuardReason::NotInGravityHold => f.write_str(
                "the drives were activated while the controller was not in gravity hold",
            ),
        }
    }
}

/// What a command asks of the drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveCommand<const N: usize> {
    /// Joint torques \[N m\].
    pub torque_nm: Vector<N>,
    /// The controller's mode, where it is known.
    pub mode: Option<Mode>,
    /// The controller is in a fault.
    pub fault: bool,
}

/// The guard of one arm's drives.
#[derive(Clone, Copy, Debug)]
pub struct DriveGuard<const N: usize> {
    limits: Limits<N>,
    groups: MotorGroups<N>,
    period_s: f64,
    bandwidth_rad_per_s: f64,
    estimator: Option<Estimator<N>>,
    /// Last torque that went out \[N m\].
    last_nm: Vector<N>,
    /// Time in the controller's fault \[s\].
    fault_s: Option<f64>,
    /// Speeds before it \[rad/s\].
    before_rad_per_s: Vector<N>,
    was_active: bool,
}

impl<const N: usize> DriveGuard<N> {
    /// With the limits, the transmission and the period of an arm.
    pub fn new(config: &Config<N>) -> Self {
        DriveGuard {
            limits: config.limits,
            groups: MotorGroups::new(&config.joint_from_motor),
            period_s: config.period_s,
            bandwidth_rad_per_s: config.estimator_rad_per_s,
            estimator: None,
            last_nm: Vector::zeros(),
            fault_s: None,
            before_rad_per_s: Vector::zeros(),
            was_active: false,
        }
    }

    /// Takes in the angles of a cycle \[rad\]; one that is missing or not finite is coasted over.
    pub fn observe(&mut self, position_rad: &[Option<f64>; N]) {
        let measured = position_rad.map(|angle| angle.filter(|angle| angle.is_finite()));
        match &mut self.estimator {
            Some(estimator) => {
                estimator.update(&measured, self.period_s, self.bandwidth_rad_per_s);
            }
            None if measured.iter().all(Option::is_some) => {
                let position = Vector::from(measured.map(Option::unwrap_or_default));
                self.estimator = Some(Estimator::at_rest(position));
            }
            None => {}
        }
    }

    /// Judges what the drives are about to do: `command` is what the controller wants of them in this cycle, none
    /// where it did not answer; `active` whether the motors carry out torques.
    ///
    /// # Errors
    /// [`GuardReason`] to end torque for.
    pub fn judge(
        &mut self,
        command: Option<&DriveCommand<N>>,
        active: bool,
    ) -> Result<(), GuardReason> {
        let came_to_life = active && !self.was_active;
        self.was_active = active;
        if !active {
            self.fault_s = None;
            return Ok(());
        }
        if came_to_life && command.is_some_and(|c| c.mode != Some(Mode::GravityHold)) {
            self.was_active = false;
            return Err(GuardReason::NotInGravityHold);
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
        // Where no answer comes, what was so stays so.
        if command.is_some_and(|command| !command.fault) {
            self.fault_s = None;
        }
        let faulty = command.is_some_and(|command| command.fault) || self.fault_s.is_some();
        if !faulty {
            self.before_rad_per_s = speed;
            return Ok(());
        }
        let since_s = self.fault_s.map_or(0.0, |since_s| since_s + self.period_s);
        self.fault_s = Some(since_s);
        if since_s <= SETTLES_S {
            self.before_rad_per_s = self.before_rad_per_s.zip_map(&speed, f64::max);
            return Ok(());
        }
        let moving = self.limits.joint_speed_rad_per_s * MOVING_SHARE;
        let limit = if since_s > STOPPED_AFTER_S {
            moving
        } else {
            // What one joint loses another may gain: the fastest of them all is the measure.
            let fastest = self.before_rad_per_s.max() * GATHERS;
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

    /// The torque that goes out in the place of one that is to: limited, and no faster reached than is allowed; none
    /// where it is not finite. A fallback torque and that of a fault are reached in some cycles.
    pub fn limited_nm(&mut self, torque_nm: &Vector<N>, stopping: bool) -> Vector<N> {
        let rate = if stopping {
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

    /// The motors carry out no torque: the next one begins where it is sent.
    pub fn rest(&mut self, torque_nm: &Vector<N>) {
        self.last_nm = if all_finite(torque_nm) {
            *torque_nm
        } else {
            Vector::zeros()
        };
    }
}
