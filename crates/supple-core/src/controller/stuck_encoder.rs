//! Encoders that stick: history of the encoders of the motors.
//!
//! One counts as stuck if it is unchanged
//!
//! - while the reference of a joint that its motor drives moves, out of contact; less far in modes of joint references if
//!   the encoder is fine, or all are unchanged;
//! - while the external torque on its motor, as observed, grows beyond what dry friction holds: an encoder that works shows
//!   what the elasticity of drive, arm and obstacle gives;
//! - while, by the model, a breakaway ramp would move the joint;
//! - after it stopped between two cycles: it was fast, or turned with its whole speed in the cycle before.

use super::checks::MOVING_SHARE;
use super::encoders::Encoders;
use super::fault::Fault;
use crate::config::PlausibilityLimits;
use crate::math::{Vector, abs};

/// Fraction of `stuck_rad` that a fast joint may travel, at its last speed, while its encoder is unchanged (0.02 rad for
/// 0.1 rad).
const FAST_STOP_SHARE: f64 = 0.2;
/// Counts per cycle by which an encoder moves at least, if it is to be seen to stop between two cycles.
const SUDDEN_STOP_COUNTS: f64 = 1.5;
/// Fraction of its speed with which it moves in the last cycle before. An impact takes some cycles: with a stiffness `k` on
/// an inertia `m` a quarter period of `sqrt(m / k)`, 2 ms for the lightest wrist on a steel surface.
const FULL_SPEED_SHARE: f64 = 0.8;
/// Fraction of that travel after which an encoder that stops so counts as stuck, and the least time \[s\]: what hits
/// the arm so hard makes it rebound.
const SUDDEN_STOP_TRAVEL_SHARE: f64 = 0.3;
const SUDDEN_STOP_S: f64 = 0.02;
/// Fraction of the speed above which a joint is fast, for an encoder that stops between two cycles: below it friction may
/// hold a light joint as suddenly.
const SUDDEN_STOP_SPEED_SHARE: f64 = 0.2;
/// Cycles with motion that make a contact plausible; encoders that stop one after the other show some.
const CONTACT_CYCLES: u32 = 5;
/// Time for which the encoder of a joint in a collision may stay unchanged before it counts as stuck \[s\].
const UNCHANGED_LIMIT_S: f64 = 0.03;
/// The same under a torque that dry friction does not hold: longer than a blow takes to turn the joint by a count.
const LOADED_LIMIT_S: f64 = 0.02;
/// Fraction of `stuck_rad` that a joint's reference may travel while its encoder, or none, changes, in modes of joint
/// references: if all are unchanged, and if it is fine enough to show presliding, as under the torque of a breakaway ramp. At
/// a few newtons per metre of tip stiffness dry friction may hold all joints at once, or one while others move; the springs
/// of joints are stiffer.
const ALL_STUCK_SHARE: f64 = 0.5;
const FINE_STUCK_SHARE: f64 = 0.3;
/// Smallest change up to which an encoder shows presliding, which turns friction round over some 5e-4 rad \[rad\].
const FINE_ENCODER_RAD: f64 = 1e-4;
/// Angle beyond presliding \[rad\], and the weight of what a ramp does to a joint that has turned further: an obstacle is
/// as likely there as an encoder that sticks.
const PRESLIDING_RAD: f64 = 1e-3;
const MOVED_SHARE: f64 = 0.75;
/// Fraction of the dry friction up to which a ramp may not yet show in such an encoder: presliding has then turned the joint by
/// two counts or more.
const UNSEEN_FRICTION_SHARE: f64 = 0.4;
/// Coarsest resolution of an encoder; one that has not changed has shown none \[rad\].
const MAX_RESOLUTION_RAD: f64 = 1e-3;
/// Change of an angle that is none \[rad\].
const NO_CHANGE_RAD: f64 = 1e-10;

/// History of the encoders.
#[derive(Clone, Copy, Debug)]
pub(super) struct StuckEncoders<const N: usize> {
    /// Last angle of each joint \[rad\].
    measured_rad: Vector<N>,
    /// Of each encoder, as all that follows: the angle, and that at the last change of activity \[rad\].
    angle_rad: Vector<N>,
    begin_rad: Vector<N>,
    /// Last change, and smallest one \[rad\].
    change_rad: [f64; N],
    min_change_rad: [f64; N],
    /// Unchanged since the last cycle.
    unchanged: [bool; N],
    /// Speed at the last change \[rad/s\], and time since then \[s\].
    speed_rad_per_s: [f64; N],
    unchanged_s: [f64; N],
    /// External torque on its motor when it stopped \[N m\], and time for which it has since been more than friction holds \[s\].
    external_nm: [f64; N],
    loaded_s: [f64; N],
    /// Travel of the reference since the last change \[rad\].
    travel_rad: [f64; N],
    /// Speed at which a breakaway ramp would move its joint by the model, since an encoder last changed \[rad/s\].
    ramped_rad_per_s: f64,
    /// Torque of that ramp when they last changed \[N m\].
    ramp_nm: f64,
    /// Of the joints in the last cycle.
    last_velocity_rad_per_s: Vector<N>,
    /// Cycles of the present contact in which an encoder has changed, up to [`CONTACT_CYCLES`].
    contact_cycles: u32,
}

/// What a step of an encoder adds to the observed torque on its motor.
pub(super) struct StepEffect {
    /// Torque over the step \[N m/rad\].
    pub nm_per_rad: f64,
    /// Time after the step in which it shows \[s\].
    pub lasts_s: f64,
}

impl<const N: usize> Default for StuckEncoders<N> {
    fn default() -> Self {
        StuckEncoders {
            measured_rad: Vector::zeros(),
            angle_rad: Vector::zeros(),
            begin_rad: Vector::zeros(),
            change_rad: [0.0; N],
            min_change_rad: [f64::MAX; N],
            unchanged: [false; N],
            speed_rad_per_s: [0.0; N],
            unchanged_s: [0.0; N],
            external_nm: [0.0; N],
            loaded_s: [0.0; N],
            travel_rad: [0.0; N],
            ramped_rad_per_s: 0.0,
            ramp_nm: 0.0,
            last_velocity_rad_per_s: Vector::zeros(),
            contact_cycles: 0,
        }
    }
}

impl<const N: usize> StuckEncoders<N> {
    /// Last measured angles of the joints \[rad\].
    pub fn measured_rad(&self) -> Vector<N> {
        self.measured_rad
    }

    /// Receives the angles of the joints, the last ones where replies are missing.
    #[inline(always)]
    pub fn receive(&mut self, encoders: &Encoders<N>, measured_rad: &Vector<N>) {
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

    /// Steps in which the angles of the joints change, as far as their encoders have shown: the smallest change of each, at most
    /// [`MAX_RESOLUTION_RAD`] \[rad\].
    pub fn resolution_rad(&self, encoders: &Encoders<N>) -> Vector<N> {
        Vector::from_fn(|joint, _| {
            let changes = encoders.of(joint).map(|of| self.min_change_rad[of]);
            changes.fold(0.0, f64::max).min(MAX_RESOLUTION_RAD)
        })
    }

    /// Adds a cycle to the time for which an external torque beyond the limit has grown by as much since the encoder stopped.
    #[cold]
    #[inline(never)]
    fn add_load(
        &mut self,
        encoder: usize,
        torque_nm: f64,
        limit_nm: f64,
        step: &impl Fn(usize) -> StepEffect,
        elapsed_s: f64,
    ) {
        let step = step(encoder);
        let unchanged_s = self.unchanged_s[encoder];
        let mut beyond_nm = limit_nm;
        if unchanged_s - elapsed_s <= step.lasts_s {
            let step_nm = self.step_rad(encoder) * step.nm_per_rad;
            if unchanged_s <= step.lasts_s {
                beyond_nm += step_nm;
            } else {
                // The step no longer shows: what the torque was when the encoder stopped is now known without it.
                let change_nm = torque_nm - self.external_nm[encoder];
                self.external_nm[encoder] += change_nm.max(-step_nm).min(step_nm);
            }
        }
        let stopped_at_nm = self.external_nm[encoder];
        let grows =
            abs(torque_nm) > abs(stopped_at_nm) && abs(torque_nm - stopped_at_nm) > beyond_nm;
        self.loaded_s[encoder] = match grows {
            true => self.loaded_s[encoder] + elapsed_s,
            false => 0.0,
        };
    }

    /// Smallest change of an encoder, its resolution; zero if all have been greater than [`MAX_RESOLUTION_RAD`] \[rad\].
    fn step_rad(&self, encoder: usize) -> f64 {
        let change_rad = self.min_change_rad[encoder];
        if change_rad <= MAX_RESOLUTION_RAD {
            change_rad
        } else {
            0.0
        }
    }

    /// Whether an encoder is unchanged since the last cycle.
    pub fn any_unchanged(&self) -> bool {
        self.unchanged.contains(&true)
    }

    /// Whether an encoder of a joint is unchanged since the last cycle.
    pub fn any_unchanged_of(&self, encoders: &Encoders<N>, joint: usize) -> bool {
        encoders.of(joint).any(|encoder| self.unchanged[encoder])
    }

    /// Whether no encoder has changed since the last cycle.
    pub fn all_unchanged(&self) -> bool {
        !self.unchanged.contains(&false)
    }

    /// Discards the evidence at a change of activity.
    pub fn begin(&mut self) {
        self.begin_rad = self.angle_rad;
        self.travel_rad = [0.0; N];
        self.ramped_rad_per_s = 0.0;
        self.ramp_nm = 0.0;
    }

    /// Suspends the checks in this cycle: a motion that ends now was stopped.
    pub fn suspend(&mut self) {
        self.last_velocity_rad_per_s = Vector::zeros();
        self.speed_rad_per_s = [0.0; N];
        self.unchanged_s = [0.0; N];
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
        if self.any_unchanged_of(encoders, joint) {
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

    /// Reports a stuck encoder if one that moves stops changing from one cycle to the next. `max_rad_per_s` are the limits of
    /// the joints' speeds.
    pub fn check_sudden_stop(
        &mut self,
        encoders: &Encoders<N>,
        plausible: &PlausibilityLimits,
        velocity_rad_per_s: &Vector<N>,
        max_rad_per_s: &Vector<N>,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        let limit_rad = FAST_STOP_SHARE * plausible.stuck_rad;
        let last_rad_per_s =
            core::mem::replace(&mut self.last_velocity_rad_per_s, *velocity_rad_per_s);
        if !self.any_unchanged() {
            self.unchanged_s = [0.0; N];
            self.travel_rad = [0.0; N];
            return Ok(());
        }
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                self.unchanged_s[encoder] = 0.0;
                self.travel_rad[encoder] = 0.0;
                continue;
            }
            if self.unchanged_s[encoder] == 0.0 {
                let speed_rad_per_s = encoders.of_joints_at(encoder, &last_rad_per_s);
                self.speed_rad_per_s[encoder] = abs(speed_rad_per_s);
            }
            self.unchanged_s[encoder] += elapsed_s;
            let joint = encoders.joint(encoder);
            let value_rad = self.speed_rad_per_s[encoder] * self.unchanged_s[encoder];
            let fast_rad_per_s = MOVING_SHARE * max_rad_per_s[joint];
            if value_rad > SUDDEN_STOP_TRAVEL_SHARE * limit_rad
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
        let sudden = self.unchanged_s[encoder] > SUDDEN_STOP_S
            && self.change_rad[encoder] > FULL_SPEED_SHARE * travel_rad
            && travel_rad > SUDDEN_STOP_COUNTS * self.min_change_rad[encoder]
            && speed_rad_per_s > SUDDEN_STOP_SPEED_SHARE * fast_rad_per_s;
        match sudden {
            true => Some(SUDDEN_STOP_TRAVEL_SHARE),
            false => (speed_rad_per_s > fast_rad_per_s).then_some(1.0),
        }
    }

    /// Reports a stuck encoder if it is unchanged although the external torque on its motor has grown beyond
    /// `stiction_limit_nm`, what dry friction holds, for some time. A torque that was that large when the encoder stopped may be
    /// that of an obstacle. While the observed torque shows the last step of the encoder, growth by so much does not count, and is
    /// no growth later. After [`StuckEncoders::check_sudden_stop`] of the same cycle.
    #[inline(never)]
    pub fn check_torque(
        &mut self,
        encoders: &Encoders<N>,
        plausible: &PlausibilityLimits,
        external_nm: &Vector<N>,
        stiction_limit_nm: &Vector<N>,
        step: impl Fn(usize) -> StepEffect,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                continue;
            }
            let torque_nm = encoders.torque_at(encoder, external_nm);
            if self.unchanged_s[encoder] <= elapsed_s {
                (self.external_nm[encoder], self.loaded_s[encoder]) = (torque_nm, 0.0);
            }
            let limit_nm = stiction_limit_nm[encoder];
            if abs(torque_nm) <= limit_nm {
                self.loaded_s[encoder] = 0.0;
                continue;
            }
            self.add_load(encoder, torque_nm, limit_nm, &step, elapsed_s);
            if self.loaded_s[encoder] > LOADED_LIMIT_S && plausible.stuck_rad < f64::MAX {
                let joint = encoders.joint(encoder);
                return Err(Fault::EncoderUnmoved {
                    joint,
                    value_nm: abs(torque_nm),
                    limit_nm,
                });
            }
        }
        Ok(())
    }

    /// Reports a joint collision as a stuck encoder if no encoder of the joint has changed for some time: both are equally
    /// likely, and gravity compensation from a wrong angle would not hold the arm.
    pub fn as_stuck_encoder(
        &self,
        plausible: &PlausibilityLimits,
        encoders: &Encoders<N>,
        fault: Fault,
    ) -> Fault {
        let Fault::JointCollision {
            joint,
            value_nm,
            limit_nm,
        } = fault
        else {
            return fault;
        };
        let rests = |encoder: usize| self.unchanged_s[encoder] > UNCHANGED_LIMIT_S;
        if !encoders.of(joint).all(rests) || plausible.stuck_rad == f64::MAX {
            return fault;
        }
        Fault::EncoderUnmoved {
            joint,
            value_nm,
            limit_nm,
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

    /// Reports a stuck encoder if it is unchanged while its reference travels further than `stuck_rad`, or than a
    /// fraction of it in modes of joint references.
    pub fn check_reference(
        &mut self,
        encoders: &Encoders<N>,
        plausible: &PlausibilityLimits,
        reference_rad_per_s: &Vector<N>,
        joint_reference: bool,
        elapsed_s: f64,
    ) -> Result<(), Fault> {
        if !self.any_unchanged() {
            return Ok(());
        }
        let reference_rad_per_s = encoders.of_joints(reference_rad_per_s);
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                continue;
            }
            self.travel_rad[encoder] += abs(reference_rad_per_s[encoder]) * elapsed_s;
            let share = match joint_reference {
                true if self.min_change_rad[encoder] < FINE_ENCODER_RAD => FINE_STUCK_SHARE,
                true if self.all_unchanged() => ALL_STUCK_SHARE,
                _ => 1.0,
            };
            let limit_rad = share * plausible.stuck_rad;
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
}
