//! What the controller is busy with, and how a request changes it.

use super::fault::SafeAction;
use super::mode::{Mode, Refusal, Request};
use super::state::{GainRamp, State};
use super::validate;
use crate::config::{Config, Gains, Role};
use crate::math::{Vector, abs, sqrt};
use crate::trajectory::Trajectory;

/// Peak speed of a minimum-jerk move is this times its mean speed.
const MINIMUM_JERK_PEAK: f64 = 1.875;
/// Angle by which the target of a held joint may differ from its own \[rad\].
const HELD_TOLERANCE_RAD: f64 = 1e-6;

/// A mode with what it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Activity<const N: usize> {
    Idle,
    GravityHold,
    Move {
        from_rad: Vector<N>,
        to_rad: Vector<N>,
        duration_s: f64,
    },
    Track(Trajectory),
    Fault(SafeAction),
}

impl<const N: usize> Activity<N> {
    pub fn mode(&self) -> Mode {
        match self {
            Activity::Idle => Mode::Idle,
            Activity::GravityHold => Mode::GravityHold,
            Activity::Move { .. } => Mode::Move,
            Activity::Track(Trajectory::Probe(_)) => Mode::Probe,
            Activity::Track(_) => Mode::Track,
            Activity::Fault(_) => Mode::Fault,
        }
    }

    /// No torque at all.
    pub fn is_limp(&self) -> bool {
        matches!(self, Activity::Idle | Activity::Fault(SafeAction::Idle))
    }
}

impl<const N: usize> State<N> {
    /// Carries out a request, or says why not.
    pub(super) fn request(
        &mut self,
        config: &Config<N>,
        request: &Request<N>,
    ) -> Result<(), Refusal> {
        let mode = self.mode();
        let working = matches!(
            mode,
            Mode::GravityHold | Mode::Move | Mode::Track | Mode::Probe
        );
        match *request {
            Request::Reset => {
                let Activity::Fault(action) = self.activity else {
                    return Err(Refusal::Mode { mode });
                };
                self.fault = None;
                self.enter(match action {
                    SafeAction::GravityHold => Activity::GravityHold,
                    SafeAction::Idle => Activity::Idle,
                });
            }
            Request::Gains { gains, ramp_s } => self.set_gains(config, gains, ramp_s)?,
            // The fault stays latched, but nobody has to reset it to let go of the arm.
            Request::Idle if mode == Mode::Fault => self.enter(Activity::Fault(SafeAction::Idle)),
            _ if mode == Mode::Fault => return Err(Refusal::Mode { mode }),
            Request::Idle => self.enter(Activity::Idle),
            Request::GravityHold => self.enter(Activity::GravityHold),
            _ if !working => return Err(Refusal::Mode { mode }),
            Request::Move {
                target_rad,
                duration_s,
            } => {
                check_move(config, &self.position, &target_rad, duration_s)?;
                self.enter(Activity::Move {
                    from_rad: self.position,
                    to_rad: target_rad,
                    duration_s,
                });
            }
            Request::Track(trajectory) => {
                trajectory.validate().map_err(Refusal::Trajectory)?;
                let way = trajectory.at(0.0).position - self.terms.base_from_tip.translation;
                let (distance_m, limit_m) = (sqrt(way.dot(&way)), config.limits.start_error_m);
                if distance_m > limit_m || distance_m.is_nan() {
                    return Err(Refusal::FarFromStart {
                        distance_m,
                        limit_m,
                    });
                }
                self.enter(Activity::Track(trajectory));
            }
        }
        Ok(())
    }

    fn set_gains(&mut self, config: &Config<N>, gains: Gains, ramp_s: f64) -> Result<(), Refusal> {
        let limits = &config.limits;
        validate::gains(&gains, limits.stiffness_n_per_m, limits.damping_n_s_per_m).map_err(
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
        if !(ramp_s.is_finite() && ramp_s >= 0.0) {
            return Err(Refusal::Value {
                entry: "ramp_s",
                value: ramp_s,
                limit: f64::MAX,
            });
        }
        self.gains = GainRamp {
            from: self.gains.now(),
            to: gains,
            elapsed_s: 0.0,
            ramp_s,
        };
        Ok(())
    }
}

fn check_move<const N: usize>(
    config: &Config<N>,
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
        let value_rad = to_rad[joint];
        let (lower, upper) = (
            limits.position_lower_rad[joint],
            limits.position_upper_rad[joint],
        );
        if !(lower..=upper).contains(&value_rad) {
            return Err(Refusal::Unreachable { joint, value_rad });
        }
        if let Role::Held { position_rad, .. } = config.roles[joint]
            && abs(value_rad - position_rad) > HELD_TOLERANCE_RAD
        {
            return Err(Refusal::Value {
                entry: "target_rad of a held joint",
                value: value_rad,
                limit: position_rad,
            });
        }
        let value_rad_per_s = MINIMUM_JERK_PEAK * abs(value_rad - from_rad[joint]) / duration_s;
        let limit_rad_per_s = limits.joint_speed_rad_per_s[joint];
        if value_rad_per_s > limit_rad_per_s || value_rad_per_s.is_nan() {
            return Err(Refusal::TooFast {
                joint,
                value_rad_per_s,
                limit_rad_per_s,
            });
        }
    }
    Ok(())
}
