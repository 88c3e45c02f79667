//! Carries out requests, or refuses them.
//!
//! Only checks that fit into one cycle are done here; [`super::check_motion()`] checks a motion over its
//! whole length before it is requested.

use super::Controller;
use super::activity::Activity;
use super::checks::COMPLIANT_SPEED_SHARE;
use super::fault::SafeAction;
use super::mode::{Breakaway, Mode, Refusal, Request};
use super::pose_gains::{GainAxes, GainMatrices, GainPart, in_base};
use super::pose_task::DIRECTIONS;
use super::state::State;
use super::validate;
use crate::config::{Config, Gains, JointGains, Role, RotationalGains};
use crate::law::impedance::Task;
use crate::law::target::{EIGENVALUE_ROUNDING, eigenvalue_range};
use crate::law::task::count_active;
use crate::math::{Vector, abs, sqrt};
use crate::trajectory::{
    Fourier, LimitViolation, MINIMUM_JERK_ACCELERATION, MINIMUM_JERK_JERK, MINIMUM_JERK_SPEED,
    Rotation, Trajectory,
};

/// Angle by which the target of a held joint may differ from its own \[rad\].
const HELD_TOLERANCE_RAD: f64 = 1e-6;
/// Maximum distance of a joint from the start of an excitation \[rad\].
const EXCITE_START_RAD: f64 = 0.02;
/// Fraction of a joint's speed limit up to which an arm that falls or sinks with idle drives may be held again: more than
/// shorted motors let it sink with.
const ENTRY_SPEED_SHARE: f64 = 0.25;
/// Fraction of a joint's speed limit up to which an arm counts as stopped at a reset.
const RESET_SPEED_SHARE: f64 = 0.05;
/// Longest ramp of gains \[s\].
const MAX_RAMP_S: f64 = 3600.0;
/// Maximum joint damping that may be requested, whatever the delay allows \[N m s/rad\].
const MAX_JOINT_DAMPING_NM_S_PER_RAD: f64 = 1e5;

impl<const N: usize> State<N> {
    /// Carries out a request, or returns why it is refused.
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
                    SafeAction::GravityHold if self.drives_active => {
                        self.check_speed(config, RESET_SPEED_SHARE)?;
                    }
                    _ => self.check_speed(config, ENTRY_SPEED_SHARE)?,
                }
                self.fault = None;
                self.enter(match action {
                    SafeAction::GravityHold => Activity::GravityHold,
                    SafeAction::Idle => Activity::Idle,
                });
            }
            Request::Gains { gains, ramp_s } => {
                check_gains(config, &gains, ramp_s)?;
                self.check_damping(controller, task, &gains)?;
                let matrices =
                    GainMatrices::diagonal(&gains.stiffness_n_per_m, &gains.damping_n_s_per_m);
                let enforced = mode == Mode::TrackPose;
                self.change_matrices(
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
                self.change_matrices(
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
                self.change_matrices(controller, part, &gains, axes, ramp_s, true)?;
            }
            Request::Learning(switch) => self.switch_learning(config, switch),
            Request::LearnedParameters(ref parameters) => {
                self.receive_learned(controller, parameters)?;
            }
            Request::LearnedMap { joint, ref map } => {
                self.receive_learned_map(controller, joint, map)?;
            }
            // Idle is allowed in a fault without a reset; the fault stays latched.
            Request::Idle if mode == Mode::Fault => self.enter(Activity::Fault(SafeAction::Idle)),
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
                check_stops(config, &target_rad)?;
                check_held_targets(config, &target_rad)?;
                // Where gravity hold keeps the pose, the loops go on from their set-points.
                let held_rad = self.pose_to_hold_rad(controller);
                let from_rad = held_rad.unwrap_or(self.position);
                check_line(config, 1.0, &from_rad, &target_rad, duration_s)?;
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
                self.receive_set_point(controller, set_point)?;
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
                    &self.pose_gains.linear.damping_at_ends(base_from_tip),
                    &self.pose_gains.rotational.damping_at_ends(base_from_tip),
                )?;
                self.check_regular(config)?;
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
                let target_rad = active_target(config, &self.position, &target_rad);
                check_stops(config, &target_rad)?;
                check_line(
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
                // A joint that friction or gravity keeps from its set-point goes on from there.
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

    /// Starts a ramp of gain matrices; with `check_delay` unless the delay of the loop forbids their damping in this pose.
    #[inline(never)]
    fn change_matrices(
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
                    let rotational = ramps.rotational.damping_at_ends(&base_from_tip);
                    self.check_pose_damping(controller, &new, &rotational)?;
                }
                GainPart::Rotational => {
                    let linear = ramps.linear.damping_at_ends(&base_from_tip);
                    self.check_pose_damping(controller, &linear, &new)?;
                }
            }
        }
        let ramp = self.pose_gains.of(part);
        ramp.change(gains, axes, ramp_s, &base_from_tip);
        Ok(())
    }

    /// Refuses a compliant mode while the arm is faster than it may be there: its first cycle would be a fault.
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

    /// Refuses a ramp while the set-points of the joints still move: the torque of a moving joint does not hold it.
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

    /// Refuses a pose near a singular one, where the task of six directions is damped.
    #[inline(never)]
    fn check_regular(&self, config: &Config<N>) -> Result<(), Refusal> {
        match Task::of_pose(&self.terms, &config.roles) {
            Some(task) if !task.is_damped => Ok(()),
            _ => Err(Refusal::Singular),
        }
    }
}

fn check_gains<const N: usize>(
    config: &Config<N>,
    gains: &Gains,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    validate::gains(gains, limits.stiffness_n_per_m, limits.damping_n_s_per_m).map_err(
        |error| Refusal::Value {
            entry: error.entry,
            value: error.value,
            limit: if error.entry == "stiffness_n_per_m" {
                limits.stiffness_n_per_m
            } else {
                limits.damping_n_s_per_m
            },
        },
    )?;
    check_ramp(ramp_s)
}

fn check_joint_gains<const N: usize>(
    config: &Config<N>,
    gains: &JointGains<N>,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let stiffest = &config.move_gains.stiffness_nm_per_rad;
    for joint in 0..N {
        for (entry, value, limit) in [
            (
                "impedance_stiffness_nm_per_rad",
                gains.stiffness_nm_per_rad[joint],
                stiffest[joint],
            ),
            (
                "impedance_damping_nm_s_per_rad",
                gains.damping_nm_s_per_rad[joint],
                MAX_JOINT_DAMPING_NM_S_PER_RAD,
            ),
        ] {
            if !(0.0..=limit).contains(&value) {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit: if value < 0.0 { 0.0 } else { limit },
                });
            }
        }
    }
    check_ramp(ramp_s)
}

fn check_rotational_gains<const N: usize>(
    config: &Config<N>,
    gains: &RotationalGains,
    ramp_s: f64,
) -> Result<(), Refusal> {
    for axis in 0..3 {
        for (entry, value, limit) in [
            (
                "rotational stiffness_nm_per_rad",
                gains.stiffness_nm_per_rad[axis],
                config.pose.max_stiffness_nm_per_rad,
            ),
            (
                "rotational damping_nm_s_per_rad",
                gains.damping_nm_s_per_rad[axis],
                config.pose.max_damping_nm_s_per_rad,
            ),
        ] {
            if !(0.0..=limit).contains(&value) {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit: if value < 0.0 { 0.0 } else { limit },
                });
            }
        }
    }
    check_ramp(ramp_s)
}

#[cold]
#[inline(never)]
fn check_gain_matrices<const N: usize>(
    config: &Config<N>,
    part: GainPart,
    gains: &GainMatrices,
    ramp_s: f64,
) -> Result<(), Refusal> {
    let (stiffness_limit, damping_limit) = match part {
        GainPart::Linear => (
            config.limits.stiffness_n_per_m,
            config.limits.damping_n_s_per_m,
        ),
        GainPart::Rotational => (
            config.pose.max_stiffness_nm_per_rad,
            config.pose.max_damping_nm_s_per_rad,
        ),
    };
    for (matrix, entry, limit) in [
        (
            &gains.stiffness,
            "eigenvalue of the stiffness matrix",
            stiffness_limit,
        ),
        (
            &gains.damping,
            "eigenvalue of the damping matrix",
            damping_limit,
        ),
    ] {
        if let Some(value) = matrix.iter().find(|value| !value.is_finite()) {
            return Err(Refusal::Value {
                entry: "entry of a gain matrix",
                value: *value,
                limit,
            });
        }
        let Some((min, max)) = eigenvalue_range(matrix) else {
            return Err(Refusal::Value {
                entry: "asymmetry of a gain matrix",
                value: (matrix - matrix.transpose()).amax(),
                limit: 0.0,
            });
        };
        if min < -EIGENVALUE_ROUNDING * max {
            return Err(Refusal::Value {
                entry,
                value: min,
                limit: 0.0,
            });
        }
        if max > limit {
            return Err(Refusal::Value {
                entry,
                value: max,
                limit,
            });
        }
    }
    check_ramp(ramp_s)
}

/// The pose has six directions.
pub(super) fn check_pose_joints<const N: usize>(config: &Config<N>) -> Result<(), Refusal> {
    let active = count_active(&config.roles);
    if active >= DIRECTIONS {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "number of active joints, of which a pose needs six,",
        value: active as f64,
        limit: DIRECTIONS as f64,
    })
}

fn check_rotation<const N: usize>(config: &Config<N>, rotation: &Rotation) -> Result<(), Refusal> {
    rotation.validate().map_err(Refusal::Trajectory)?;
    let (value, limit) = (
        rotation.peak_rad_per_s(),
        config.pose.angular_speed_rad_per_s,
    );
    if value > limit || value.is_nan() {
        return Err(Refusal::Value {
            entry: "peak angular speed of the rotation [rad/s]",
            value,
            limit,
        });
    }
    Ok(())
}

fn check_ramp(ramp_s: f64) -> Result<(), Refusal> {
    if (0.0..=MAX_RAMP_S).contains(&ramp_s) {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "ramp_s",
        value: ramp_s,
        limit: if ramp_s > 0.0 { MAX_RAMP_S } else { 0.0 },
    })
}

fn check_peak<const N: usize>(config: &Config<N>, trajectory: &Trajectory) -> Result<(), Refusal> {
    let (speed, acceleration) = trajectory.peaks();
    for (entry, value, limit) in [
        (
            "peak speed of the trajectory [m/s]",
            speed,
            config.limits.tip_speed_m_per_s,
        ),
        (
            "peak acceleration of the trajectory [m/s^2]",
            acceleration,
            config.limits.tip_acceleration_m_per_s2,
        ),
    ] {
        if value > limit || value.is_nan() {
            return Err(Refusal::Value {
                entry,
                value,
                limit,
            });
        }
    }
    Ok(())
}

fn check_excitation<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    series: &Fourier<N>,
) -> Result<(), Refusal> {
    series.validate().map_err(Refusal::Trajectory)?;
    series
        .within(&config.limits)
        .map_err(|violation| match violation {
            LimitViolation::Position(joint, value_rad) => {
                Refusal::BeyondJointStop { joint, value_rad }
            }
            LimitViolation::Speed(joint, value_rad_per_s, limit_rad_per_s) => Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            },
        })?;
    let start = series.at(0.0).position_rad;
    let value = (start - from_rad).amax();
    if value <= EXCITE_START_RAD {
        return Ok(());
    }
    Err(Refusal::Value {
        entry: "distance of a joint from the start of the excitation",
        value,
        limit: EXCITE_START_RAD,
    })
}

fn check_breakaway<const N: usize>(config: &Config<N>, ramp: &Breakaway) -> Result<(), Refusal> {
    let refuse = |entry, value, limit| {
        Err(Refusal::Value {
            entry,
            value,
            limit,
        })
    };
    if ramp.joint >= N {
        return refuse("joint", ramp.joint as f64, (N - 1) as f64);
    }
    let fastest = config.limits.torque_rate_nm_per_s[ramp.joint];
    let rate = abs(ramp.rate_nm_per_s);
    if !(rate > 0.0 && rate <= fastest) {
        return refuse("rate_nm_per_s", ramp.rate_nm_per_s, fastest);
    }
    let furthest = config.limits.joint_tracking_error_rad;
    if !(ramp.stop_rad > 0.0 && ramp.stop_rad <= furthest) {
        return refuse("stop_rad", ramp.stop_rad, furthest);
    }
    let strongest = config.limits.joint_torque_nm[ramp.joint];
    if !(ramp.limit_nm > 0.0 && ramp.limit_nm <= strongest) {
        return refuse("limit_nm", ramp.limit_nm, strongest);
    }
    Ok(())
}

/// The target with the held joints where they are.
pub(super) fn active_target<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    target_rad: &Vector<N>,
) -> Vector<N> {
    Vector::from_fn(|joint, _| match config.roles[joint] {
        Role::Active => target_rad[joint],
        Role::Held { .. } => from_rad[joint],
    })
}

fn check_held_targets<const N: usize>(
    config: &Config<N>,
    target_rad: &Vector<N>,
) -> Result<(), Refusal> {
    for (role, value) in config.roles.iter().zip(target_rad) {
        if let Role::Held { position_rad, .. } = role
            && !(0.0..=HELD_TOLERANCE_RAD).contains(&abs(value - position_rad))
        {
            return Err(Refusal::Value {
                entry: "target_rad of a held joint",
                value: *value,
                limit: *position_rad,
            });
        }
    }
    Ok(())
}

pub(super) fn check_stops<const N: usize>(
    config: &Config<N>,
    target_rad: &Vector<N>,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    for joint in 0..N {
        let value_rad = target_rad[joint];
        let (lower, upper) = (
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
        );
        if !(lower..=upper).contains(&value_rad) {
            return Err(Refusal::BeyondJointStop { joint, value_rad });
        }
    }
    Ok(())
}

/// `speed_share` of the joints' speed limits applies.
fn check_line<const N: usize>(
    config: &Config<N>,
    speed_share: f64,
    from_rad: &Vector<N>,
    to_rad: &Vector<N>,
    duration_s: f64,
) -> Result<(), Refusal> {
    let limits = &config.limits;
    if !(duration_s.is_finite() && duration_s > 0.0) {
        return Err(Refusal::Value {
            entry: "duration_s",
            value: duration_s,
            limit: f64::MAX,
        });
    }
    for joint in 0..N {
        let displacement_rad = abs(to_rad[joint] - from_rad[joint]);
        let value_rad_per_s = MINIMUM_JERK_SPEED * displacement_rad / duration_s;
        let limit_rad_per_s = speed_share * limits.joint_speed_rad_per_s[joint];
        if value_rad_per_s > limit_rad_per_s || value_rad_per_s.is_nan() {
            return Err(Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
        let per_s2 = displacement_rad / (duration_s * duration_s);
        for (entry, value, limit) in [
            (
                "peak joint acceleration of the move [rad/s^2]",
                MINIMUM_JERK_ACCELERATION * per_s2,
                limits.joint_acceleration_rad_per_s2[joint],
            ),
            (
                "peak joint jerk of the move [rad/s^3]",
                MINIMUM_JERK_JERK * per_s2 / duration_s,
                limits.joint_jerk_rad_per_s3[joint],
            ),
        ] {
            if value > limit || value.is_nan() {
                return Err(Refusal::Value {
                    entry,
                    value,
                    limit,
                });
            }
        }
    }
    Ok(())
}
