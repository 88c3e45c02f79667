//! State of a controller between cycles.

use super::Controller;
use super::activity::Activity;
use super::fault::{Fault, SafeAction};
use super::gain_ramp::GainRamp;
use super::handover::{Handover, HandoverFrom, REPEATED_CYCLES};
use super::measured_direction::MeasuredDirection;
use super::mode::Mode;
use super::oscillation::Oscillation;
use super::output::Input;
use super::plausibility::Plausibility;
use super::pose_gains::PoseGainRamps;
use super::position_limits::PositionLimits;
use super::stopping_motion::StoppingMotion;
use super::stuck_encoder::StuckEncoders;
use crate::config::{Config, Gains, JointGains, Role};
use crate::controller::estimator::{Estimator, EstimatorGains};
use crate::controller::latch::Latch;
use crate::controller::learned_ramp::Learned;
use crate::controller::observer::MomentumObserver;
use crate::dynamics::Terms;
use crate::math::{Vector, abs, all_finite};
use crate::model::friction::Friction;

/// Speed at which the set-point of a held joint approaches its angle \[rad/s\].
const HELD_APPROACH_RAD_PER_S: f64 = 0.25;

/// Plausible deviation of an angle from its prediction, as a multiple of the joint's speed limit:
/// far above what a joint can move in a cycle, far below the error of a corrupted reply.
const JUMP_OVER_SPEED_LIMIT: f64 = 20.0;

/// The complete variable state of a controller. [`State::new`] is idle and has received no arm
/// state.
#[derive(Clone, Copy, Debug)]
pub struct State<const N: usize> {
    pub(super) activity: Activity<N>,
    pub(super) activity_start: u64,
    /// Cycle number of the last arm state; `None` before the first.
    pub(super) cycle: Option<u64>,
    /// Cycles since then in which no new state arrived.
    pub(super) stale: u32,
    /// Consecutive lost replies of each encoder.
    pub(super) missing: [u32; N],
    /// Angles of the links: those of the encoders less the elastic deflection.
    pub(super) position: Vector<N>,
    /// Deflection of the joints' compliance under gravity \[rad\].
    pub(super) elastic_deflection_rad: Vector<N>,
    pub(super) estimator: Estimator<N>,
    pub(super) observer: MomentumObserver<N>,
    pub(super) latch: Latch,
    /// Joint velocities of the reference when contact was latched \[rad/s\].
    pub(super) contact_velocity_rad_per_s: Vector<N>,
    /// Friction of the joints under their present load.
    pub(super) friction: [Friction; N],
    /// Joint velocities at which the Stribeck effect is evaluated if the law measures them \[rad/s\].
    pub(super) stribeck_velocity_rad_per_s: Vector<N>,
    /// Direction of the dry friction to feed forward; `None`: the direction of the velocity.
    pub(super) dry_direction: Option<Vector<N>>,
    /// Joint velocities of the reference for a tip at its reference, where presliding is known \[rad/s\].
    pub(super) velocity_at_reference_rad_per_s: Option<Vector<N>>,
    /// Direction of the dry friction according to the measured motion.
    pub(super) measured_direction: MeasuredDirection<N>,
    pub(super) gains: GainRamp<Gains>,
    pub(super) joint_gains: GainRamp<JointGains<N>>,
    pub(super) pose_gains: PoseGainRamps,
    pub(super) position_limits: PositionLimits<N>,
    /// Set-points of held joints.
    pub(super) held_setpoint_rad: Vector<N>,
    /// Whether gravity hold keeps the pose, see [`Config::hold_pose`].
    hold_pose: bool,
    /// Whether there are position loops outside the modes that move joints.
    pub(super) has_held_loops: bool,
    /// Last torque sent \[N m\].
    pub(super) torque: Vector<N>,
    /// Part of the last torque that cancels the ripple of the motors, and so does not reach the links \[N m\].
    pub(super) ripple: Vector<N>,
    /// Last fallback torque sent \[N m\].
    pub(super) fallback: Vector<N>,
    pub(super) handover: Handover<N>,
    pub(super) fault: Option<Fault>,
    pub(super) terms: Terms<N>,
    /// Whether the motors apply torques.
    pub(super) drives_active: bool,
    /// Cycle in which the drives became active last.
    activated_cycle: u64,
    /// First and last of consecutive cycles in which a collision threshold was exceeded.
    pub(super) exceeded_cycles: (u64, u64),
    pub(super) plausibility: Plausibility<N>,
    pub(super) stuck_encoders: StuckEncoders<N>,
    pub(super) oscillation: Oscillation<N>,
    /// Recent peak of the kinetic energy, with decay; in a fault the peak before it \[J\].
    pub(super) peak_energy_j: f64,
    pub(super) stopping_motion: StoppingMotion<N>,
    /// Time for which large external torques have acted while the arm follows a reference \[s\].
    pub(super) large_torque_s: f64,
    /// Learned parameters of the model.
    pub(super) learned: Learned<N>,
}

impl<const N: usize> State<N> {
    /// Returns the idle state before the first cycle.
    pub fn new(controller: &Controller<N>) -> Self {
        let config = controller.config();
        State {
            activity: Activity::Idle,
            activity_start: 0,
            cycle: None,
            stale: 0,
            missing: [0; N],
            position: Vector::zeros(),
            elastic_deflection_rad: Vector::zeros(),
            estimator: Estimator::at_rest(Vector::zeros()),
            observer: MomentumObserver::default(),
            latch: Latch::new(&config.latch, config.estimator_rad_per_s),
            contact_velocity_rad_per_s: Vector::zeros(),
            friction: config.friction,
            stribeck_velocity_rad_per_s: Vector::zeros(),
            dry_direction: None,
            velocity_at_reference_rad_per_s: None,
            measured_direction: MeasuredDirection::unknown(),
            gains: GainRamp::at_rest(config.law.gains),
            joint_gains: GainRamp::at_rest(config.joint_gains),
            pose_gains: PoseGainRamps::at_rest(&config.law.gains, &config.pose.gains),
            position_limits: PositionLimits::new(&config.limits),
            held_setpoint_rad: Vector::zeros(),
            hold_pose: config.hold_pose,
            has_held_loops: config.hold_pose
                || config.roles.iter().any(|role| *role != Role::Active),
            torque: Vector::zeros(),
            ripple: Vector::zeros(),
            fallback: Vector::zeros(),
            handover: Handover::none(),
            fault: None,
            terms: Terms::default(),
            drives_active: false,
            activated_cycle: 0,
            exceeded_cycles: (0, 0),
            plausibility: Plausibility::default(),
            stuck_encoders: StuckEncoders::default(),
            oscillation: Oscillation::default(),
            peak_energy_j: 0.0,
            stopping_motion: StoppingMotion::new(0.0, false),
            large_torque_s: 0.0,
            learned: Learned::new(&config.learned),
        }
    }

    /// Returns the current mode.
    pub fn mode(&self) -> Mode {
        self.activity.mode()
    }

    /// Returns the latched fault.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Returns the current safe action, if in a fault.
    pub fn safe_action(&self) -> Option<SafeAction> {
        match self.activity {
            Activity::Fault(action) => Some(action),
            _ => None,
        }
    }

    /// Receives an arm state. Returns the time since the last one \[s\]; zero if it is a repetition.
    pub(super) fn receive(
        &mut self,
        controller: &Controller<N>,
        input: &Input<N>,
    ) -> Result<f64, Fault> {
        let config = controller.config();
        let limit = config.limits.stale_cycles;
        let out_of_order = match self.cycle {
            Some(last) if input.cycle < last => {
                // The plant was restarted: reinitialise from its state, but report a fault. The activity continues.
                let activity_cycles = last.wrapping_sub(self.activity_start);
                self.activity_start = input.cycle.wrapping_sub(activity_cycles);
                self.cycle = None;
                let received = input.cycle;
                Some(Fault::StateOutOfOrder { last, received })
            }
            _ => None,
        };
        let force = match input.tip_force_n {
            Some(force) if !all_finite(&force) => Err(Fault::MeasurementNotFinite { joint: None }),
            _ => Ok(()),
        };
        let periods = self.cycle.map_or(0, |last| input.cycle - last);
        if self.cycle.is_some() && periods == 0 {
            self.stale = self.stale.saturating_add(1);
            if self.stale > limit {
                let cycles = u64::from(self.stale);
                return Err(Fault::StateStale { cycles, limit });
            }
            return force.map(|()| 0.0);
        }
        let gains = controller.estimator_gains(periods);
        let elapsed_s = gains.elapsed_s();
        self.receive_positions(controller, &input.position_rad, &gains)?;
        if controller.has_compliance() {
            self.subtract_elastic_deflection(config);
        }
        self.cycle = Some(input.cycle);
        self.stale = 0;
        if let Some(fault) = out_of_order {
            return Err(fault);
        }
        if periods > u64::from(limit) + 1 {
            let cycles = periods - 1;
            return Err(Fault::StateStale { cycles, limit });
        }
        force.map(|()| elapsed_s)
    }

    /// Updates the estimator with the positions. After the first state, a single lost reply is
    /// bridged by prediction.
    fn receive_positions(
        &mut self,
        controller: &Controller<N>,
        measured_rad: &[Option<f64>; N],
        gains: &EstimatorGains,
    ) -> Result<(), Fault> {
        let config = controller.config();
        let elapsed_s = gains.elapsed_s();
        let first = self.cycle.is_none();
        let mut q = self.stuck_encoders.measured_rad();
        let mut all = true;
        for (joint, measured) in measured_rad.iter().enumerate() {
            match *measured {
                Some(position) => q[joint] = position,
                None => all = false,
            }
        }
        if all && all_finite(&q) {
            self.missing = [0; N];
        } else {
            self.count_missing_replies(measured_rad, if first { 0 } else { 1 })?;
        }
        let plausible = &config.plausible;
        self.plausibility
            .check_replies(plausible, measured_rad, all)?;
        self.stuck_encoders.receive(controller.encoders(), &q);
        if first {
            self.position = q;
            self.estimator = Estimator::at_rest(self.position);
            return Ok(());
        }
        let velocity = self.estimator.velocity_rad_per_s;
        let expected = self.position + self.elastic_deflection_rad + velocity * elapsed_s;
        let allowed_s = JUMP_OVER_SPEED_LIMIT * elapsed_s;
        for (joint, measured) in measured_rad.iter().enumerate() {
            let limit_rad = config.limits.joint_speed_rad_per_s[joint] * allowed_s;
            let value_rad = abs(q[joint] - expected[joint]);
            if value_rad > limit_rad && measured.is_some() {
                return Err(Fault::EncoderJump {
                    joint,
                    value_rad,
                    limit_rad,
                });
            }
        }
        if all {
            self.estimator.update_all(&q, gains);
            self.position = q;
            return Ok(());
        }
        self.estimator.update(measured_rad, gains);
        for (joint, position) in measured_rad.iter().enumerate() {
            self.position[joint] = position.unwrap_or(self.estimator.position_rad[joint]);
        }
        Ok(())
    }

    /// Counts missing positions, and rejects one that is not finite or has been missing for more than the tolerated cycles.
    #[inline(never)]
    fn count_missing_replies(
        &mut self,
        measured_rad: &[Option<f64>; N],
        tolerated: u32,
    ) -> Result<(), Fault> {
        for (joint, position) in measured_rad.iter().enumerate() {
            match position {
                Some(position) if position.is_finite() => self.missing[joint] = 0,
                Some(_) => return Err(Fault::MeasurementNotFinite { joint: Some(joint) }),
                None => self.missing[joint] = self.missing[joint].saturating_add(1),
            }
            if self.missing[joint] > tolerated {
                return Err(Fault::EncoderLost { joint });
            }
        }
        Ok(())
    }

    /// Subtracts the elastic deflection under gravity at the last angles, which gives the angles of the links.
    #[inline(never)]
    fn subtract_elastic_deflection(&mut self, config: &Config<N>) {
        self.elastic_deflection_rad = config
            .compliance_rad_per_nm
            .component_mul(&self.terms.gravity);
        self.position -= self.elastic_deflection_rad;
    }

    /// Updates the friction of each joint for the gravity load on its gear, which is nearly all of the load in slow motion.
    #[inline(never)]
    pub(super) fn update_friction(&mut self, config: &Config<N>) {
        for (i, friction) in config.friction.iter().enumerate() {
            self.friction[i] = friction.at_load(self.terms.gravity[i]);
        }
    }

    /// Latches a fault. The first fault is kept; the safe action can only change from gravity hold
    /// to idle, and an arm without torque stays without torque.
    #[cold]
    #[inline(never)]
    pub(super) fn latch_fault(&mut self, controller: &Controller<N>, fault: Fault) {
        match self.activity {
            // `stop.rs` supervises the stop.
            Activity::Fault(_) if fault.safe_action() == SafeAction::Brake => {
                self.activity = Activity::Fault(SafeAction::Brake);
            }
            Activity::Fault(_) => {}
            _ => {
                let action = self.action_of(controller, &fault);
                self.stopping_motion =
                    StoppingMotion::new(self.peak_energy_j, self.follows_reference());
                self.fault = Some(fault);
                self.enter(Activity::Fault(action));
                self.handover = Handover::none();
            }
        }
    }

    /// Starts an activity; the present torque, if any, will be blended out.
    pub(super) fn enter(&mut self, activity: Activity<N>) {
        let loops_continue = self.hold_pose && self.activity.has_joint_loops();
        if self.held_loops_inactive() && !loops_continue {
            self.held_setpoint_rad = self.position;
        }
        let has_torque = !self.activity.is_torque_off() && !activity.is_torque_off();
        match (has_torque, &self.activity) {
            (false, _) => self.handover = Handover::none(),
            (true, Activity::Fault(_)) => self.handover.begin(HandoverFrom::Stopping),
            (true, before)
                if before.mode() == activity.mode() && self.activity_cycles() < REPEATED_CYCLES =>
            {
                self.handover.begin(HandoverFrom::SameMode);
            }
            (true, _) => self.handover.begin(HandoverFrom::LastTorque),
        }
        self.activity = activity;
        self.activity_start = self.cycle.unwrap_or(0);
        self.latch = self.latch.restarted();
        self.plausibility.begin();
        self.stuck_encoders.begin();
        self.large_torque_s = 0.0;
    }

    /// Replaces every activity with torque by gravity hold while the drives are idle; when they
    /// become active again, gravity hold restarts from the gravity torque alone.
    pub(super) fn update_drives(&mut self, active: bool) {
        let reactivated = active && !self.drives_active;
        self.drives_active = active;
        if reactivated {
            self.activated_cycle = self.cycle.unwrap_or(0);
        }
        match self.activity {
            Activity::Idle | Activity::Fault(_) => {}
            Activity::GravityHold if !reactivated => {}
            Activity::GravityHold => self.enter(Activity::GravityHold),
            _ if !active => self.enter(Activity::GravityHold),
            _ => {}
        }
        if !active {
            // Otherwise the remainder of another activity's torque would act when the drives become
            // active again.
            self.handover = Handover::none();
        }
    }

    /// Returns the time since the activity began \[s\].
    pub(super) fn activity_s(&self, config: &Config<N>) -> f64 {
        self.activity_cycles() as f64 * config.period_s
    }

    fn activity_cycles(&self) -> u64 {
        self.cycle
            .map_or(0, |cycle| cycle.wrapping_sub(self.activity_start))
    }

    /// Returns whether the drives became active within this time \[s\].
    pub(super) fn activated_within(&self, config: &Config<N>, time_s: f64) -> bool {
        let cycles = self
            .cycle
            .map_or(0, |cycle| cycle.wrapping_sub(self.activated_cycle));
        cycles as f64 * config.period_s < time_s
    }

    /// Returns whether the last state is older than tolerated, so that only gravity may still be computed from
    /// it.
    pub(super) fn is_stale(&self, config: &Config<N>) -> bool {
        self.stale > config.limits.stale_cycles
    }

    /// Returns whether the position loops of held joints are off.
    fn held_loops_inactive(&self) -> bool {
        let in_fault = matches!(self.activity, Activity::Fault(_));
        let has_own = self.activity.has_joint_loops();
        !self.drives_active || self.activity.is_torque_off() || has_own || in_fault
    }

    /// Returns whether position loops keep every joint in gravity hold.
    pub(super) fn holds_pose(&self) -> bool {
        let holding = matches!(self.activity, Activity::GravityHold);
        self.hold_pose && self.drives_active && holding
    }

    /// Moves the set-points of held joints towards their configured angles at a limited speed.
    /// While the loops are off, the set-points follow the joints, so that the loops engage without
    /// a jump. If gravity hold keeps the pose, the set-points follow those of the other modes' loops.
    pub(super) fn update_held_setpoints(&mut self, controller: &Controller<N>, elapsed_s: f64) {
        if !self.has_held_loops {
            return;
        }
        let config = controller.config();
        let free = self.held_loops_inactive();
        let step = HELD_APPROACH_RAD_PER_S * elapsed_s;
        if config.hold_pose
            && let Some(setpoint_rad) = self.pose_to_hold_rad(controller)
        {
            self.held_setpoint_rad = setpoint_rad;
            return;
        }
        for (joint, role) in config.roles.iter().enumerate() {
            let is_held = *role != Role::Active;
            if free || self.hold_pose && !is_held {
                self.held_setpoint_rad[joint] = self.position[joint];
            } else if let Role::Held { position_rad, .. } = role {
                self.held_setpoint_rad[joint] +=
                    (position_rad - self.held_setpoint_rad[joint]).clamp(-step, step);
            }
        }
    }
}
