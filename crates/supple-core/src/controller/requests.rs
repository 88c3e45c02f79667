//! Carries out requests, or refuses them.

use super::Controller;
use super::activity::Activity;
use super::checks::COMPLIANT_SPEED_SHARE;
use super::fault::SafeAction;
use super::mode::{Mode, Refusal, Request};
use super::pose_gains::{GainAxes, GainMatrices, GainPart, in_base};
use super::request_checks::{
    check_breakaway, check_excitation, check_gain_matrices, check_gains, check_held_targets,
    check_joint_gains, check_joint_move, check_peak, check_pose_joints, check_position_limits,
    check_rotation, check_rotational_gains, target_with_held_joints,
};
use super::state::State;
use crate::config::Config;
use crate::law::impedance::Task;
use crate::math::{abs, sqrt};
use crate::trajectory::Trajectory;

/// Fraction of a joint's speed limit up to which gravity hold may start while the arm sinks with idle drives. Shorted motors
/// let the arm sink at a lower speed.
const ENTRY_SPEED_SHARE: f64 = 0.25;
/// Fraction of a joint's speed limit up to which an arm counts as stopped at a reset.
const RESET_SPEED_SHARE: f64 = 0.05;

impl<const N: usize> State<N> {
    /// Carries out a request, or returns the reason for its refusal.
    #[inline(never)]
    pub(super) fn request(
        &mut self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        request: &Request<N>,
    ) -> Result<(), Refusal> {
        let config = controller.config();
        let mode = self.mode();
        let has_torque = !matches!(mode, Mode::Idle | Mode::Fault);
        match *request {
            Request::Reset => {
                let Activity::Fault(action) = self.activity else {
                    return Err(Refusal::Mode { mode });
                };
                match action {
                    SafeAction::Stop if self.drives_active => {
                        self.check_speed(config, RESET_SPEED_SHARE)?;
                    }
                    _ => self.check_speed(config, ENTRY_SPEED_SHARE)?,
                }
                self.fault = None;
                self.enter(match action {
                    SafeAction::Stop => Activity::GravityHold,
                    SafeAction::Brake => Activity::Idle,
                });
            }
            Request::Gains { gains, ramp_s } => {
                check_gains(config, &gains, ramp_s)?;
                self.check_damping(controller, task, &gains)?;
                let matrices =
                    GainMatrices::diagonal(&gains.stiffness_n_per_m, &gains.damping_n_s_per_m);
                let enforced = mode == Mode::TrackPose;
                self.start_gain_matrix_ramp(
                    controller,
                    GainPart::Linear,
                    &matrices,
                    GainAxes::Base,
                    ramp_s,
                    enforced,
                )?;
                self.gains.change(gains, ramp_s);
            }
            Request::JointGains { gains, ramp_s } => {
                check_joint_gains(config, &gains, ramp_s)?;
                self.check_joint_damping(controller, &gains)?;
                self.joint_gains.change(gains, ramp_s);
            }
            Request::RotationalGains { gains, ramp_s } => {
                check_rotational_gains(config, &gains, ramp_s)?;
                let matrices = GainMatrices::diagonal(
                    &gains.stiffness_nm_per_rad,
                    &gains.damping_nm_s_per_rad,
                );
                self.start_gain_matrix_ramp(
                    controller,
                    GainPart::Rotational,
                    &matrices,
                    GainAxes::Base,
                    ramp_s,
                    true,
                )?;
            }
            Request::GainMatrices {
                part,
                gains,
                axes,
                ramp_s,
            } => {
                check_pose_joints(config)?;
                check_gain_matrices(config, part, &gains, ramp_s)?;
                self.start_gain_matrix_ramp(controller, part, &gains, axes, ramp_s, true)?;
            }
            Request::Learning(switch) => self.switch_learning(config, switch),
            Request::LearnedParameters(ref parameters) => {
                self.apply_learned_parameters(controller, parameters)?;
            }
            Request::LearnedMap { joint, ref map } => {
                self.apply_learned_map(controller, joint, map)?;
            }
            // Idle is allowed in a fault without a reset; the fault stays latched.
            Request::Idle if mode == Mode::Fault => self.enter(Activity::Fault(SafeAction::Brake)),
            _ if mode == Mode::Fault => return Err(Refusal::Mode { mode }),
            Request::Idle => self.enter(Activity::Idle),
            Request::GravityHold => {
                if mode == Mode::Idle {
                    self.check_speed(config, ENTRY_SPEED_SHARE)?;
                }
                self.enter(Activity::GravityHold);
            }
            _ if !has_torque => return Err(Refusal::Mode { mode }),
            _ if !self.drives_active => return Err(Refusal::DrivesIdle),
            Request::Move {
                target_rad,
                duration_s,
            } => {
                check_position_limits(config, &target_rad)?;
                check_held_targets(config, &target_rad)?;
                // If gravity hold keeps the pose, the position loops continue from their set-points.
                let held_rad = self.pose_to_hold_rad(controller);
                let from_rad = held_rad.unwrap_or(self.position);
                check_joint_move(config, 1.0, &from_rad, &target_rad, duration_s)?;
                self.enter(Activity::Move {
                    from_rad,
                    to_rad: target_rad,
                    duration_s,
                });
            }
            Request::Track(trajectory) => {
                self.check_trajectory(controller, task, &trajectory)?;
                self.enter(Activity::Track(trajectory));
            }
            Request::SetPoint(ref set_point) => {
                self.apply_set_point(controller, set_point)?;
            }
            Request::TrackPose {
                trajectory,
                rotation,
            } => {
                check_pose_joints(config)?;
                self.check_trajectory(controller, task, &trajectory)?;
                check_rotation(config, &rotation)?;
                let base_from_tip = &self.terms.base_from_tip.rotation;
                self.check_pose_damping(
                    controller,
                    &self.pose_gains.linear.damping_at_ramp_ends(base_from_tip),
                    &self
                        .pose_gains
                        .rotational
                        .damping_at_ramp_ends(base_from_tip),
                )?;
                self.check_pose_is_regular(config)?;
                self.enter(Activity::TrackPose {
                    trajectory,
                    rotation,
                    from_base_from_tip: self.terms.base_from_tip.rotation,
                    posture_rad: self.position,
                });
            }
            Request::Float => {
                self.check_compliant_speed(config)?;
                self.enter(Activity::Float);
            }
            Request::JointImpedance {
                target_rad,
                duration_s,
            } => {
                self.check_compliant_speed(config)?;
                let target_rad = target_with_held_joints(config, &self.position, &target_rad);
                check_position_limits(config, &target_rad)?;
                check_joint_move(
                    config,
                    COMPLIANT_SPEED_SHARE,
                    &self.position,
                    &target_rad,
                    duration_s,
                )?;
                self.check_joint_damping(controller, &self.joint_gains.bound())?;
                self.enter(Activity::JointImpedance {
                    from_rad: self.position,
                    to_rad: target_rad,
                    duration_s,
                });
            }
            Request::Excite(series) => {
                // If position loops are active, the excitation continues from their set-points.
                let held_rad = self.loop_setpoints_rad(config);
                let from_rad = held_rad.unwrap_or(self.position);
                check_excitation(config, &from_rad, &series)?;
                self.enter(Activity::Excite(series));
            }
            Request::Breakaway(ramp) => {
                check_breakaway(config, &ramp)?;
                self.check_reference_at_rest(config)?;
                self.enter(self.breakaway_from(controller, ramp));
            }
        }
        Ok(())
    }

    /// Starts a ramp of gain matrices. With `check_delay` it refuses damping that the loop's delay does not allow in this pose.
    #[inline(never)]
    fn start_gain_matrix_ramp(
        &mut self,
        controller: &Controller<N>,
        part: GainPart,
        gains: &GainMatrices,
        axes: GainAxes,
        ramp_s: f64,
        check_delay: bool,
    ) -> Result<(), Refusal> {
        let base_from_tip = self.reference_orientation(controller.config());
        if check_delay {
            let new = [in_base(gains, axes, &base_from_tip).damping];
            let ramps = &self.pose_gains;
            match part {
                GainPart::Linear => {
                    let rotational = ramps.rotational.damping_at_ramp_ends(&base_from_tip);
                    self.check_pose_damping(controller, &new, &rotational)?;
                }
                GainPart::Rotational => {
                    let linear = ramps.linear.damping_at_ramp_ends(&base_from_tip);
                    self.check_pose_damping(controller, &linear, &new)?;
                }
            }
        }
        let ramp = self.pose_gains.of(part);
        ramp.change(gains, axes, ramp_s, &base_from_tip);
        Ok(())
    }

    /// Refuses a compliant mode while the arm exceeds that mode's speed limits: the first cycle would raise a fault.
    fn check_compliant_speed(&self, config: &Config<N>) -> Result<(), Refusal> {
        self.check_speed(config, COMPLIANT_SPEED_SHARE)?;
        let tip = self.terms.jacobian.fixed_rows::<3>(0) * self.estimator.velocity_rad_per_s;
        let (value, limit) = (
            sqrt(tip.dot(&tip)),
            COMPLIANT_SPEED_SHARE * config.limits.tip_speed_m_per_s,
        );
        if value > limit {
            return Err(Refusal::Value {
                entry: "speed of the tip at the request [m/s]",
                value,
                limit,
            });
        }
        Ok(())
    }

    /// Refuses a request while a joint is faster than this fraction of its speed limit.
    #[cold]
    #[inline(never)]
    fn check_speed(&self, config: &Config<N>, share: f64) -> Result<(), Refusal> {
        let velocity = &self.estimator.velocity_rad_per_s;
        for joint in 0..N {
            let limit = share * config.limits.joint_speed_rad_per_s[joint];
            if abs(velocity[joint]) > limit {
                return Err(Refusal::Value {
                    entry: "speed of a joint at the request [rad/s]",
                    value: abs(velocity[joint]),
                    limit,
                });
            }
        }
        Ok(())
    }

    /// Refuses a breakaway ramp while the set-points of the joints move. The ramp starts from the torque that holds the
    /// joint, and the torque of a moving joint is not that torque.
    fn check_reference_at_rest(&self, config: &Config<N>) -> Result<(), Refusal> {
        let speed_rad_per_s = match self.activity.has_joint_loops() {
            true => self
                .joint_reference(config)
                .map_or(0.0, |reference| reference.velocity_rad_per_s.amax()),
            false => 0.0,
        };
        if speed_rad_per_s > 0.0 {
            return Err(Refusal::Value {
                entry: "speed of a joint's set-point before a ramp [rad/s]",
                value: speed_rad_per_s,
                limit: 0.0,
            });
        }
        Ok(())
    }

    fn check_trajectory(
        &self,
        controller: &Controller<N>,
        task: Option<&Task<N>>,
        trajectory: &Trajectory,
    ) -> Result<(), Refusal> {
        let config = controller.config();
        trajectory.validate().map_err(Refusal::Trajectory)?;
        check_peak(config, trajectory)?;
        self.check_damping(controller, task, &self.gains.bound())?;
        let displacement = trajectory.at(0.0).position - self.terms.base_from_tip.translation;
        let (distance_m, limit_m) = (
            sqrt(displacement.dot(&displacement)),
            config.limits.start_error_m,
        );
        if distance_m > limit_m || distance_m.is_nan() {
            return Err(Refusal::FarFromStart {
                distance_m,
                limit_m,
            });
        }
        Ok(())
    }

    /// Refuses track pose near a singular pose, in which the task in six directions is damped.
    #[inline(never)]
    fn check_pose_is_regular(&self, config: &Config<N>) -> Result<(), Refusal> {
        match Task::of_pose(&self.terms, &config.roles) {
            Some(task) if !task.is_damped => Ok(()),
            _ => Err(Refusal::Singular),
        }
    }
}
