//! Plausibility checks between measurements, commands and model.
//!
//! | finding | criterion |
//! |---|---|
//! | replies lost too often | each lost reply counts as eight received ones; the balance exceeds its limit |
//! | encoder stuck, of a motor | unchanged value while the reference of a joint that it drives moves, out of contact, less far in modes of joint references if it is fine, or all encoders are unchanged; or while a stiff loop or, by the model, a breakaway ramp would move the joint; or from one cycle to the next if it was fast, or moved by several values in the cycle before |
//! | moves against its torque | 20 cycles in which a joint's momentum grows against its net torque; or a joint that moves against its breakaway ramp |
//! | unmodelled load | a force along gravity for 50 ms, in gravity hold or after the end of a move, or while the tip falls away from its reference |
//! | collision | the observed external torque or force exceeds its threshold |

use super::encoders::Encoders;
use super::fault::Fault;
use crate::config::PlausibilityLimits;
use crate::math::{Vector, Vector3, abs, sqrt};

const LOSS_WEIGHT: u32 = 8;
/// Fraction of `stuck_rad` that a moving joint may travel, at its last speed, while its encoder is
/// unchanged (0.02 rad for 0.1 rad).
pub(super) const SUDDEN_STOP_SHARE: f64 = 0.2;
/// Values per cycle by which a joint moves at least, if its encoder is to be seen to stop between two cycles.
const FREEZING_VALUES: f64 = 1.5;
/// Fraction of its speed with which it moves in the last cycle before. An impact takes some cycles: with a stiffness `k` on
/// an inertia `m` a quarter period of `sqrt(m / k)`, 2 ms for the lightest wrist on a steel surface.
const FREEZING_SHARE: f64 = 0.8;
/// Fraction of the travel of a fast joint after which such an encoder counts as stuck, and the least time \[s\]: what hits
/// the arm so hard makes it rebound.
const FREEZING_TRAVEL_SHARE: f64 = 0.3;
const FREEZING_S: f64 = 0.02;
/// Cycles with motion that make a contact plausible; encoders that stop one after the other show some.
const CONTACT_CYCLES: u32 = 5;
/// Time for which the encoder of a joint in a collision may stay unchanged before it counts as stuck \[s\]; with a stiff
/// loop that follows a reference, already at this fraction of the threshold of a collision.
const UNCHANGED_LIMIT_S: f64 = 0.03;
const UNCHANGED_TORQUE_SHARE: f64 = 0.5;
/// Fraction of `stuck_rad` that a joint's reference may travel while its encoder, or none, changes, in modes of joint
/// references: if all are unchanged, and if it is fine enough to show presliding, as under the torque of a breakaway ramp. At
/// a few newtons per metre of tip stiffness dry friction may hold all joints at once, or one while others move; the springs
/// of joints are stiffer.
const ALL_STUCK_SHARE: f64 = 0.5;
const FINE_STUCK_SHARE: f64 = 0.3;
/// Change of an encoder value up to which it shows presliding, which turns friction round over some 5e-4 rad \[rad\].
const FINE_ENCODER_RAD: f64 = 1e-4;
/// Angle beyond presliding \[rad\], and the weight of what a ramp does to a joint that has turned further: an obstacle is
/// as likely there as an encoder that sticks.
const PRESLIDING_RAD: f64 = 1e-3;
const MOVED_SHARE: f64 = 0.75;
/// Fraction of the dry friction up to which a ramp may not yet change such a value: presliding has then turned the joint by
/// two values or more.
const UNSEEN_FRICTION_SHARE: f64 = 0.4;
/// Change of an angle that is none \[rad\].
const NO_CHANGE_RAD: f64 = 1e-10;
/// Fraction of the speed above which a joint is fast, for an encoder that stops between two cycles: below it friction may
/// hold a light joint as suddenly.
const FREEZING_SPEED_SHARE: f64 = 0.2;
const AGAINST_CYCLES: u32 = 20;
const LOAD_S: f64 = 0.05;
/// Maximum ratio of the force perpendicular to gravity to the force along it, for a load.
const MAX_LATERAL_SHARE: f64 = 0.5;

/// History of the joints, and of the encoders of their motors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plausibility<const N: usize> {
    /// Of each joint: lost replies, and the last angle \[rad\].
    losses: [u32; N],
    measured_rad: Vector<N>,
    /// Of each encoder, as all that follows: the angle \[rad\].
    angle_rad: Vector<N>,
    /// The same at the last change of activity \[rad\].
    begin_rad: Vector<N>,
    /// Last change of the value that was one, and smallest \[rad\].
    change_rad: [f64; N],
    min_change_rad: [f64; N],
    /// The value is unchanged since the last cycle.
    unchanged: [bool; N],
    /// Speed when the value last changed \[rad/s\], and time since then \[s\].
    speed_rad_per_s: [f64; N],
    unchanged_s: [f64; N],
    /// Travel of the reference since the value last changed \[rad\].
    travel_rad: [f64; N],
    /// Speed at which a breakaway ramp would move its joint by the model, since an encoder last changed \[rad/s\].
    ramped_rad_per_s: f64,
    /// Torque of that ramp when they last changed \[N m\].
    ramp_nm: f64,
    opposed_cycles: [u32; N],
    /// Of the joints in the last cycle.
    last_velocity_rad_per_s: Vector<N>,
    last_momentum: Vector<N>,
    load_s: f64,
    /// Cycles of the present contact in which an encoder has changed, up to [`CONTACT_CYCLES`].
    contact_cycles: u32,
}

impl<const N: usize> Default for Plausibility<N> {
    fn default() -> Self {
        Plausibility {
            losses: [0; N],
            measured_rad: Vector::zeros(),
            angle_rad: Vector::zeros(),
            begin_rad: Vector::zeros(),
            change_rad: [0.0; N],
            min_change_rad: [f64::MAX; N],
            unchanged: [false; N],
            speed_rad_per_s: [0.0; N],
            unchanged_s: [0.0; N],
            travel_rad: [0.0; N],
            ramped_rad_per_s: 0.0,
            ramp_nm: 0.0,
            opposed_cycles: [0; N],
            last_velocity_rad_per_s: Vector::zeros(),
            last_momentum: Vector::zeros(),
            load_s: 0.0,
            contact_cycles: 0,
        }
    }
}

impl<const N: usize> Plausibility<N> {
    /// Last measured angles of the joints \[rad\].
    pub fn measured_rad(&self) -> Vector<N> {
        self.measured_rad
    }

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

    /// Receives the angles of the joints, the last ones where replies are missing.
    #[inline(always)]
    pub fn receive_angles(&mut self, encoders: &Encoders<N>, measured_rad: &Vector<N>) {
        self.measured_rad = *measured_rad;
        let angle_rad = encoders.of_joints(measured_rad);
        let last_rad = core::mem::replace(&mut self.angle_rad, angle_rad);
        for encoder in 0..N {
            let change_rad = abs(angle_rad[encoder] - last_rad[encoder]);
            self.unchanged[encoder] = change_rad < NO_CHANGE_RAD;
            if !self.unchanged[encoder] {
                self.change_rad[encoder] = change_rad;
                self.min_change_rad[encoder] = self.min_change_rad[encoder].min(change_rad);
            }
        }
    }

    /// Whether an encoder of a joint is unchanged since the last cycle.
    pub fn encoder_unchanged(&self, encoders: &Encoders<N>, joint: usize) -> bool {
        encoders.of(joint).any(|encoder| self.unchanged[encoder])
    }

    /// Whether no encoder value has changed since the last cycle.
    pub fn all_unchanged(&self) -> bool {
        !self.unchanged.contains(&false)
    }

    /// Resets the accumulated evidence at a change of activity.
    pub fn begin(&mut self) {
        self.begin_rad = self.angle_rad;
        self.travel_rad = [0.0; N];
        self.ramped_rad_per_s = 0.0;
        self.ramp_nm = 0.0;
        self.opposed_cycles = [0; N];
        self.load_s = 0.0;
    }

    /// Speed at which a breakaway ramp of `ramp_nm` would move `joint` by the model, counted from the last change of its
    /// encoders, with its inertia \[kg m^2\]. At rest some of the dry friction `dry_nm` \[N m\] holds it, or what has held it
    /// while its encoders still changed, if that is more. Zero for an encoder that is too coarse to show the presliding of a
    /// joint at rest: with friction that the model underestimates, an encoder that works would look like a stuck one.
    pub fn ramped_rad_per_s(
        &mut self,
        encoders: &Encoders<N>,
        joint: usize,
        ramp_nm: f64,
        dry_nm: f64,
        inertia_kg_m2: f64,
        elapsed_s: f64,
    ) -> f64 {
        let mut of_joint = encoders.of(joint);
        if of_joint.any(|encoder| self.min_change_rad[encoder] > FINE_ENCODER_RAD) {
            return 0.0;
        }
        if self.encoder_unchanged(encoders, joint) {
            let excess_nm = abs(ramp_nm) - (UNSEEN_FRICTION_SHARE * dry_nm).max(self.ramp_nm);
            let moved = |encoder: usize| {
                abs(self.angle_rad[encoder] - self.begin_rad[encoder]) > PRESLIDING_RAD
            };
            let share = match encoders.of(joint).any(moved) {
                true => MOVED_SHARE,
                false => 1.0,
            };
            self.ramped_rad_per_s += share * excess_nm.max(0.0) / inertia_kg_m2 * elapsed_s;
        } else {
            self.ramped_rad_per_s = 0.0;
            self.ramp_nm = abs(ramp_nm);
        }
        self.ramped_rad_per_s
    }

    /// Suspends the checks in this cycle and discards the history.
    pub fn reset_history(&mut self, momentum: &Vector<N>) {
        self.last_momentum = *momentum;
        self.last_velocity_rad_per_s = Vector::zeros();
        self.speed_rad_per_s = [0.0; N];
        self.unchanged_s = [0.0; N];
    }

    /// Reports a stuck encoder if the value of one that moves stops changing from one cycle to the next.
    pub fn check_sudden_stop(
        &mut self,
        encoders: &Encoders<N>,
        limit_rad: f64,
        velocity_rad_per_s: &Vector<N>,
        fast_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        let last_rad_per_s =
            core::mem::replace(&mut self.last_velocity_rad_per_s, *velocity_rad_per_s);
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                self.unchanged_s[encoder] = 0.0;
                continue;
            }
            if self.unchanged_s[encoder] == 0.0 {
                let speed_rad_per_s = encoders.of_joints_at(encoder, &last_rad_per_s);
                self.speed_rad_per_s[encoder] = abs(speed_rad_per_s);
            }
            self.unchanged_s[encoder] += elapsed_s;
            let joint = encoders.joint(encoder);
            let value_rad = self.speed_rad_per_s[encoder] * self.unchanged_s[encoder];
            let fast_rad_per_s = fast_rad_per_s[joint];
            if value_rad > FREEZING_TRAVEL_SHARE * limit_rad
                && let Some(share) = self.stopped_at(encoder, fast_rad_per_s, elapsed_s)
                && value_rad > share * limit_rad
            {
                return Err(Fault::EncoderStuck {
                    joint,
                    value_rad,
                    limit_rad: share * limit_rad,
                });
            }
        }
        Ok(())
    }

    /// Fraction of the limit of travel after which an encoder that no longer changes counts as stuck: if it turned with its
    /// whole speed, fast enough to see that, in the last cycle before; all of it, if it was fast.
    #[inline(never)]
    fn stopped_at(&self, encoder: usize, fast_rad_per_s: f64, elapsed_s: f64) -> Option<f64> {
        let speed_rad_per_s = self.speed_rad_per_s[encoder];
        let travel_rad = speed_rad_per_s * elapsed_s;
        let sudden = self.unchanged_s[encoder] > FREEZING_S
            && self.change_rad[encoder] > FREEZING_SHARE * travel_rad
            && travel_rad > FREEZING_VALUES * self.min_change_rad[encoder]
            && speed_rad_per_s > FREEZING_SPEED_SHARE * fast_rad_per_s;
        match sudden {
            true => Some(FREEZING_TRAVEL_SHARE),
            false => (speed_rad_per_s > fast_rad_per_s).then_some(1.0),
        }
    }

    /// Reports a joint collision as a stuck encoder if no encoder of the joint has changed for some time: both are equally
    /// likely, and gravity compensation from a wrong angle would not hold the arm.
    pub fn as_stuck_encoder(
        &self,
        plausible: &PlausibilityLimits,
        encoders: &Encoders<N>,
        fault: Fault,
    ) -> Fault {
        let Fault::JointCollision { joint, .. } = fault else {
            return fault;
        };
        let rests = |encoder: usize| self.unchanged_s[encoder] > UNCHANGED_LIMIT_S;
        if !encoders.of(joint).all(rests) || plausible.stuck_rad == f64::MAX {
            return fault;
        }
        let travel_rad = encoders.of(joint).map(|encoder| self.travel_rad[encoder]);
        Fault::EncoderStuck {
            joint,
            value_rad: travel_rad.fold(0.0, f64::max),
            limit_rad: plausible.stuck_rad,
        }
    }

    /// Reports a stuck encoder if a stiff loop drives a joint whose encoder has been unchanged for some time.
    pub fn check_driven_encoder(
        &self,
        plausible: &PlausibilityLimits,
        encoders: &Encoders<N>,
        threshold_nm: &Vector<N>,
        external_nm: &Vector<N>,
    ) -> Result<(), Fault> {
        let limit_rad = plausible.stuck_rad;
        for encoder in 0..N {
            let (joint, value_rad) = (encoders.joint(encoder), self.travel_rad[encoder]);
            let driven = value_rad > 0.0 && self.unchanged_s[encoder] > UNCHANGED_LIMIT_S;
            let strong_nm = UNCHANGED_TORQUE_SHARE * threshold_nm[joint];
            if driven && abs(external_nm[joint]) > strong_nm && limit_rad < f64::MAX {
                return Err(Fault::EncoderStuck {
                    joint,
                    value_rad,
                    limit_rad,
                });
            }
        }
        Ok(())
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

    /// Reports a stuck encoder if its value is unchanged while its reference travels further than `stuck_rad`, or than a
    /// fraction of it in modes of joint references.
    pub fn check_stuck_encoder(
        &mut self,
        encoders: &Encoders<N>,
        stuck_rad: f64,
        reference_rad_per_s: &Vector<N>,
        joint_reference: bool,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        if !self.unchanged.contains(&true) {
            self.travel_rad = [0.0; N];
            return Ok(());
        }
        let reference_rad_per_s = encoders.of_joints(reference_rad_per_s);
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                self.travel_rad[encoder] = 0.0;
                continue;
            }
            self.travel_rad[encoder] += abs(reference_rad_per_s[encoder]) * elapsed_s;
            let share = match joint_reference {
                true if self.min_change_rad[encoder] < FINE_ENCODER_RAD => FINE_STUCK_SHARE,
                true if self.all_unchanged() => ALL_STUCK_SHARE,
                _ => 1.0,
            };
            let limit_rad = share * stuck_rad;
            if self.travel_rad[encoder] > limit_rad {
                return Err(Fault::EncoderStuck {
                    joint: encoders.joint(encoder),
                    value_rad: self.travel_rad[encoder],
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

    /// Discards the evidence of a load.
    pub fn no_load(&mut self) {
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

pub(super) fn tip_collision(limit_n: f64, force_n: &Vector3<f64>) -> Result<(), Fault> {
    if force_n.dot(force_n) > limit_n * limit_n {
        return Err(Fault::TipCollision {
            value_n: sqrt(force_n.dot(force_n)),
            limit_n,
        });
    }
    Ok(())
}
