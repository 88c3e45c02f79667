//! Detection of stuck motor encoders from the history of their angles.
//!
//! An encoder counts as stuck if its angle is unchanged
//!
//! - while the reference of a joint that its motor drives moves, out of contact. In modes with joint references a shorter
//!   travel of the reference suffices if the encoder is fine, or if all encoders are unchanged;
//! - while the observed external torque on its motor grows beyond what dry friction holds. A working encoder would change
//!   by the elastic deflection of drive, arm and obstacle;
//! - while a breakaway ramp would move the joint according to the model;
//! - after it stopped between two cycles, although it was fast, or moved at full speed in the cycle before.

use super::checks::MOVING_SHARE;
use super::encoders::Encoders;
use super::fault::Fault;
use crate::config::PlausibilityLimits;
use crate::math::{Vector, abs};

/// Fraction of `stuck_rad` that a fast joint may travel, at its last speed, while its encoder is unchanged (0.02 rad for
/// 0.1 rad).
const FAST_STOP_SHARE: f64 = 0.2;
/// Minimum speed, in counts per cycle, at which the check detects that an encoder stops between two cycles.
const SUDDEN_STOP_COUNTS: f64 = 1.5;
/// Minimum fraction of its speed with which the encoder moves in the last cycle before a sudden stop. An impact takes some
/// cycles: a quarter period of a mass `m` on a stiffness `k`, 2 ms for the lightest wrist on a steel surface.
const FULL_SPEED_SHARE: f64 = 0.8;
/// Fraction of the [`FAST_STOP_SHARE`] travel after which an encoder that stops suddenly counts as stuck, and the minimum
/// time \[s\]: after an impact of this strength the arm would rebound.
const SUDDEN_STOP_TRAVEL_SHARE: f64 = 0.3;
const SUDDEN_STOP_S: f64 = 0.02;
/// Minimum speed of an encoder that stops between two cycles, as a fraction of the speed above which a joint is fast. Below
/// it, friction may stop a light joint as suddenly.
const SUDDEN_STOP_SPEED_SHARE: f64 = 0.2;
/// Number of cycles in which friction may stop a light joint: an encoder with coarse steps may show its last motion a cycle late.
const FRICTION_STOP_CYCLES: f64 = 2.0;
/// Number of cycles with motion that make a contact plausible. Encoders that stick one after the other still have some.
const CONTACT_CYCLES: u32 = 5;
/// Limit of the torque that leaves an encoder unchanged in a contact during which it has changed, over the limit without contact. A
/// rigid arm that presses on a rigid obstacle does not move either.
const CONTACT_LIMIT_FACTOR: f64 = 2.0;
/// Time for which the encoder of a joint in a collision may stay unchanged before it counts as stuck \[s\].
const UNCHANGED_LIMIT_S: f64 = 0.03;
/// The same time under a torque that dry friction does not hold \[s\]. A blow moves the joint by one count sooner.
const LOADED_LIMIT_S: f64 = 0.02;
/// Fraction of `stuck_rad` that a joint's reference may travel in modes with joint references: while all encoders are
/// unchanged, and while an encoder fine enough to resolve presliding is unchanged. The fractions are smaller than one because
/// joint springs are stiff; at a tip stiffness of a few newtons per metre dry friction may hold one joint, or all of them.
const ALL_STUCK_SHARE: f64 = 0.5;
const FINE_STUCK_SHARE: f64 = 0.3;
/// Maximum resolution step with which an encoder resolves presliding, in which friction reverses over some 5e-4 rad \[rad\].
const FINE_ENCODER_RAD: f64 = 1e-4;
/// Maximum presliding travel \[rad\], and the weight of the predicted acceleration of a joint that has moved further: an
/// obstacle is then as likely as a stuck encoder.
const PRESLIDING_RAD: f64 = 1e-3;
const MOVED_SHARE: f64 = 0.75;
/// Fraction of the dry friction below which a ramp may leave a fine encoder unchanged. At this torque presliding has moved
/// the joint by two counts or more.
const UNSEEN_FRICTION_SHARE: f64 = 0.4;
/// Upper bound of an encoder's resolution step, used until the encoder has changed \[rad\].
const MAX_RESOLUTION_RAD: f64 = 1e-3;
/// Change of an angle below which it counts as unchanged \[rad\].
const NO_CHANGE_RAD: f64 = 1e-10;

/// History of the encoders. Arrays have one element per encoder, unless stated otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct StuckEncoders<const N: usize> {
    /// Last angle of each joint \[rad\].
    measured_rad: Vector<N>,
    /// Angle of each encoder now, and at the last change of activity \[rad\].
    angle_rad: Vector<N>,
    begin_rad: Vector<N>,
    /// Last change of the angle, and smallest one so far \[rad\].
    change_rad: [f64; N],
    min_change_rad: [f64; N],
    /// Whether the angle is unchanged since the last cycle.
    unchanged: [bool; N],
    /// Speed at the last change \[rad/s\], and time since then \[s\].
    speed_rad_per_s: [f64; N],
    unchanged_s: [f64; N],
    /// External torque on the motor when the encoder stopped \[N m\], and time for which the torque has since exceeded what
    /// friction holds \[s\].
    external_nm: [f64; N],
    loaded_s: [f64; N],
    /// Travel of the reference since the last change \[rad\].
    travel_rad: [f64; N],
    /// Speed that the ramped joint would have reached according to the model since one of its encoders last changed \[rad/s\].
    ramp_speed_rad_per_s: f64,
    /// Torque of the ramp when an encoder of the joint last changed \[N m\].
    ramp_nm: f64,
    /// Velocities of the joints in the last cycle \[rad/s\].
    last_velocity_rad_per_s: Vector<N>,
    /// Cycles of the present contact in which an encoder has changed.
    contact_cycles: u32,
    /// Cycles of the last contact in which the encoder has changed; zero once it has changed after that contact.
    moved_cycles: [u32; N],
    /// Whether contact is latched, or any of them is not zero.
    has_moved: bool,
}

/// Effect of one resolution step of an encoder on the observed torque of its motor.
pub(super) struct EncoderStepEffect {
    /// Observed torque per step angle \[N m/rad\].
    pub nm_per_rad: f64,
    /// Time for which the step affects the observed torque \[s\].
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
            ramp_speed_rad_per_s: 0.0,
            ramp_nm: 0.0,
            last_velocity_rad_per_s: Vector::zeros(),
            contact_cycles: 0,
            moved_cycles: [0; N],
            has_moved: false,
        }
    }
}

impl<const N: usize> StuckEncoders<N> {
    /// Returns the last measured angles of the joints \[rad\].
    pub fn measured_rad(&self) -> Vector<N> {
        self.measured_rad
    }

    /// Adds the joint angles of a cycle \[rad\]; where a reply is missing, the caller passes the last angle.
    #[inline(always)]
    pub fn receive(&mut self, encoders: &Encoders<N>, measured_rad: &Vector<N>) {
        self.measured_rad = *measured_rad;
        let angle_rad = encoders.values_of(measured_rad);
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

    /// Returns the resolution step of each joint angle \[rad\]: the smallest change observed so far, at most
    /// [`MAX_RESOLUTION_RAD`].
    pub fn resolution_rad(&self, encoders: &Encoders<N>) -> Vector<N> {
        Vector::from_fn(|joint, _| {
            let changes = encoders.of(joint).map(|of| self.min_change_rad[of]);
            changes.fold(0.0, f64::max).min(MAX_RESOLUTION_RAD)
        })
    }

    /// Returns `limit_nm`, or more if the encoder has changed in the last contact and rests since.
    #[cold]
    #[inline(never)]
    fn limit_in_contact_nm(&self, encoder: usize, limit_nm: f64) -> f64 {
        match self.moved_cycles[encoder] >= CONTACT_CYCLES {
            true => CONTACT_LIMIT_FACTOR * limit_nm,
            false => limit_nm,
        }
    }

    /// Adds a cycle to `loaded_s` if the external torque, which exceeds the limit, has grown by more than the limit since the
    /// encoder stopped; otherwise resets that time.
    #[cold]
    #[inline(never)]
    fn add_load(
        &mut self,
        encoder: usize,
        torque_nm: f64,
        limit_nm: f64,
        step: &impl Fn(usize) -> EncoderStepEffect,
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
                // The last step no longer affects the observed torque: remove its effect from the torque at the stop.
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

    /// Returns the resolution step of an encoder \[rad\]: its smallest change, or zero if every change exceeded
    /// [`MAX_RESOLUTION_RAD`].
    fn step_rad(&self, encoder: usize) -> f64 {
        let change_rad = self.min_change_rad[encoder];
        if change_rad <= MAX_RESOLUTION_RAD {
            change_rad
        } else {
            0.0
        }
    }

    /// Returns whether any encoder is unchanged since the last cycle.
    pub fn any_unchanged(&self) -> bool {
        self.unchanged.contains(&true)
    }

    /// Returns whether any encoder of a joint is unchanged since the last cycle.
    pub fn any_unchanged_of(&self, encoders: &Encoders<N>, joint: usize) -> bool {
        encoders.of(joint).any(|encoder| self.unchanged[encoder])
    }

    /// Returns whether all encoders are unchanged since the last cycle.
    pub fn all_unchanged(&self) -> bool {
        !self.unchanged.contains(&false)
    }

    /// Resets the travel of the references and the ramp speed when an activity begins.
    pub fn begin(&mut self) {
        self.begin_rad = self.angle_rad;
        self.travel_rad = [0.0; N];
        self.ramp_speed_rad_per_s = 0.0;
        self.ramp_nm = 0.0;
    }

    /// Skips the checks in this cycle, so that a motion that ends now does not count as a sudden stop.
    pub fn suspend(&mut self) {
        self.last_velocity_rad_per_s = Vector::zeros();
        self.speed_rad_per_s = [0.0; N];
        self.unchanged_s = [0.0; N];
    }

    /// Returns the speed \[rad/s\] to which a breakaway ramp of `ramp_nm` \[N m\] would have accelerated `joint` since its
    /// encoders last changed, according to the model. Friction at rest holds a fraction of `dry_nm` \[N m\], or the ramp torque
    /// at the last change if that is larger. Returns zero if an encoder is too coarse to resolve presliding: if the model
    /// underestimates the friction, a working encoder would look stuck.
    pub fn ramp_speed_rad_per_s(
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
            self.ramp_speed_rad_per_s += share * excess_nm.max(0.0) / inertia_kg_m2 * elapsed_s;
        } else {
            self.ramp_speed_rad_per_s = 0.0;
            self.ramp_nm = abs(ramp_nm);
        }
        self.ramp_speed_rad_per_s
    }

    /// Reports an encoder as stuck if it moved and stops changing from one cycle to the next, faster than friction can stop it.
    /// `max_rad_per_s` are the speed limits of the joints, `friction_rad_per_s2` is the deceleration by friction at most, `lag_s` the lag of
    /// the estimated velocity.
    pub fn check_sudden_stop(
        &mut self,
        encoders: &Encoders<N>,
        plausible: &PlausibilityLimits,
        velocity_rad_per_s: &Vector<N>,
        max_rad_per_s: &Vector<N>,
        friction_rad_per_s2: impl Fn(usize) -> f64,
        [lag_s, elapsed_s]: [f64; 2],
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
                let speed_rad_per_s = encoders.value_at(encoder, &last_rad_per_s);
                self.speed_rad_per_s[encoder] = abs(speed_rad_per_s);
            }
            self.unchanged_s[encoder] += elapsed_s;
            let joint = encoders.joint(encoder);
            let value_rad = self.speed_rad_per_s[encoder] * self.unchanged_s[encoder];
            let fast_rad_per_s = MOVING_SHARE * max_rad_per_s[joint];
            if value_rad > SUDDEN_STOP_TRAVEL_SHARE * limit_rad
                && let Some(share) = self.stop_limit_share(
                    encoder,
                    fast_rad_per_s,
                    friction_rad_per_s2(encoder) * (FRICTION_STOP_CYCLES * elapsed_s + lag_s),
                    elapsed_s,
                )
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

    /// Returns the fraction of the travel limit after which an unchanged encoder counts as stuck:
    /// [`SUDDEN_STOP_TRAVEL_SHARE`] if it moved at full speed in the cycle before it stopped, one if it was fast, else `None`. A
    /// light joint may lose `friction_rad_per_s` by friction meanwhile.
    #[inline(never)]
    fn stop_limit_share(
        &self,
        encoder: usize,
        fast_rad_per_s: f64,
        friction_rad_per_s: f64,
        elapsed_s: f64,
    ) -> Option<f64> {
        let speed_rad_per_s = self.speed_rad_per_s[encoder];
        let travel_rad = speed_rad_per_s * elapsed_s;
        let sudden = self.unchanged_s[encoder] > SUDDEN_STOP_S
            && self.change_rad[encoder] > FULL_SPEED_SHARE * travel_rad
            && travel_rad > SUDDEN_STOP_COUNTS * self.min_change_rad[encoder]
            && speed_rad_per_s > SUDDEN_STOP_SPEED_SHARE * fast_rad_per_s
            && speed_rad_per_s > friction_rad_per_s;
        match sudden {
            true => Some(SUDDEN_STOP_TRAVEL_SHARE),
            false => (speed_rad_per_s > fast_rad_per_s).then_some(1.0),
        }
    }

    /// Reports an encoder as stuck if it is unchanged although, for [`LOADED_LIMIT_S`], the external torque on its motor has
    /// grown by more than `stiction_limit_nm`, the torque that dry friction holds. The torque at the time of the stop does not
    /// count, since an obstacle may cause it; neither does the effect of the encoder's last step on the observed torque. Call it
    /// after [`StuckEncoders::check_sudden_stop`] of the same cycle.
    #[inline(never)]
    pub fn check_torque(
        &mut self,
        encoders: &Encoders<N>,
        plausible: &PlausibilityLimits,
        external_nm: &Vector<N>,
        stiction_limit_nm: &Vector<N>,
        step: impl Fn(usize) -> EncoderStepEffect,
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
            if abs(torque_nm) <= stiction_limit_nm[encoder] {
                self.loaded_s[encoder] = 0.0;
                continue;
            }
            let limit_nm = self.limit_in_contact_nm(encoder, stiction_limit_nm[encoder]);
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

    /// Turns a joint collision into a stuck encoder if no encoder of the joint has changed for [`UNCHANGED_LIMIT_S`]: both
    /// causes are equally likely, and gravity compensation from a wrong angle would not hold the arm.
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

    /// Returns whether the latched contact is plausible: encoders have changed in [`CONTACT_CYCLES`] of its cycles.
    #[inline]
    pub fn is_contact_plausible(&mut self, in_contact: bool) -> bool {
        (in_contact || self.has_moved) && self.count_moved(in_contact)
    }

    /// Counts the cycles of the contact in which encoders change. After the contact resets the count of an encoder that changes: the
    /// latch opens before the arm leaves the obstacle, so that an encoder that has not changed since is still held.
    #[cold]
    #[inline(never)]
    fn count_moved(&mut self, in_contact: bool) -> bool {
        if in_contact && !self.all_unchanged() {
            self.contact_cycles = self.contact_cycles.saturating_add(1);
        } else if !in_contact {
            self.contact_cycles = 0;
        }
        for (cycles, unchanged) in self.moved_cycles.iter_mut().zip(&self.unchanged) {
            *cycles = match (in_contact, unchanged) {
                (_, true) => *cycles,
                (true, false) => cycles.saturating_add(1),
                (false, false) => 0,
            };
        }
        self.has_moved = in_contact || self.moved_cycles.iter().any(|cycles| *cycles > 0);
        self.contact_cycles >= CONTACT_CYCLES
    }

    /// Reports an encoder as stuck if it is unchanged while its reference moves away by more than `stuck_rad`, or by more than a
    /// fraction of it in modes with joint references (`joint_reference`).
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
        let reference_rad_per_s = encoders.values_of(reference_rad_per_s);
        for encoder in 0..N {
            if !self.unchanged[encoder] {
                continue;
            }
            self.travel_rad[encoder] += reference_rad_per_s[encoder] * elapsed_s;
            let value_rad = abs(self.travel_rad[encoder]);
            let share = match joint_reference {
                true if self.min_change_rad[encoder] < FINE_ENCODER_RAD => FINE_STUCK_SHARE,
                true if self.all_unchanged() => ALL_STUCK_SHARE,
                _ => 1.0,
            };
            let limit_rad = share * plausible.stuck_rad;
            if value_rad > limit_rad {
                return Err(Fault::EncoderStuck {
                    joint: encoders.joint(encoder),
                    value_rad,
                    limit_rad,
                });
            }
        }
        Ok(())
    }
}
