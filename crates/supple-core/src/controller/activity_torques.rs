//! The torque of each activity, term by term.

use super::activity::Activity;
use super::fault::Fault;
use super::mode::Breakaway;
use super::pose_task::{DIRECTIONS, PoseCycle};
use super::state::State;
use super::{Controller, limiter};
use crate::config::{Config, FrictionVelocity, JointGains, Role};
use crate::law::impedance::{HeldFriction, LawInput, PositionTarget, Task, Torques, impedance};
use crate::math::{Vector, Vector3, abs, smooth_step};
use crate::trajectory::{JointReference, Reference};

/// Share of a joint's torque limit that the spring of the joint impedance mode may use.
const JOINT_SPRING_SHARE: f64 = 0.25;
/// Share of the breakaway torque below which a ramp does not move its joint.
const MOVING_SHARE_OF_BREAKAWAY: f64 = 0.5;

impl<const N: usize> State<N> {
    pub(super) fn reference(&self, config: &Config<N>) -> Option<Reference> {
        match &self.activity {
            Activity::Track(trajectory) | Activity::TrackPose { trajectory, .. } => {
                Some(trajectory.at(self.activity_s(config)))
            }
            Activity::SetPoints(segment) => Some(segment.at(self.activity_s(config))),
            _ => None,
        }
    }

    /// Returns the set-point of each joint's position loop, if one is active \[rad\].
    pub(super) fn joint_setpoints(&self, config: &Config<N>) -> [Option<f64>; N] {
        if let Activity::Breakaway { ramp, from_rad, .. } = &self.activity {
            return core::array::from_fn(|i| (i != ramp.joint).then_some(from_rad[i]));
        }
        if let Some(setpoint_rad) = self.loop_setpoints_rad(config) {
            return core::array::from_fn(|i| Some(setpoint_rad[i]));
        }
        core::array::from_fn(|i| {
            (config.roles[i] != Role::Active).then_some(self.held_setpoint_rad[i])
        })
    }

    /// Returns the set-points of the loops that hold or move every joint, if they are active \[rad\].
    pub(super) fn loop_setpoints_rad(&self, config: &Config<N>) -> Option<Vector<N>> {
        if self.holds_pose() {
            return Some(self.held_setpoint_rad);
        }
        let has_loops = self.activity.has_joint_loops();
        let reference = has_loops.then(|| self.joint_reference(config)).flatten()?;
        Some(reference.position_rad)
    }

    /// Returns the gains of the move mode in the pose of this cycle.
    fn move_gains(&self, controller: &Controller<N>) -> JointGains<N> {
        controller.move_gains(&self.terms.mass_matrix)
    }

    /// Returns the set-points from which a gravity hold that keeps the pose continues after position loops; `None` without
    /// loops, or if gravity hold does not keep the pose. The joint of a ramp keeps the torque from before the ramp.
    pub(super) fn pose_to_hold_rad(&self, controller: &Controller<N>) -> Option<Vector<N>> {
        let config = controller.config();
        if !config.hold_pose {
            return None;
        }
        let mut setpoint_rad = self.loop_setpoints_rad(config)?;
        if let Activity::Breakaway { ramp, held_nm, .. } = &self.activity {
            let stiffness = self.move_gains(controller).stiffness_nm_per_rad[ramp.joint];
            setpoint_rad[ramp.joint] = self.position[ramp.joint] + held_nm / stiffness;
        }
        Some(setpoint_rad)
    }

    /// Returns the torque terms of the activity, without those common to all activities. Inlined, so that the terms are written
    /// directly into the cycle's record.
    #[inline(always)]
    pub(super) fn activity_torques(
        &self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        reference: Option<&Reference>,
        pose: Option<&PoseCycle<N>>,
        tip_force_n: Option<Vector3<f64>>,
    ) -> Torques<N> {
        let config = controller.config();
        if const { N >= DIRECTIONS }
            && let (Some(pose), Some(_)) = (pose, reference)
        {
            return self.pose_torques(controller, pose);
        }
        match (&self.activity, task, reference) {
            (Activity::Track(_) | Activity::SetPoints(_), Some(task), Some(reference)) => {
                let tip = self.terms.base_from_tip.translation;
                let target = PositionTarget {
                    reference,
                    gains: &self.gains.current(),
                    spring_limit_n: config.workspace.spring_limit_n(&tip),
                };
                let velocity = &self.estimator.velocity_rad_per_s;
                let (law, friction) = (&config.law, &self.friction);
                let law_input = LawInput {
                    dry_direction: self.dry_direction.as_ref(),
                    stribeck_velocity_rad_per_s: self.stribeck_velocity(config),
                    friction_share: self.latch.friction_share(),
                    nullspace_damping_nm_s_per_rad: *controller.nullspace_damping_nm_s_per_rad(),
                    held_friction: self.held_friction(config),
                    ..LawInput::of_law(law, friction, target, velocity, tip_force_n)
                };
                impedance(&config.roles, &self.terms, task, &law_input)
            }
            (activity, ..) if activity.has_joint_loops() => self.joint_motion_torques(controller),
            (Activity::JointImpedance { .. }, ..) => self.joint_impedance_torques(controller),
            (Activity::Float, ..) => self.float_torques(controller),
            _ => self.safe_torques(controller),
        }
    }

    /// Returns the velocities in the Stribeck effect, if they are not those of the rest of the friction.
    pub(super) fn stribeck_velocity(&self, config: &Config<N>) -> Option<&Vector<N>> {
        let law = &config.law;
        let measured =
            law.measured_stribeck && law.friction_velocity == FrictionVelocity::Reference;
        measured.then_some(&self.stribeck_velocity_rad_per_s)
    }

    /// Returns the friction feed-forward that is frozen while contact blocks the arm, and shortly after.
    pub(super) fn held_friction(&self, config: &Config<N>) -> Option<HeldFriction<'_, N>> {
        (config.latch.hold_friction && self.latch.held() > 0.0).then(|| HeldFriction {
            velocity_rad_per_s: &self.contact_velocity_rad_per_s,
            weight: self.latch.held(),
            viscous_share: self.latch.viscous_share(&config.latch),
        })
    }

    /// Returns the fraction of each joint's dry friction that is fed forward, 0 to 1. In contact, joints whose presliding is known
    /// have all of it, in the direction of their measured motion.
    pub(super) fn dry_share(&self, config: &Config<N>) -> Vector<N> {
        let measured = self.dry_direction.is_some() && self.held_friction(config).is_some();
        Vector::from_fn(
            |i, _| match measured && config.friction[i].presliding_rad > 0.0 {
                true => 1.0,
                false => self.latch.friction_share(),
            },
        )
    }

    /// Returns the torques of gravity hold with joint damping, of the safe action, or zero without torque.
    pub(super) fn safe_torques(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        if self.activity.is_torque_off() {
            return Torques::zeros();
        }
        if self.is_stale(config) || !self.drives_active {
            // With a stale state neither velocity nor position error is known; with idle drives
            // only gravity is wanted at their return.
            return Torques {
                gravity: self.terms.gravity,
                ..Torques::zeros()
            };
        }
        if self.fault.is_some() {
            return self.stopping(controller);
        }
        let velocity = &self.estimator.velocity_rad_per_s;
        Torques {
            gravity: self.terms.gravity,
            damping: -config.hold_damping_nm_s_per_rad.component_mul(velocity),
            ..Torques::zeros()
        }
    }

    /// Returns the joint reference in the modes that move joints.
    pub(super) fn joint_reference(&self, config: &Config<N>) -> Option<JointReference<N>> {
        let time_s = self.activity_s(config);
        match &self.activity {
            Activity::Move {
                from_rad,
                to_rad,
                duration_s,
            }
            | Activity::JointImpedance {
                from_rad,
                to_rad,
                duration_s,
            } => {
                let (share, first_derivative, second_derivative) = smooth_step(time_s / duration_s);
                let displacement = to_rad - from_rad;
                Some(JointReference {
                    position_rad: from_rad + displacement * share,
                    velocity_rad_per_s: displacement * (first_derivative / duration_s),
                    acceleration_rad_per_s2: displacement
                        * (second_derivative / (duration_s * duration_s)),
                })
            }
            Activity::Excite(series) => Some(series.at(time_s)),
            Activity::Breakaway { from_rad, .. } => Some(JointReference {
                position_rad: *from_rad,
                velocity_rad_per_s: Vector::zeros(),
                acceleration_rad_per_s2: Vector::zeros(),
            }),
            _ => None,
        }
    }

    /// Returns the model feed-forward along a joint reference.
    fn joint_feedforward(&self, reference: &JointReference<N>) -> Torques<N> {
        let velocity = &reference.velocity_rad_per_s;
        Torques {
            gravity: self.terms.gravity,
            coriolis: self.terms.coriolis_gravity - self.terms.gravity,
            friction: Vector::from_fn(|i, _| self.friction[i].torque_nm(velocity[i])),
            inertial: self.terms.mass_matrix * reference.acceleration_rad_per_s2,
            ..Torques::zeros()
        }
    }

    /// Returns the model feed-forward and a compliant spring and damper on each active joint. The spring's torque is at most
    /// [`JOINT_SPRING_SHARE`] of the joint's limit.
    fn joint_impedance_torques(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        let Some(reference) = self.joint_reference(config) else {
            return self.safe_torques(controller);
        };
        let gains = self.joint_gains.current();
        let velocity_error = reference.velocity_rad_per_s - self.estimator.velocity_rad_per_s;
        let mut torques = self.joint_feedforward(&reference);
        for joint in 0..N {
            if config.roles[joint] != Role::Active {
                continue;
            }
            let limit = JOINT_SPRING_SHARE * config.limits.joint_torque_nm[joint];
            let error = reference.position_rad[joint] - self.position[joint];
            torques.stiffness[joint] =
                (gains.stiffness_nm_per_rad[joint] * error).clamp(-limit, limit);
            torques.damping[joint] = gains.damping_nm_s_per_rad[joint] * velocity_error[joint];
        }
        torques
    }

    /// Returns the model alone: gravity, Coriolis and a share of the friction at the measured velocity.
    fn float_torques(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        let velocity = &self.estimator.velocity_rad_per_s;
        let mut torques = Torques {
            gravity: self.terms.gravity,
            coriolis: self.terms.coriolis_gravity - self.terms.gravity,
            ..Torques::zeros()
        };
        for joint in 0..N {
            if config.roles[joint] == Role::Active {
                torques.friction[joint] =
                    config.float_friction_share * self.friction[joint].torque_nm(velocity[joint]);
            }
        }
        torques
    }

    /// Returns the model feed-forward and stiff position loops along the joint reference; the joint of a
    /// breakaway ramp has the ramp instead of loop and friction.
    pub(super) fn joint_motion_torques(&self, controller: &Controller<N>) -> Torques<N> {
        let config = controller.config();
        let Some(reference) = self.joint_reference(config) else {
            return self.safe_torques(controller);
        };
        let gains = self.move_gains(controller);
        let position_error = reference.position_rad - self.position;
        let velocity_error = reference.velocity_rad_per_s - self.estimator.velocity_rad_per_s;
        let mut torques = Torques {
            joint_pd: gains.stiffness_nm_per_rad.component_mul(&position_error)
                + gains.damping_nm_s_per_rad.component_mul(&velocity_error),
            ..self.joint_feedforward(&reference)
        };
        if let Activity::Breakaway { ramp, held_nm, .. } = &self.activity {
            torques.friction[ramp.joint] = ramp.rate_nm_per_s * self.activity_s(config);
            torques.joint_pd[ramp.joint] = *held_nm;
        }
        torques
    }

    /// Returns the activity of a breakaway ramp. It continues from position loops or an earlier ramp: the other joints keep
    /// their set-points, the ramped joint keeps its torque, so that gravity which the model lacks does not move the arm.
    pub(super) fn breakaway_from(
        &self,
        controller: &Controller<N>,
        ramp: Breakaway,
    ) -> Activity<N> {
        let (config, joint) = (controller.config(), ramp.joint);
        let stiffness = self.move_gains(controller).stiffness_nm_per_rad;
        let constant_nm = |joint: usize| self.friction[joint].torque_nm(0.0);
        let (mut from_rad, mut held_nm) = (self.position, 0.0);
        if let Some(setpoint_rad) = self.loop_setpoints_rad(config) {
            from_rad = setpoint_rad;
            if let Activity::Breakaway {
                ramp: earlier,
                held_nm,
                ..
            } = &self.activity
            {
                // The set-point at which the loop gives the torque of the earlier ramp.
                let ramped = earlier.joint;
                let torque_nm = held_nm + earlier.rate_nm_per_s * self.activity_s(config);
                from_rad[ramped] =
                    self.position[ramped] + (torque_nm - constant_nm(ramped)) / stiffness[ramped];
            }
            let error_rad = from_rad[joint] - self.position[joint];
            // The constant part of the friction model acts at rest, too.
            held_nm = stiffness[joint] * error_rad + constant_nm(joint);
            from_rad[joint] = self.position[joint];
        }
        Activity::Breakaway {
            ramp,
            from_rad,
            held_nm,
        }
    }

    /// Leaves the breakaway mode for gravity hold once its joint has moved with the ramp, or the ramp has reached its
    /// limit.
    ///
    /// # Errors
    /// [`Fault::MotionAgainstTorque`] if the joint has moved against the ramp.
    #[inline(always)]
    pub(super) fn end_breakaway(&mut self, config: &Config<N>) -> Result<(), Fault> {
        let Activity::Breakaway { ramp, from_rad, .. } = self.activity else {
            return Ok(());
        };
        let joint = ramp.joint;
        let moved_rad = self.position[joint] - from_rad[joint];
        let torque_nm = ramp.rate_nm_per_s * self.activity_s(config);
        if abs(moved_rad) < ramp.stop_rad && abs(torque_nm) < ramp.limit_nm {
            return Ok(());
        }
        self.enter(Activity::GravityHold);
        // A smaller torque cannot have moved the joint: the modelled gravity is wrong, or somebody pushes the joint.
        let limit_nm = MOVING_SHARE_OF_BREAKAWAY * self.friction[joint].dry_size_nm(0.0);
        let value_nm = abs(torque_nm);
        let is_against = moved_rad * torque_nm < 0.0 && abs(moved_rad) >= ramp.stop_rad;
        if is_against && value_nm >= limit_nm {
            return Err(Fault::MotionAgainstTorque {
                joint,
                value_nm,
                limit_nm,
            });
        }
        Ok(())
    }

    /// Adds the terms common to all activities with torque, if the state is fresh and the drives are active: held-joint loops,
    /// soft stops and the workspace margin. In a fault none of them acts.
    #[inline(always)]
    pub(super) fn add_joint_loops_and_stops(
        &self,
        controller: &Controller<N>,
        torques: &mut Torques<N>,
    ) {
        let config = controller.config();
        if !self.drives_active {
            return;
        }
        let velocity = &self.estimator.velocity_rad_per_s;
        if self.has_held_loops && !self.activity.has_joint_loops() {
            let mut add = |joint: usize, stiffness_nm_per_rad: f64, damping_nm_s_per_rad: f64| {
                torques.joint_pd[joint] += stiffness_nm_per_rad
                    * (self.held_setpoint_rad[joint] - self.position[joint])
                    - damping_nm_s_per_rad * velocity[joint];
                torques.damping[joint] = 0.0;
            };
            if self.holds_pose() {
                let gains = self.move_gains(controller);
                let stiffness = &gains.stiffness_nm_per_rad;
                for joint in 0..N {
                    add(joint, stiffness[joint], gains.damping_nm_s_per_rad[joint]);
                }
            } else {
                for (joint, role) in config.roles.iter().enumerate() {
                    if let Role::Held {
                        stiffness_nm_per_rad,
                        damping_nm_s_per_rad,
                        ..
                    } = *role
                    {
                        add(joint, stiffness_nm_per_rad, damping_nm_s_per_rad);
                    }
                }
            }
        }
        if let Some(stops) = self.soft_stops(controller) {
            torques.soft_stop = stops.torque_nm(velocity);
        }
        if !config.workspace.is_unbounded() {
            let jacobian = self.terms.jacobian.fixed_rows::<3>(0);
            let tip = self.terms.base_from_tip.translation;
            let margin_from_m = &self.position_limits.margin_from_m;
            let tip_velocity = jacobian * velocity;
            let force = config
                .workspace
                .soft_force(&tip, &tip_velocity, margin_from_m);
            torques.soft_stop += jacobian.tr_mul(&force);
        }
    }

    /// Bumpless transfer: blends out, over `handover_s`, the torque difference at the start of the
    /// activity.
    #[inline(always)]
    pub(super) fn blend_torque(&mut self, controller: &Controller<N>, torques: &mut Torques<N>) {
        if self.fault.is_some() {
            return;
        }
        if let Some(zeros) = self.handover.zeros_if_finished() {
            torques.handover = *zeros;
            return;
        }
        let config = controller.config();
        let share = self.activity_s(config) / config.handover_s;
        torques.handover = self.handover.blend(
            &self.torque,
            torques,
            share,
            config.period_s / config.handover_s,
            config.period_s / controller.stop_s(),
        );
    }

    /// Updates the fallback torque: gravity at the last trusted pose, within the torque limits;
    /// zero if poses are not trusted.
    pub(super) fn update_fallback(&mut self, controller: &Controller<N>) {
        if self.activity.is_torque_off() {
            self.fallback = Vector::zeros();
        } else if self.missing.iter().all(|missed| *missed == 0) {
            let limits = &controller.config().limits;
            let (gravity, _) =
                limiter::limit_torque(limits, controller.motors(), &self.terms.gravity);
            if crate::math::all_finite(&gravity) {
                self.fallback = gravity;
            }
        }
    }
}
