//! Whether what is measured, what is commanded and what the model says fit together.
//!
//! | finding | how |
//! |---|---|
//! | replies lost too often | each loss weighs eight replies; too many losses on balance |
//! | encoder stuck | the very same angle while the joint's reference moves on, out of contact; or from one cycle to the next, of a joint that moved |
//! | moves against its torque | 20 cycles in which a joint's momentum grows against what drives it |
//! | unmodelled load | a force along gravity for 50 ms, in gravity hold or where a move has ended |
//! | collision | the observed external torque or force is beyond its threshold |

use super::activity::Activity;
use super::fault::Fault;
use super::state::State;
use super::stop::MOVING_SHARE;
use crate::config::{Collision, Config, Plausible};
use crate::math::{Vector, Vector3, abs, sqrt};

const LOSS_WEIGHT: u32 = 8;
/// Way that a moving joint would have gone on since its encoder last changed, over the travel of a reference that
/// counts as one: 0.02 rad for 0.1 rad.
const HALTED_SHARE: f64 = 0.2;
/// Time for which the encoder of a joint that something collides with does not say the same angle \[s\].
const STILL_S: f64 = 0.03;
/// Speed of a joint that is not held up \[rad/s\].
const OTHERS_RAD_PER_S: f64 = 0.1;
const AGAINST_CYCLES: u32 = 20;
const LOAD_S: f64 = 0.05;
/// Share of the force along gravity that may act across it.
const LOAD_ACROSS: f64 = 0.5;

/// What is remembered of each joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plausibility<const N: usize> {
    losses: [u32; N],
    last_measured: [Option<f64>; N],
    /// The encoder said in this cycle what it had said before.
    still: [bool; N],
    /// Speed of the joint when the encoder last changed \[rad/s\], and time since then \[s\].
    speed_rad_per_s: [f64; N],
    still_s: [f64; N],
    /// How far the reference has moved since the encoder last changed \[rad\].
    travel_rad: [f64; N],
    against: [u32; N],
    last_momentum: Vector<N>,
    load_s: f64,
}

impl<const N: usize> Default for Plausibility<N> {
    fn default() -> Self {
        Plausibility {
            losses: [0; N],
            last_measured: [None; N],
            still: [false; N],
            speed_rad_per_s: [0.0; N],
            still_s: [0.0; N],
            travel_rad: [0.0; N],
            against: [0; N],
            last_momentum: Vector::zeros(),
            load_s: 0.0,
        }
    }
}

impl<const N: usize> Plausibility<N> {
    /// Takes in a cycle's replies.
    pub fn receive(
        &mut self,
        plausible: &Plausible,
        measured_rad: &[Option<f64>; N],
    ) -> Result<(), Fault> {
        for (joint, measured) in measured_rad.iter().enumerate() {
            match *measured {
                Some(position) => {
                    self.losses[joint] = self.losses[joint].saturating_sub(1);
                    self.still[joint] = self.last_measured[joint] == Some(position);
                    self.last_measured[joint] = Some(position);
                }
                None => {
                    self.losses[joint] += LOSS_WEIGHT;
                    self.still[joint] = true;
                }
            }
            if self.losses[joint] > LOSS_WEIGHT.saturating_mul(plausible.lost_replies) {
                self.losses[joint] = 0;
                return Err(Fault::EncoderUnreliable { joint });
            }
        }
        Ok(())
    }

    /// The encoder of a joint said in this cycle what it had said before.
    pub fn stands_still(&self, joint: usize) -> bool {
        self.still[joint]
    }

    /// What another activity asked of the joints says nothing of this one.
    pub fn begin(&mut self) {
        self.travel_rad = [0.0; N];
        self.against = [0; N];
        self.load_s = 0.0;
    }

    /// Nothing is weighed in this cycle: what a joint did before says nothing of what it does afterwards.
    pub fn pause(&mut self, momentum: &Vector<N>) {
        self.last_momentum = *momentum;
        self.speed_rad_per_s = [0.0; N];
        self.still_s = [0.0; N];
    }

    /// A joint that moved does not come to rest from one cycle to the next.
    fn halted(
        &mut self,
        limit_rad: f64,
        velocity_rad_per_s: &Vector<N>,
        moving_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        for joint in 0..N {
            if !self.still[joint] {
                self.speed_rad_per_s[joint] = abs(velocity_rad_per_s[joint]);
                self.still_s[joint] = 0.0;
                continue;
            }
            self.still_s[joint] += elapsed_s;
            let value_rad = self.speed_rad_per_s[joint] * self.still_s[joint];
            if self.speed_rad_per_s[joint] > moving_rad_per_s[joint] && value_rad > limit_rad {
                return Err(Fault::EncoderStuck {
                    joint,
                    value_rad,
                    limit_rad,
                });
            }
        }
        Ok(())
    }

    /// A torque from outside on a joint whose encoder has said the same angle for some time: that encoder is as likely
    /// to be wrong as something to be in the way, and gravity from a wrong angle would not hold the arm.
    fn or_stuck(&self, plausible: &Plausible, fault: Fault) -> Fault {
        match fault {
            Fault::JointCollision { joint, .. }
                if self.still_s[joint] > STILL_S && plausible.stuck_rad < f64::MAX =>
            {
                Fault::EncoderStuck {
                    joint,
                    value_rad: self.travel_rad[joint],
                    limit_rad: plausible.stuck_rad,
                }
            }
            fault => fault,
        }
    }

    fn stuck(
        &mut self,
        limit_rad: f64,
        reference_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        for joint in 0..N {
            if !self.still[joint] {
                self.travel_rad[joint] = 0.0;
                continue;
            }
            self.travel_rad[joint] += abs(reference_rad_per_s[joint]) * elapsed_s;
            if self.travel_rad[joint] > limit_rad {
                return Err(Fault::EncoderStuck {
                    joint,
                    value_rad: self.travel_rad[joint],
                    limit_rad,
                });
            }
        }
        Ok(())
    }

    /// `drive` is what changes the momentum where nothing acts from outside \[N m\].
    fn against(
        &mut self,
        momentum: &Vector<N>,
        drive: &Vector<N>,
        limit_nm: &Vector<N>,
    ) -> Result<(), Fault> {
        let last = core::mem::replace(&mut self.last_momentum, *momentum);
        for joint in 0..N {
            let limit_nm = limit_nm[joint];
            let gathers = (momentum[joint] - last[joint]) * momentum[joint] > 0.0;
            let opposed = drive[joint] * momentum[joint] < 0.0 && abs(drive[joint]) > limit_nm;
            if gathers && opposed {
                self.against[joint] += 1;
            } else {
                self.against[joint] = self.against[joint].saturating_sub(2);
            }
            if self.against[joint] > AGAINST_CYCLES {
                return Err(Fault::AgainstTorque {
                    joint,
                    value_nm: abs(drive[joint]),
                    limit_nm,
                });
            }
        }
        Ok(())
    }

    fn load(
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
        let heavy = value_n > limit_n && across < (LOAD_ACROSS * value_n) * (LOAD_ACROSS * value_n);
        self.load_s = if heavy { self.load_s + elapsed_s } else { 0.0 };
        if self.load_s > LOAD_S {
            return Err(Fault::UnmodelledLoad { value_n, limit_n });
        }
        Ok(())
    }
}

/// What the observer and the references say in a cycle.
pub(super) struct Evidence<'a, const N: usize> {
    /// Joint velocities that the references ask for \[rad/s\].
    pub reference_rad_per_s: &'a Vector<N>,
    /// What changes the momentum where nothing acts from outside \[N m\].
    pub drive_nm: &'a Vector<N>,
    /// Observed force on the tip, base axes \[N\].
    pub force_n: &'a Vector3<f64>,
    /// The pose is regular: near a singular one a small torque is a great force along the lost direction, and the
    /// joints' thresholds alone count.
    pub regular: bool,
    /// Since the last cycle \[s\].
    pub elapsed_s: f64,
}

impl<const N: usize> State<N> {
    /// Holds a cycle's evidence against the thresholds.
    pub(super) fn weigh(
        &mut self,
        config: &Config<N>,
        evidence: &Evidence<'_, N>,
    ) -> Result<(), Fault> {
        let resting = match &self.activity {
            Activity::GravityHold => true,
            Activity::Move { duration_s, .. } => self.activity_s(config) > *duration_s,
            _ => false,
        };
        let seen = &mut self.plausibility;
        if evidence.elapsed_s > 0.0 {
            let halted_rad = HALTED_SHARE * config.plausible.stuck_rad;
            let moving = config.limits.joint_speed_rad_per_s * MOVING_SHARE;
            let velocity = &self.estimator.velocity_rad_per_s;
            seen.halted(halted_rad, velocity, &moving, evidence.elapsed_s)?;
            let limits = config.limits.joint_torque_nm * config.plausible.against_share;
            let against = seen.against(&self.terms.momentum, evidence.drive_nm, &limits);
            // What stops the arm takes no notice of what throws it back; `stop.rs` sees whether it stops.
            if !matches!(self.activity, Activity::Fault(_)) {
                against?;
            }
            // Where the tip is held up, joints stand still though their references move on; but not one of them alone.
            let others_move = (0..N).any(|joint| abs(velocity[joint]) > OTHERS_RAD_PER_S);
            if others_move || !self.latch.in_contact() {
                let limit_rad = config.plausible.stuck_rad;
                seen.stuck(limit_rad, evidence.reference_rad_per_s, evidence.elapsed_s)?;
            }
        }
        let external = self.observer.external_torque_nm();
        let share = if self.activity.has_own_loops() {
            config.collision.move_share
        } else {
            1.0
        };
        joint_collision(&config.collision, share, &external)
            .map_err(|fault| self.plausibility.or_stuck(&config.plausible, fault))?;
        if !evidence.regular {
            return Ok(());
        }
        tip_collision(&config.collision, share, evidence.force_n)?;
        if resting {
            let (gravity, limit_n) = (config.arm.gravity(), config.plausible.load_n);
            self.plausibility
                .load(evidence.force_n, &gravity, limit_n, evidence.elapsed_s)?;
        }
        Ok(())
    }
}

fn joint_collision<const N: usize>(
    thresholds: &Collision<N>,
    share: f64,
    external_nm: &Vector<N>,
) -> Result<(), Fault> {
    for joint in 0..N {
        let (value_nm, limit_nm) = (
            abs(external_nm[joint]),
            share * thresholds.joint_torque_nm[joint],
        );
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

fn tip_collision<const N: usize>(
    thresholds: &Collision<N>,
    share: f64,
    force_n: &Vector3<f64>,
) -> Result<(), Fault> {
    let limit_n = share * thresholds.tip_force_n;
    if force_n.dot(force_n) > limit_n * limit_n {
        return Err(Fault::TipCollision {
            value_n: sqrt(force_n.dot(force_n)),
            limit_n,
        });
    }
    Ok(())
}
