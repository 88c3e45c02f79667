//! Checks of a cycle: motion against its limits, observed external torque and force against their thresholds.

use super::Controller;
use super::activity::Activity;
use super::checks;
use super::checks::COMPLIANT_SPEED_SHARE;
use super::fault::Fault;
use super::latch::LatchInput;
use super::oscillation::Oscillation;
use super::plausibility::{
    JointMotion, PlausibilityInput, check_joint_collision, check_tip_collision, is_falling_away,
};
use super::pose_task::PoseCycle;
use super::position_limits::PositionLimits;
use super::state::State;
use super::stuck_encoder::EncoderStepEffect;
use crate::config::Config;
use crate::law::impedance::{SINGULAR_BELOW_M, Task};
use crate::law::learned::LearnedAtPose;
use crate::math::{Vector, Vector3, abs};
use crate::model::workspace::WorkspaceViolation;
use crate::trajectory::Reference;

/// Time for which an elastic arm oscillates after its drives have become active \[s\]. A motor then accelerates without its
/// link, and the observer reports an external torque of up to twice the gravity torque.
const ACTIVATION_S: f64 = 0.05;
/// Factor of the collision thresholds within this time.
const ACTIVATION_RATIO: f64 = 2.0;
/// Maximum time for which such an oscillation exceeds the thresholds \[s\]. A longer excess is a collision.
const SWING_S: f64 = 0.008;

/// Returns whether the pose is regular, so that the tip force can be estimated from the joint torques.
fn is_regular<const N: usize>(task: &Task<N>) -> bool {
    task.min_singular_value_m >= SINGULAR_BELOW_M
}

impl<const N: usize> State<N> {
    /// Tightens relaxed position limits step by step until they are those of the configuration again.
    #[inline(always)]
    pub(super) fn update_position_limits(&mut self, config: &Config<N>, elapsed_s: f64) {
        if self.position_limits.relaxed {
            self.restore_position_limits(config, elapsed_s);
        }
    }

    #[cold]
    #[inline(never)]
    fn restore_position_limits(&mut self, config: &Config<N>, elapsed_s: f64) {
        let tip_m = &self.terms.base_from_tip.translation;
        self.position_limits.restore(
            &config.limits,
            &config.workspace,
            &self.position,
            tip_m,
            elapsed_s,
        );
        if self.holds_pose() {
            let limits = &self.position_limits;
            self.held_setpoint_rad = self
                .held_setpoint_rad
                .sup(&limits.soft_lower_rad)
                .inf(&limits.soft_upper_rad);
        }
    }

    /// Relaxes the position limits so that they contain the present pose. Called in every cycle in which the limits do not
    /// apply: with idle drives, without torque, in a fault.
    #[cold]
    #[inline(never)]
    pub(super) fn relax_position_limits(&mut self, config: &Config<N>) {
        let tip_m = &self.terms.base_from_tip.translation;
        self.position_limits = PositionLimits::around(
            &config.limits,
            &config.workspace,
            &self.position,
            &self.estimator.velocity_rad_per_s,
            tip_m,
        );
    }

    #[inline(always)]
    pub(super) fn check(
        &self,
        config: &Config<N>,
        tip_velocity: &Vector3<f64>,
        reference: Option<&Reference>,
    ) -> Result<(), Fault> {
        if self.activity.is_torque_off() || !self.drives_active {
            return Ok(());
        }
        let velocity = &self.estimator.velocity_rad_per_s;
        let speed_share = match self.activity {
            Activity::Float | Activity::JointImpedance { .. } => COMPLIANT_SPEED_SHARE,
            _ => 1.0,
        };
        checks::motion(
            &config.limits,
            &self.position_limits,
            speed_share,
            &self.position,
            velocity,
            tip_velocity,
        )?;
        if self.has_held_loops || self.activity.has_joint_loops() {
            let joint_setpoints = self.joint_setpoints(config);
            checks::joint_tracking(&config.limits, &joint_setpoints, &self.position)?;
        }
        match reference {
            Some(reference) => {
                let error = reference.position - self.terms.base_from_tip.translation;
                checks::tracking(config.limits.tracking_error_m, &error)
            }
            None => Ok(()),
        }
    }

    /// Estimates the external torque and tip force, updates the contact latch, and runs the
    /// plausibility and collision checks. Returns the force also with a fault.
    #[inline(always)]
    pub(super) fn observe(
        &mut self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        pose: Option<&PoseCycle<N>>,
        learned: Option<&LearnedAtPose<N>>,
        elapsed_s: f64,
    ) -> Result<Vector3<f64>, (Vector3<f64>, Fault)> {
        let config = controller.config();
        if self.activity.is_torque_off() || !self.drives_active {
            // Braking motors produce torques that the model does not contain, so the observer is
            // reset.
            self.observer.reset();
            self.plausibility.suspend(&self.terms.momentum);
            self.stuck_encoders.suspend();
            self.oscillation = Oscillation::default();
            self.relax_position_limits(config);
            return Ok(Vector3::zeros());
        }
        let mut net_torque = Vector::zeros();
        if elapsed_s > 0.0 {
            let velocity = &self.estimator.velocity_rad_per_s;
            let friction: Vector<N> =
                Vector::from_fn(|i, _| self.friction[i].torque_nm(velocity[i]));
            let (torque, learned) = self.learned_in_observer(learned);
            net_torque =
                torque + self.terms.kinetic_gradient - self.terms.gravity - friction - learned;
            let bandwidth = config.latch.observer_rad_per_s;
            self.observer
                .update(&self.terms.momentum, &net_torque, elapsed_s, bandwidth);
        }
        let external = self.observer.external_torque_nm();
        let Some(task) = task else {
            return Ok(Vector3::zeros());
        };
        let force = task.inverse.tr_mul(&external);
        let mut reference_rad_per_s = Vector::zeros();
        let mut tip_falls = false;
        if let Some(reference) = self.joint_reference(config) {
            reference_rad_per_s = reference.velocity_rad_per_s;
            self.set_ramp_reference_speed(controller, &mut reference_rad_per_s, elapsed_s);
        }
        if let Some(reference) = reference {
            self.latch.update_direction(&reference.velocity, elapsed_s);
            let along = task.inverse * self.latch.direction();
            let velocity = match pose {
                Some(pose) => pose.joint_velocity_rad_per_s,
                None => task.inverse * reference.velocity,
            };
            let friction_uncertainty_n = (0..N)
                .map(|i| {
                    let friction = &self.friction[i];
                    abs(along[i])
                        * friction.uncertainty_nm(velocity[i], config.latch.friction_error)
                })
                .sum();
            let was_in_contact = self.latch.in_contact();
            let input = LatchInput {
                force_n: force,
                friction_uncertainty_n,
                tip_velocity_m_per_s: self.terms.tip_velocity(&self.estimator.velocity_rad_per_s),
            };
            self.latch.update_contact(&config.latch, &input, elapsed_s);
            let gravity = config.arm.gravity();
            if force.dot(&gravity) > controller.load_n_m_per_s2() {
                let away_m_per_s = input.tip_velocity_m_per_s - reference.velocity;
                tip_falls = is_falling_away(&away_m_per_s, &gravity);
            }
            if self.latch.in_contact() && !was_in_contact {
                self.contact_velocity_rad_per_s = velocity;
            }
            reference_rad_per_s = velocity;
        } else if self.is_resting(&reference_rad_per_s) && is_regular(task) {
            self.latch.observe_at_rest(&config.latch, &force, elapsed_s);
        }
        let input = PlausibilityInput {
            reference_rad_per_s: &reference_rad_per_s,
            net_torque_nm: &net_torque,
            force_n: &force,
            is_falling_away: tip_falls,
            pose_is_regular: is_regular(task),
            elapsed_s,
        };
        match self.check_plausibility(controller, &input) {
            Ok(()) => Ok(force),
            Err(fault) => Err((force, fault)),
        }
    }

    /// Sets the reference speed of a ramped joint to the speed that the breakaway ramp would cause according to the model.
    #[inline(never)]
    fn set_ramp_reference_speed(
        &mut self,
        controller: &Controller<N>,
        reference_rad_per_s: &mut Vector<N>,
        elapsed_s: f64,
    ) {
        let Activity::Breakaway { ramp, .. } = &self.activity else {
            return;
        };
        let (config, joint) = (controller.config(), ramp.joint);
        let ramp_nm = ramp.rate_nm_per_s * self.activity_s(config);
        let dry_nm = self.friction[joint].dry_size_nm(0.0);
        let inertia_kg_m2 = self.terms.mass_matrix[(joint, joint)];
        reference_rad_per_s[joint] = self.stuck_encoders.ramp_speed_rad_per_s(
            controller.encoders(),
            joint,
            ramp_nm,
            dry_nm,
            inertia_kg_m2,
            elapsed_s,
        );
    }

    /// Returns whether the arm is expected to be at rest without being pushed.
    fn is_resting(&self, reference_rad_per_s: &Vector<N>) -> bool {
        matches!(self.activity, Activity::GravityHold | Activity::Move { .. })
            && reference_rad_per_s.iter().all(|speed| *speed == 0.0)
    }

    /// Returns whether the arm holds a pose: in gravity hold, or after the end of a move.
    fn holds_still(&self, config: &Config<N>) -> bool {
        match &self.activity {
            Activity::GravityHold => true,
            Activity::Move { duration_s, .. } => self.activity_s(config) > *duration_s,
            _ => false,
        }
    }

    /// Checks the borders and zones of the workspace.
    pub(super) fn check_workspace(
        &self,
        config: &Config<N>,
        task: Option<&Task<N>>,
        tip_velocity: &Vector3<f64>,
        force_n: &Vector3<f64>,
    ) -> Result<(), Fault> {
        let workspace = &config.workspace;
        if workspace.is_unbounded() || self.activity.is_torque_off() || !self.drives_active {
            return Ok(());
        }
        let tip = self.terms.base_from_tip.translation;
        // Near a singular pose a small external torque maps to a large apparent tip force, so the
        // force is not used.
        let force_n = task
            .filter(|task| is_regular(task))
            .map_or_else(Vector3::zeros, |_| *force_n);
        match workspace.violation(&tip, tip_velocity, &force_n) {
            None => Ok(()),
            Some(violation) => Err(match violation {
                WorkspaceViolation::Border {
                    index,
                    penetration_m,
                } => Fault::Workspace {
                    value_m: penetration_m,
                    border: index,
                },
                WorkspaceViolation::Speed {
                    value_m_per_s,
                    limit_m_per_s,
                } => Fault::ZoneSpeed {
                    value_m_per_s,
                    limit_m_per_s,
                },
                WorkspaceViolation::Force { value_n, limit_n } => {
                    Fault::ZoneForce { value_n, limit_n }
                }
            }),
        }
    }

    /// Repeats the check of a collision with raised thresholds if the drives have just become active and the excess is short;
    /// otherwise returns the fault.
    #[cold]
    #[inline(never)]
    fn recheck_after_activation(
        &mut self,
        config: &Config<N>,
        fault: Fault,
        check: impl FnOnce(f64) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        let cycle = self.cycle.unwrap_or(0);
        let (first, last) = self.exceeded_cycles;
        let continues = cycle.wrapping_sub(last) <= 1;
        let first = if continues { first } else { cycle };
        self.exceeded_cycles = (first, cycle);
        let lasts = cycle.wrapping_sub(first) as f64 * config.period_s > SWING_S;
        match self.activated_within(config, ACTIVATION_S) && !lasts {
            true => check(ACTIVATION_RATIO),
            false => Err(fault),
        }
    }

    /// Runs the plausibility and collision checks of one cycle.
    fn check_plausibility(
        &mut self,
        controller: &Controller<N>,
        input: &PlausibilityInput<'_, N>,
    ) -> Result<(), Fault> {
        let (config, encoders) = (controller.config(), controller.encoders());
        let (plausibility, stuck) = (&mut self.plausibility, &mut self.stuck_encoders);
        if input.elapsed_s > 0.0 {
            let velocity = &self.estimator.velocity_rad_per_s;
            stuck.check_sudden_stop(
                encoders,
                &config.plausible,
                velocity,
                &config.limits.joint_speed_rad_per_s,
                |encoder| {
                    let inertia = encoders.inertia_at(encoder, &self.terms.mass_matrix);
                    controller.stiction_limit_nm()[encoder] / inertia
                },
                [1.0 / config.estimator_rad_per_s, input.elapsed_s],
            )?;
            let external_nm = self.observer.external_torque_nm();
            if stuck.any_unchanged() {
                stuck.check_torque(
                    encoders,
                    &config.plausible,
                    &external_nm,
                    controller.stiction_limit_nm(),
                    |encoder| {
                        let (step, mass_matrix) =
                            (controller.encoder_step(), &self.terms.mass_matrix);
                        EncoderStepEffect {
                            nm_per_rad: encoders.inertia_at(encoder, mass_matrix)
                                * step.observed_per_s2,
                            lasts_s: step.lasts_s,
                        }
                    },
                    input.elapsed_s,
                )?;
            }
            let motion = JointMotion {
                momentum: &self.terms.momentum,
                velocity_rad_per_s: velocity,
                reference_rad_per_s: input.reference_rad_per_s,
            };
            let against = plausibility.check_against_torque(
                controller.against_torque_limits(),
                &motion,
                input.net_torque_nm,
                input.elapsed_s,
            );
            let limits_rad_per_s = &config.limits.joint_speed_rad_per_s;
            let steady = self
                .oscillation
                .check(velocity, limits_rad_per_s, input.elapsed_s);
            // Not checked in a fault: a stopping arm may be pushed back, and `stop.rs` supervises
            // the stop.
            if !matches!(self.activity, Activity::Fault(_)) {
                against?;
                steady?;
            }
            // In contact, joints may be at rest while their references move; at a stiffness of a few newtons per metre, some
            // joints rest while others move. If all encoders are stuck, the observer itself reports a contact; therefore a
            // contact counts only after encoders have changed during it.
            if !stuck.is_contact_plausible(self.latch.in_contact()) {
                let joint_reference = self.activity.has_joint_reference();
                // Of the last cycle; at the measured pose, a joint that the reference does not move would seem to move.
                let at_reference = self.velocity_at_reference_rad_per_s.as_ref();
                stuck.check_reference(
                    encoders,
                    &config.plausible,
                    at_reference.unwrap_or(input.reference_rad_per_s),
                    joint_reference,
                    input.elapsed_s,
                )?;
            }
        }
        let external = self.observer.external_torque_nm();
        let collision = &config.collision;
        let has_loops = self.activity.has_joint_loops() || self.holds_pose();
        let (joint_torque_nm, tip_force_n) = if has_loops {
            (&collision.move_joint_torque_nm, collision.move_tip_force_n)
        } else {
            (&collision.joint_torque_nm, collision.tip_force_n)
        };
        check_joint_collision(joint_torque_nm, &external)
            .or_else(|fault| {
                self.recheck_after_activation(config, fault, |ratio| {
                    check_joint_collision(&(joint_torque_nm * ratio), &external)
                })
            })
            .map_err(|fault| {
                self.stuck_encoders
                    .as_stuck_encoder(&config.plausible, encoders, fault)
            })?;
        if !input.pose_is_regular {
            return Ok(());
        }
        check_tip_collision(tip_force_n, input.force_n).or_else(|fault| {
            self.recheck_after_activation(config, fault, |ratio| {
                check_tip_collision(tip_force_n * ratio, input.force_n)
            })
        })?;
        if input.is_falling_away || self.holds_still(config) {
            let (gravity, limit_n) = (config.arm.gravity(), config.plausible.load_n);
            self.plausibility.check_unmodelled_load(
                input.force_n,
                &gravity,
                limit_n,
                input.elapsed_s,
            )?;
        } else {
            self.plausibility.reset_load();
        }
        Ok(())
    }
}
