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
use super::reversed_encoder::{Evidence, SuddenReversal};
use crate::config::{Config, PlausibilityLimits};
use crate::math::{Vector, Vector3, abs, sqrt};

const LOSS_WEIGHT: u32 = 8;
const AGAINST_CYCLES: u32 = 20;
/// Smallest growth of a joint's momentum against its net torque, as a fraction of what the torque would cause in its own direction.
/// A reversed encoder shows all of it; a hand that guides a joint against its friction shows little.
const GROWTH_SHARE: f64 = 0.1;
/// Torque that a sudden reversal of a joint needs, as a multiple of the limit of what may oppose its motion.
const REVERSING_RATIO: f64 = 6.0;
/// Lags `1 / w` of the velocity estimate within which it follows such a reversal to some hundredths.
const SETTLING_LAGS: f64 = 5.0;
const LOAD_S: f64 = 0.05;
/// Maximum ratio of the force perpendicular to gravity to the force along it, for a load.
const MAX_LATERAL_SHARE: f64 = 0.5;

/// What was lost, opposed and carried in the last cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plausibility<const N: usize> {
    /// Lost replies of each joint, weighed.
    losses: [u32; N],
    opposed_cycles: [u32; N],
    last_momentum: Vector<N>,
    reversal: Option<SuddenReversal>,
    load_s: f64,
}

impl<const N: usize> Default for Plausibility<N> {
    fn default() -> Self {
        Plausibility {
            losses: [0; N],
            opposed_cycles: [0; N],
            last_momentum: Vector::zeros(),
            reversal: None,
            load_s: 0.0,
        }
    }
}

/// Limits of a motion against its torque.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgainstLimits<const N: usize> {
    /// Torque that may oppose a joint's acceleration \[N m\].
    torque_nm: Vector<N>,
    /// Sum of the squared changes of the momentum within a period below which no joint has turned round suddenly
    /// \[(N m s)^2\].
    sudden_momentum_squared: f64,
    /// Cycles within which the velocity estimate follows a sudden reversal.
    settling_cycles: u32,
}

impl<const N: usize> AgainstLimits<N> {
    pub fn new(config: &Config<N>) -> AgainstLimits<N> {
        let torque_nm = config.limits.joint_torque_nm * config.plausible.against_share;
        let least_nm_s = REVERSING_RATIO * torque_nm.min() * config.period_s;
        AgainstLimits {
            torque_nm,
            sudden_momentum_squared: least_nm_s * least_nm_s,
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
    /// Weighs the encoder replies of a cycle; `all` of them, if none is missing.
    #[inline(always)]
    pub fn receive_replies(
        &mut self,
        plausible: &PlausibilityLimits,
        measured_rad: &[Option<f64>; N],
        all: bool,
    ) -> Result<(), Fault> {
        if all && self.losses == [0; N] {
            return Ok(());
        }
        self.weigh_replies(plausible, measured_rad)
    }

    #[inline(never)]
    fn weigh_replies(
        &mut self,
        plausible: &PlausibilityLimits,
        measured_rad: &[Option<f64>; N],
    ) -> Result<(), Fault> {
        for (joint, measured) in measured_rad.iter().enumerate() {
            self.losses[joint] = match measured {
                Some(_) => self.losses[joint].saturating_sub(1),
                None => self.losses[joint] + LOSS_WEIGHT,
            };
            if self.losses[joint] > LOSS_WEIGHT.saturating_mul(plausible.lost_replies) {
                self.losses[joint] = 0;
                return Err(Fault::EncoderUnreliable { joint });
            }
        }
        Ok(())
    }

    /// Resets the accumulated evidence at a change of activity.
    pub fn begin(&mut self) {
        self.opposed_cycles = [0; N];
        self.reversal = None;
        self.load_s = 0.0;
    }

    /// Suspends the checks in this cycle.
    pub fn suspend(&mut self, momentum: &Vector<N>) {
        self.last_momentum = *momentum;
    }

    /// Checks that no joint moves against its torque. `net_torque` is the rate of change of the momentum without external
    /// torque \[N m\], the velocities are those of the joints and of their references \[rad/s\].
    #[inline(always)]
    pub fn check_against_torque(
        &mut self,
        limits: &AgainstLimits<N>,
        motion: &JointMotion<'_, N>,
        net_torque: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        let momentum = motion.momentum;
        let last = core::mem::replace(&mut self.last_momentum, *momentum);
        let change = momentum - last;
        if change.dot(&change) > limits.sudden_momentum_squared {
            self.note_reversal(limits, motion, &change, elapsed_s);
        }
        if self.reversal.is_some() {
            self.check_reversal(limits, motion)?;
        }
        for joint in 0..N {
            let limit_nm = limits.torque_nm[joint];
            let opposing = -net_torque[joint] * momentum[joint];
            let opposed = opposing > 0.0 && abs(net_torque[joint]) > limit_nm;
            // By the change of momentum that the net torque would cause.
            let accelerates = change[joint] * momentum[joint] > GROWTH_SHARE * opposing * elapsed_s;
            if accelerates && opposed {
                self.opposed_cycles[joint] += 1;
            } else {
                self.opposed_cycles[joint] = self.opposed_cycles[joint].saturating_sub(2);
            }
            if self.opposed_cycles[joint] > AGAINST_CYCLES {
                return Err(Fault::MotionAgainstTorque {
                    joint,
                    value_nm: abs(net_torque[joint]),
                    limit_nm,
                });
            }
        }
        Ok(())
    }

    /// Notes a joint that has turned against its reference suddenly. `change` is that of the momentum \[N m s\].
    #[cold]
    #[inline(never)]
    fn note_reversal(
        &mut self,
        limits: &AgainstLimits<N>,
        motion: &JointMotion<'_, N>,
        change: &Vector<N>,
        elapsed_s: f64,
    ) {
        if self.reversal.is_some() {
            return;
        }
        for joint in 0..N {
            let turned_round =
                motion.velocity_rad_per_s[joint] * motion.reference_rad_per_s[joint] < 0.0;
            let torque_nm = abs(change[joint]) / elapsed_s;
            if turned_round && torque_nm > REVERSING_RATIO * limits.torque_nm[joint] {
                self.reversal = Some(SuddenReversal::new(joint, torque_nm));
            }
        }
    }

    /// Follows a joint that has turned round suddenly.
    #[cold]
    #[inline(never)]
    fn check_reversal(
        &mut self,
        limits: &AgainstLimits<N>,
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
        match reversal.follow(velocity, reference, limits.settling_cycles) {
            Evidence::Open => Ok(()),
            Evidence::Refuted => {
                self.reversal = None;
                Ok(())
            }
            Evidence::Reversed => Err(Fault::MotionAgainstTorque {
                joint,
                value_nm: reversal.torque_nm,
                limit_nm: REVERSING_RATIO * limits.torque_nm[joint],
            }),
        }
    }

    /// Discards the evidence of a load.
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

/// Whether the tip moves along gravity, faster than its reference.
#[inline(never)]
pub(super) fn falls(away_m_per_s: &Vector3<f64>, gravity: &Vector3<f64>) -> bool {
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
    pub falls: bool,
    /// Whether the pose is regular. Near a singular pose a small torque maps to a large force along
    /// the lost direction, so only the thresholds of the joints apply.
    pub regular: bool,
    /// Time since the last cycle \[s\].
    pub elapsed_s: f64,
}

pub(super) fn joint_collision<const N: usize>(
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
pub(super) fn tip_collision(limit_n: f64, force_n: &Vector3<f64>) -> Result<(), Fault> {
    if force_n.dot(force_n) > limit_n * limit_n {
        return Err(Fault::TipCollision {
            value_n: sqrt(force_n.dot(force_n)),
            limit_n,
        });
    }
    Ok(())
}
