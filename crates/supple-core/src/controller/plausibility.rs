//! Plausibility checks between measurements, commands and model.
//!
//! | finding | criterion |
//! |---|---|
//! | replies lost too often | each lost reply counts as eight received ones; the balance exceeds its limit |
//! | encoder stuck | see `stuck_encoder.rs` |
//! | moves against its torque | 20 cycles in which a joint's momentum grows against its net torque, by at least a tenth of what the torque would cause in its own direction; a joint that moves against its breakaway ramp; or see `reversed_encoder.rs` |
//! | unmodelled load | a force along gravity for 50 ms, in gravity hold or after the end of a move, or while the tip falls away from its reference |
//! | collision | the observed external torque or force exceeds its threshold |

use super::fault::Fault;
use super::reversed_encoder::{ReversalVerdict, SuddenReversal};
use crate::config::{Config, PlausibilityLimits};
use crate::math::{Vector, Vector3, abs, sqrt};

const LOSS_WEIGHT: u32 = 8;
const AGAINST_CYCLES: u32 = 20;
/// Minimum growth of a joint's momentum against its net torque, as a fraction of the growth that the torque would cause in its
/// own direction. A reversed encoder gives a fraction of one, a hand that guides a joint against its friction a small one.
const GROWTH_SHARE: f64 = 0.1;
/// Minimum torque of a sudden reversal, as a multiple of the limit of the torque that may oppose the joint's motion.
const REVERSING_RATIO: f64 = 6.0;
/// Settling time of the velocity estimate after such a reversal, to a few per cent, in lags `1 / w` of the estimate.
const SETTLING_LAGS: f64 = 5.0;
const LOAD_S: f64 = 0.05;
/// Maximum ratio of the force perpendicular to gravity to the force along it, for a load.
const MAX_LATERAL_SHARE: f64 = 0.5;

/// Lost replies, motion against torque, and load in the last cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plausibility<const N: usize> {
    /// Balance of lost and received replies of each joint.
    weighted_losses: [u32; N],
    against_torque_cycles: [u32; N],
    last_momentum: Vector<N>,
    reversal: Option<SuddenReversal>,
    load_s: f64,
}

impl<const N: usize> Default for Plausibility<N> {
    fn default() -> Self {
        Plausibility {
            weighted_losses: [0; N],
            against_torque_cycles: [0; N],
            last_momentum: Vector::zeros(),
            reversal: None,
            load_s: 0.0,
        }
    }
}

/// Limits of a motion against its torque.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgainstTorqueLimits<const N: usize> {
    /// Torque that may oppose a joint's acceleration \[N m\].
    torque_nm: Vector<N>,
    /// Squared change of the momentum within a period below which no joint can have reversed suddenly \[(N m s)^2\].
    sudden_momentum_squared: f64,
    /// Cycles within which the velocity estimate settles after a sudden reversal.
    settling_cycles: u32,
}

impl<const N: usize> AgainstTorqueLimits<N> {
    pub fn new(config: &Config<N>) -> AgainstTorqueLimits<N> {
        let torque_nm = config.limits.joint_torque_nm * config.plausible.against_share;
        let min_nm_s = REVERSING_RATIO * torque_nm.min() * config.period_s;
        AgainstTorqueLimits {
            torque_nm,
            sudden_momentum_squared: min_nm_s * min_nm_s,
            settling_cycles: (SETTLING_LAGS / (config.estimator_rad_per_s * config.period_s))
                as u32
                + 1,
        }
    }
}

/// Motion of the joints in a cycle.
pub(super) struct JointMotion<'a, const N: usize> {
    /// Generalised momentum \[N m s\].
    pub momentum: &'a Vector<N>,
    /// Velocities of the joints \[rad/s\].
    pub velocity_rad_per_s: &'a Vector<N>,
    /// Velocities of their references \[rad/s\].
    pub reference_rad_per_s: &'a Vector<N>,
}

impl<const N: usize> Plausibility<N> {
    /// Checks how often encoder replies are lost; `all_received` if none is missing in this cycle.
    #[inline(always)]
    pub fn check_replies(
        &mut self,
        plausible: &PlausibilityLimits,
        measured_rad: &[Option<f64>; N],
        all_received: bool,
    ) -> Result<(), Fault> {
        if all_received && self.weighted_losses == [0; N] {
            return Ok(());
        }
        self.check_lost_replies(plausible, measured_rad)
    }

    #[inline(never)]
    fn check_lost_replies(
        &mut self,
        plausible: &PlausibilityLimits,
        measured_rad: &[Option<f64>; N],
    ) -> Result<(), Fault> {
        for (joint, measured) in measured_rad.iter().enumerate() {
            self.weighted_losses[joint] = match measured {
                Some(_) => self.weighted_losses[joint].saturating_sub(1),
                None => self.weighted_losses[joint] + LOSS_WEIGHT,
            };
            if self.weighted_losses[joint] > LOSS_WEIGHT.saturating_mul(plausible.lost_replies) {
                self.weighted_losses[joint] = 0;
                return Err(Fault::EncoderUnreliable { joint });
            }
        }
        Ok(())
    }

    /// Resets the accumulated evidence at a change of activity.
    pub fn begin(&mut self) {
        self.against_torque_cycles = [0; N];
        self.reversal = None;
        self.load_s = 0.0;
    }

    /// Skips the checks in this cycle.
    pub fn suspend(&mut self, momentum: &Vector<N>) {
        self.last_momentum = *momentum;
    }

    /// Checks that no joint moves against its torque. `net_torque` is the rate of change of the momentum without external
    /// torque \[N m\].
    #[inline(always)]
    pub fn check_against_torque(
        &mut self,
        limits: &AgainstTorqueLimits<N>,
        motion: &JointMotion<'_, N>,
        net_torque: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        let momentum = motion.momentum;
        let last = core::mem::replace(&mut self.last_momentum, *momentum);
        let change = momentum - last;
        if change.dot(&change) > limits.sudden_momentum_squared {
            self.find_sudden_reversal(limits, motion, &change, elapsed_s);
        }
        if self.reversal.is_some() {
            self.check_reversal(limits, motion)?;
        }
        for joint in 0..N {
            let limit_nm = limits.torque_nm[joint];
            let opposing = -net_torque[joint] * momentum[joint];
            let opposed = opposing > 0.0 && abs(net_torque[joint]) > limit_nm;
            // Relative to the change of momentum that the net torque would cause.
            let accelerates = change[joint] * momentum[joint] > GROWTH_SHARE * opposing * elapsed_s;
            if accelerates && opposed {
                self.against_torque_cycles[joint] += 1;
            } else {
                self.against_torque_cycles[joint] =
                    self.against_torque_cycles[joint].saturating_sub(2);
            }
            if self.against_torque_cycles[joint] > AGAINST_CYCLES {
                return Err(Fault::MotionAgainstTorque {
                    joint,
                    value_nm: abs(net_torque[joint]),
                    limit_nm,
                });
            }
        }
        Ok(())
    }

    /// Finds a joint whose velocity has suddenly reversed against its reference. `change` is the change of the momentum in this
    /// cycle \[N m s\].
    #[cold]
    #[inline(never)]
    fn find_sudden_reversal(
        &mut self,
        limits: &AgainstTorqueLimits<N>,
        motion: &JointMotion<'_, N>,
        change: &Vector<N>,
        elapsed_s: f64,
    ) {
        if self.reversal.is_some() {
            return;
        }
        for joint in 0..N {
            let reversed =
                motion.velocity_rad_per_s[joint] * motion.reference_rad_per_s[joint] < 0.0;
            let torque_nm = abs(change[joint]) / elapsed_s;
            if reversed && torque_nm > REVERSING_RATIO * limits.torque_nm[joint] {
                self.reversal = Some(SuddenReversal::new(joint, torque_nm));
            }
        }
    }

    /// Reports a fault if the joint that reversed suddenly follows its reversed reference.
    #[cold]
    #[inline(never)]
    fn check_reversal(
        &mut self,
        limits: &AgainstTorqueLimits<N>,
        motion: &JointMotion<'_, N>,
    ) -> Result<(), Fault> {
        let Some(reversal) = &mut self.reversal else {
            return Ok(());
        };
        let joint = reversal.joint;
        let (velocity, reference) = (
            motion.velocity_rad_per_s[joint],
            motion.reference_rad_per_s[joint],
        );
        match reversal.add_cycle(velocity, reference, limits.settling_cycles) {
            ReversalVerdict::Pending => Ok(()),
            ReversalVerdict::NotReversed => {
                self.reversal = None;
                Ok(())
            }
            ReversalVerdict::EncoderReversed => Err(Fault::MotionAgainstTorque {
                joint,
                value_nm: reversal.torque_nm,
                limit_nm: REVERSING_RATIO * limits.torque_nm[joint],
            }),
        }
    }

    /// Resets the time for which a load has acted.
    pub fn reset_load(&mut self) {
        self.load_s = 0.0;
    }

    pub fn check_unmodelled_load(
        &mut self,
        force_n: &Vector3<f64>,
        gravity: &Vector3<f64>,
        limit_n: f64,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        let length = sqrt(gravity.dot(gravity));
        if length == 0.0 {
            return Ok(());
        }
        let value_n = force_n.dot(gravity) / length;
        let across = force_n.dot(force_n) - value_n * value_n;
        let heavy = value_n > limit_n
            && across < (MAX_LATERAL_SHARE * value_n) * (MAX_LATERAL_SHARE * value_n);
        self.load_s = if heavy { self.load_s + elapsed_s } else { 0.0 };
        if self.load_s > LOAD_S {
            return Err(Fault::UnmodelledLoad { value_n, limit_n });
        }
        Ok(())
    }
}

/// Speed at which a tip falls away from its reference \[m/s\].
const FALLING_M_PER_S: f64 = 0.1;

/// Returns whether the tip moves along gravity relative to its reference, faster than [`FALLING_M_PER_S`].
#[inline(never)]
pub(super) fn is_falling_away(away_m_per_s: &Vector3<f64>, gravity: &Vector3<f64>) -> bool {
    let along = away_m_per_s.dot(gravity);
    along > 0.0 && along * along > FALLING_M_PER_S * FALLING_M_PER_S * gravity.dot(gravity)
}

/// Inputs of the plausibility checks in one cycle.
pub(super) struct PlausibilityInput<'a, const N: usize> {
    /// Reference velocities of the joints \[rad/s\].
    pub reference_rad_per_s: &'a Vector<N>,
    /// Rate of change of the momentum without external torque \[N m\].
    pub net_torque_nm: &'a Vector<N>,
    /// Observed force on the tip, base axes \[N\].
    pub force_n: &'a Vector3<f64>,
    /// Whether the tip falls away from its reference.
    pub is_falling_away: bool,
    /// Whether the pose is regular. Near a singular pose a small torque maps to a large force along
    /// the lost direction, so only the thresholds of the joints apply.
    pub pose_is_regular: bool,
    /// Time since the last cycle \[s\].
    pub elapsed_s: f64,
}

pub(super) fn check_joint_collision<const N: usize>(
    threshold_nm: &Vector<N>,
    external_nm: &Vector<N>,
) -> Result<(), Fault> {
    for joint in 0..N {
        let (value_nm, limit_nm) = (abs(external_nm[joint]), threshold_nm[joint]);
        if value_nm > limit_nm {
            return Err(Fault::JointCollision {
                joint,
                value_nm,
                limit_nm,
            });
        }
    }
    Ok(())
}

#[inline]
pub(super) fn check_tip_collision(limit_n: f64, force_n: &Vector3<f64>) -> Result<(), Fault> {
    if force_n.dot(force_n) > limit_n * limit_n {
        return Err(Fault::TipCollision {
            value_n: sqrt(force_n.dot(force_n)),
            limit_n,
        });
    }
    Ok(())
}
