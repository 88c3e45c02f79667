//! Learned terms in the controller: requests set them, a ramp brings them into force, and they act as one torque term.
//!
//! The controller does not estimate. A request replaces the target of the ramp; the terms in force approach the target
//! linearly, so that the torque does not jump. The ramp pauses in contact, in faults, without torque and in modes in which
//! people push the arm; new terms are refused in faults, without torque and in those modes.

use super::Controller;
use super::activity::Activity;
use super::learned_ramp::Learned;
use super::mode::{LearningSwitch, Mode, Refusal};
use super::pose_task::PoseCycle;
use super::state::State;
use crate::config::{Config, FrictionVelocity, Role};
use crate::law::impedance::{Task, Torques};
use crate::law::learned::{LearnedAtPose, learned_torque_nm};
use crate::math::{Vector, Vector3};
use crate::model::learned::{JointMap, LearnedParameters, LearnedTerms, OutOfBounds};
use crate::trajectory::Reference;

impl Mode {
    /// Returns whether the model may be refined in this mode: the arm moves by itself, and nobody is expected to push it.
    pub fn allows_learning(self) -> bool {
        matches!(
            self,
            Mode::Move | Mode::Track | Mode::Probe | Mode::Excite | Mode::TrackPose
        )
    }
}

impl<const N: usize> State<N> {
    /// Switches learning on or off, or returns to the configuration's terms.
    pub(super) fn switch_learning(&mut self, config: &Config<N>, switch: LearningSwitch) {
        match switch {
            LearningSwitch::On => self.learned.on = true,
            LearningSwitch::Off => self.learned.on = false,
            LearningSwitch::Reset if self.learned_torques_act(config) => {
                self.learned.approach(config.learned, config.period_s);
            }
            LearningSwitch::Reset => {
                let on = self.learned.on;
                self.learned = Learned {
                    on,
                    ..Learned::new(&config.learned)
                };
            }
        }
    }

    pub(super) fn apply_learned_parameters(
        &mut self,
        controller: &Controller<N>,
        parameters: &LearnedParameters<N>,
    ) -> Result<(), Refusal> {
        self.check_learning_allowed()?;
        let bounds = &controller.learned_bounds;
        bounds.check(parameters).map_err(out_of_bounds)?;
        let target = LearnedTerms {
            parameters: *parameters,
            ..self.learned.target
        };
        let period_s = controller.config().period_s;
        self.learned.approach(target, period_s);
        Ok(())
    }

    pub(super) fn apply_learned_map(
        &mut self,
        controller: &Controller<N>,
        joint: usize,
        map: &JointMap,
    ) -> Result<(), Refusal> {
        self.check_learning_allowed()?;
        if joint >= N {
            return Err(Refusal::Value {
                entry: "joint of the learned map",
                value: joint as f64,
                limit: N as f64 - 1.0,
            });
        }
        let bounds = &controller.learned_bounds;
        bounds.check_map(joint, map).map_err(out_of_bounds)?;
        let mut target = self.learned.target;
        target.map[joint] = *map;
        self.learned.approach(target, controller.config().period_s);
        Ok(())
    }

    fn check_learning_allowed(&self) -> Result<(), Refusal> {
        let mode = self.mode();
        if !self.learned.on {
            return Err(Refusal::LearningOff);
        }
        if mode.allows_learning() {
            return Ok(());
        }
        Err(Refusal::Mode { mode })
    }

    /// Returns whether learned torques act: not without torque, in a fault or on a stale state.
    fn learned_torques_act(&self, config: &Config<N>) -> bool {
        !(self.activity.is_torque_off() || self.fault.is_some() || self.is_stale(config))
    }

    /// Advances the ramp and evaluates the terms in force at this pose. Returns `None` if all terms are zero, or if learned
    /// torques must not act.
    pub(super) fn learned_at_pose(
        &mut self,
        config: &Config<N>,
        reference: Option<&Reference>,
        elapsed_s: f64,
    ) -> Option<LearnedAtPose<N>> {
        if !self.learned.in_use || !self.learned_torques_act(config) {
            return None;
        }
        if self.learned.cycles_left > 0 {
            let frozen = self.latch.in_contact() || !self.drives_active || elapsed_s == 0.0;
            let resets = self.learned.target == config.learned;
            if !frozen && (resets || self.mode().allows_learning()) {
                self.learned.advance();
            }
        }
        let acceleration = match reference {
            Some(reference) if config.law.inertial_feedforward => reference.acceleration,
            _ => Vector3::zeros(),
        };
        Some(LearnedAtPose::new(
            &self.learned.current,
            &self.friction,
            &config.limits,
            &config.arm.gravity(),
            &self.position,
            &self.terms,
            &acceleration,
        ))
    }

    /// Returns the inputs of the observer from learned terms: the torque that acts on the arm while `torque` is commanded, and
    /// the learned change of the model's torque at the measured motion \[N m\].
    pub(super) fn learned_in_observer(
        &self,
        learned: Option<&LearnedAtPose<N>>,
    ) -> (Vector<N>, Vector<N>) {
        let Some(learned) = learned else {
            return (self.torque - self.ripple, Vector::zeros());
        };
        let terms = &self.learned.current;
        let velocity = &self.estimator.velocity_rad_per_s;
        let scale = &terms.parameters.torque_scale;
        (
            Vector::from_fn(|i, _| (self.torque[i] - self.ripple[i]) / (1.0 + scale[i])),
            learned.torque_nm(terms, &self.friction, velocity, None, &Vector::repeat(1.0)),
        )
    }

    /// Returns the learned torque term, given the other terms in `torques` \[N m\].
    pub(super) fn learned_torques(
        &self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        pose: Option<&PoseCycle<N>>,
        learned: &LearnedAtPose<N>,
        torques: &Torques<N>,
    ) -> Vector<N> {
        let config = controller.config();
        let terms = &self.learned.current;
        let velocity = self.friction_velocity(config, task, reference, pose);
        let mut change = learned.torque_nm(
            terms,
            &self.friction,
            &velocity,
            self.dry_direction.as_ref(),
            &self.dry_share(config),
        );
        if let Activity::Breakaway { ramp, .. } = &self.activity {
            change[ramp.joint] = 0.0;
        }
        let model = torques.gravity
            + torques.coriolis
            + torques.friction
            + torques.jacobian_rate
            + torques.inertial;
        learned_torque_nm(terms, &controller.learned_bounds, &model, &change)
    }

    /// Returns the joint velocities at which this activity feeds learned friction forward \[rad/s\]; zero for joints without
    /// this feed-forward.
    fn friction_velocity(
        &self,
        config: &Config<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        pose: Option<&PoseCycle<N>>,
    ) -> Vector<N> {
        let measured = &self.estimator.velocity_rad_per_s;
        let is_active = |i: usize| config.roles[i] == Role::Active;
        match (&self.activity, task, reference, pose) {
            // Learned friction is not compensated while a hand guides the arm; only a share of the model's friction is.
            (Activity::Float, ..) => Vector::zeros(),
            (_, Some(task), Some(reference), pose) => {
                let along = match pose {
                    Some(pose) => pose.joint_velocity_rad_per_s,
                    None => task.inverse * reference.velocity,
                };
                match config.law.friction_velocity {
                    FrictionVelocity::Reference => along,
                    FrictionVelocity::Measured => Vector::from_fn(|i, _| match is_active(i) {
                        true => measured[i],
                        false => along[i],
                    }),
                }
            }
            _ => match self.joint_reference(config) {
                Some(reference) => reference.velocity_rad_per_s,
                None => Vector::zeros(),
            },
        }
    }
}

fn out_of_bounds(wrong: OutOfBounds) -> Refusal {
    Refusal::Value {
        entry: wrong.entry,
        value: wrong.value,
        limit: wrong.bound,
    }
}
