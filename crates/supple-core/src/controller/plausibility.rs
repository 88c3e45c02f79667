//! Plausibility checks between measurements, commands and model.
//!
//! | finding | criterion |
//! |---|---|
//! | replies lost too often | each lost reply counts as eight received ones; the balance exceeds its limit |
//! | encoder stuck | unchanged value while the joint's reference moves, out of contact, half as far in modes of joint references if all encoders are unchanged; or while a breakaway ramp would move the joint by the model; or from one cycle to the next for a joint that is fast, or that moved by several values in the cycle before |
//! | moves against its torque | 20 cycles in which a joint's momentum grows against its net torque; or a joint that moves against its breakaway ramp |
//! | unmodelled load | a force along gravity for 50 ms, in gravity hold or after the end of a move |
//! | collision | the observed external torque or force exceeds its threshold |

use super::fault::Fault;
use crate::config::PlausibilityLimits;
use crate::math::{Vector, Vector3, abs, sqrt};

const LOSS_WEIGHT: u32 = 8;
/// Fraction of `stuck_rad` that a moving joint may travel, at its last speed, while its encoder is
/// unchanged (0.02 rad for 0.1 rad).
pub(super) const SUDDEN_STOP_SHARE: f64 = 0.2;
/// Values per cycle by which a joint moves at least, if its encoder is to be seen to stop between two cycles.
const FREEZING_VALUES: f64 = 5.0;
/// Fraction of its speed with which it moves in the last cycle before. An impact takes some cycles: with a stiffness `k` on
/// an inertia `m` a quarter period of `sqrt(m / k)`, 2 ms for the lightest wrist on a steel surface.
const FREEZING_SHARE: f64 = 0.8;
/// Cycles with motion that make a contact plausible; encoders that stop one after the other show some.
const CONTACT_CYCLES: u32 = 5;
/// Time for which the encoder of a joint in a collision may stay unchanged before it counts as
/// stuck \[s\].
const UNCHANGED_LIMIT_S: f64 = 0.03;
/// Fraction of `stuck_rad` that a joint's reference may travel while no encoder changes, in modes of joint references.
/// At a few newtons per metre of tip stiffness dry friction may hold all joints at once, or one while others move; the
/// springs of joints are stiffer.
pub(super) const ALL_STUCK_SHARE: f64 = 0.5;
/// The same for the travel that the model predicts for the joint of a breakaway ramp, which no loop holds back.
pub(super) const RAMP_STUCK_SHARE: f64 = 0.3;
/// Change of an encoder value up to which it shows presliding, which turns friction round over some 5e-4 rad \[rad\].
const FINE_ENCODER_RAD: f64 = 1e-4;
/// Sum of the squared speeds of all joints above which some of them move freely \[(rad/s)^2\].
pub(super) const OTHER_JOINTS_MOVING_RAD_PER_S2: f64 = 0.1 * 0.1;
const AGAINST_CYCLES: u32 = 20;
const LOAD_S: f64 = 0.05;
/// Maximum ratio of the force perpendicular to gravity to the force along it, for a load.
const MAX_LATERAL_SHARE: f64 = 0.5;

/// History of each joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plausibility<const N: usize> {
    losses: [u32; N],
    last_measured: [Option<f64>; N],
    /// Smallest change of the encoder value, and the last one \[rad\].
    min_change_rad: [f64; N],
    change_rad: [f64; N],
    /// The encoder value is unchanged since the last cycle.
    unchanged: [bool; N],
    /// Speed of the joint when the encoder last changed \[rad/s\], and time since then \[s\].
    speed_rad_per_s: [f64; N],
    unchanged_s: [f64; N],
    /// Travel of the reference since the encoder last changed \[rad\].
    travel_rad: [f64; N],
    /// Speed at which a breakaway ramp would move its joint by the model, since the encoder last changed \[rad/s\].
    ramped_rad_per_s: f64,
    /// Torque of that ramp when the encoder last changed \[N m\].
    ramp_nm: f64,
    opposed_cycles: [u32; N],
    last_momentum: Vector<N>,
    load_s: f64,
    /// Cycles of the present contact in which an encoder has changed, up to [`CONTACT_CYCLES`].
    contact_cycles: u32,
}

impl<const N: usize> Default for Plausibility<N> {
    fn default() -> Self {
        Plausibility {
            losses: [0; N],
            last_measured: [None; N],
            min_change_rad: [f64::MAX; N],
            change_rad: [0.0; N],
            unchanged: [false; N],
            speed_rad_per_s: [0.0; N],
            unchanged_s: [0.0; N],
            travel_rad: [0.0; N],
            ramped_rad_per_s: 0.0,
            ramp_nm: 0.0,
            opposed_cycles: [0; N],
            last_momentum: Vector::zeros(),
            load_s: 0.0,
            contact_cycles: 0,
        }
    }
}

impl<const N: usize> Plausibility<N> {
    /// Receives the encoder replies of a cycle.
    pub fn receive(
        &mut self,
        plausible: &PlausibilityLimits,
        measured_rad: &[Option<f64>; N],
    ) -> Result<(), Fault> {
        for (joint, measured) in measured_rad.iter().enumerate() {
            match *measured {
                Some(position) => {
                    self.losses[joint] = self.losses[joint].saturating_sub(1);
                    let last = self.last_measured[joint].replace(position);
                    self.unchanged[joint] = last == Some(position);
                    if let Some(last) = last
                        && last != position
                    {
                        let change_rad = abs(position - last);
                        self.change_rad[joint] = change_rad;
                        self.min_change_rad[joint] = self.min_change_rad[joint].min(change_rad);
                    }
                }
                None => {
                    self.losses[joint] += LOSS_WEIGHT;
                    self.unchanged[joint] = true;
                }
            }
            if self.losses[joint] > LOSS_WEIGHT.saturating_mul(plausible.lost_replies) {
                self.losses[joint] = 0;
                return Err(Fault::EncoderUnreliable { joint });
            }
        }
        Ok(())
    }

    /// Whether the encoder value of a joint is unchanged since the last cycle.
    pub fn encoder_unchanged(&self, joint: usize) -> bool {
        self.unchanged[joint]
    }

    /// Whether no encoder value has changed since the last cycle.
    pub fn all_unchanged(&self) -> bool {
        !self.unchanged.contains(&false)
    }

    /// Resets the accumulated evidence at a change of activity.
    pub fn begin(&mut self) {
        self.travel_rad = [0.0; N];
        self.ramped_rad_per_s = 0.0;
        self.ramp_nm = 0.0;
        self.opposed_cycles = [0; N];
        self.load_s = 0.0;
    }

    /// Speed at which a breakaway ramp of `ramp_nm` would move `joint` by the model, counted from the last change of its
    /// encoder value, with its inertia \[kg m^2\]. The dry friction at rest is `dry_nm` \[N m\], or what has held the joint
    /// while its encoder still changed, if that is more. Zero for an encoder that is too coarse to show the presliding of a
    /// joint at rest: with friction that the model underestimates, an encoder that works would look like a stuck one.
    pub fn ramped_rad_per_s(
        &mut self,
        joint: usize,
        ramp_nm: f64,
        dry_nm: f64,
        inertia_kg_m2: f64,
        elapsed_s: f64,
    ) -> f64 {
        if self.min_change_rad[joint] > FINE_ENCODER_RAD {
            return 0.0;
        }
        if self.unchanged[joint] {
            let excess_nm = abs(ramp_nm) - dry_nm.max(self.ramp_nm);
            self.ramped_rad_per_s += excess_nm.max(0.0) / inertia_kg_m2 * elapsed_s;
        } else {
            self.ramped_rad_per_s = 0.0;
            self.ramp_nm = abs(ramp_nm);
        }
        self.ramped_rad_per_s
    }

    /// Suspends the checks in this cycle and discards the joints' history.
    pub fn reset_history(&mut self, momentum: &Vector<N>) {
        self.last_momentum = *momentum;
        self.speed_rad_per_s = [0.0; N];
        self.unchanged_s = [0.0; N];
    }

    /// Reports a stuck encoder if the value of a moving joint stops changing from one cycle to the
    /// next.
    pub fn check_sudden_stop(
        &mut self,
        limit_rad: f64,
        velocity_rad_per_s: &Vector<N>,
        moving_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        for joint in 0..N {
            if !self.unchanged[joint] {
                self.speed_rad_per_s[joint] = abs(velocity_rad_per_s[joint]);
                self.unchanged_s[joint] = 0.0;
                continue;
            }
            self.unchanged_s[joint] += elapsed_s;
            let value_rad = self.speed_rad_per_s[joint] * self.unchanged_s[joint];
            if value_rad > limit_rad
                && (self.speed_rad_per_s[joint] > moving_rad_per_s[joint]
                    || self.froze(joint, elapsed_s))
            {
                return Err(Fault::EncoderStuck {
                    joint,
                    value_rad,
                    limit_rad,
                });
            }
        }
        Ok(())
    }

    /// Whether the joint moved at its speed in the last cycle in which its encoder value changed, fast enough to see that.
    #[inline(never)]
    fn froze(&self, joint: usize, elapsed_s: f64) -> bool {
        let travel_rad = self.speed_rad_per_s[joint] * elapsed_s;
        self.change_rad[joint] > FREEZING_SHARE * travel_rad
            && travel_rad > FREEZING_VALUES * self.min_change_rad[joint]
    }

    /// Reports a joint collision as a stuck encoder if the encoder has been unchanged for some
    /// time: both are equally likely, and gravity compensation from a wrong angle would not hold
    /// the arm.
    pub fn as_stuck_encoder(&self, plausible: &PlausibilityLimits, fault: Fault) -> Fault {
        match fault {
            Fault::JointCollision { joint, .. }
                if self.unchanged_s[joint] > UNCHANGED_LIMIT_S
                    && plausible.stuck_rad < f64::MAX =>
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

    /// Whether the latched contact is one: encoders have changed in [`CONTACT_CYCLES`] of its cycles.
    pub fn is_contact_plausible(&mut self, in_contact: bool) -> bool {
        if !in_contact {
            self.contact_cycles = 0;
        } else if self.contact_cycles < CONTACT_CYCLES && !self.all_unchanged() {
            self.contact_cycles += 1;
        }
        self.contact_cycles >= CONTACT_CYCLES
    }

    /// Reports a stuck encoder if its value is unchanged while the joint's reference travels further than the limit.
    pub fn check_stuck_encoder(
        &mut self,
        limit_rad: f64,
        reference_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        for joint in 0..N {
            if !self.unchanged[joint] {
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

    /// `net_torque` is the rate of change of the momentum without external torque \[N m\].
    pub fn check_against_torque(
        &mut self,
        momentum: &Vector<N>,
        net_torque: &Vector<N>,
        limit_nm: &Vector<N>,
    ) -> Result<(), Fault> {
        let last = core::mem::replace(&mut self.last_momentum, *momentum);
        for joint in 0..N {
            let limit_nm = limit_nm[joint];
            let accelerates = (momentum[joint] - last[joint]) * momentum[joint] > 0.0;
            let opposed =
                net_torque[joint] * momentum[joint] < 0.0 && abs(net_torque[joint]) > limit_nm;
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

/// Inputs of the plausibility checks in one cycle.
pub(super) struct PlausibilityInput<'a, const N: usize> {
    /// Reference velocities of the joints \[rad/s\].
    pub reference_rad_per_s: &'a Vector<N>,
    /// Rate of change of the momentum without external torque \[N m\].
    pub net_torque_nm: &'a Vector<N>,
    /// Observed force on the tip, base axes \[N\].
    pub force_n: &'a Vector3<f64>,
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

pub(super) fn tip_collision(limit_n: f64, force_n: &Vector3<f64>) -> Result<(), Fault> {
    if force_n.dot(force_n) > limit_n * limit_n {
        return Err(Fault::TipCollision {
            value_n: sqrt(force_n.dot(force_n)),
            limit_n,
        });
    }
    Ok(())
}
