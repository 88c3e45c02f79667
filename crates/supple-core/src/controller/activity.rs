//! What the controller is busy with, and how a request changes it.

use super::fault::SafeAction;
use super::mode::{Breakaway, Mode, Refusal, Request};
use super::state::{GainRamp, State};
use super::validate;
use crate::config::{Config, Gains, Role};
use crate::math::{Vector, abs, sqrt};
use crate::trajectory::{Beyond, Fourier, Trajectory};

/// Peak speed of a minimum-jerk move is this times its mean speed.
const MINIMUM_JERK_PEAK: f64 = 1.875;
/// Angle by which the target of a held joint may differ from its own \[rad\].
const HELD_TOLERANCE_RAD: f64 = 1e-6;
/// Greatest distance of a joint from the start of an excitation \[rad\].
const EXCITE_START_RAD: f64 = 0.02;

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
    Excite(Fourier<N>),
    Breakaway {
        ramp: Breakaway,
        from_rad: Vector<N>,
    },
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
            Activity::Excite(_) => Mode::Excite,
            Activity::Breakaway { .. } => Mode::Breakaway,
            Activity::Fault(_) => Mode::Fault,
        }
    }

    /// All joints, held ones too, have a stiff loop of this activity.
    pub fn has_own_loops(&self) -> bool {
        matches!(
            self,
            Activity::Move { .. } | Activity::Excite(_) | Activity::Breakaway { .. }
        )
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
        let working = !matches!(mode, Mode::Idle | Mode::Fault);
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
            Request::Excite(series) => {
                check_excitation(config, &self.position, &series)?;
                self.enter(Activity::Excite(series));
            }
            Request::Breakaway(ramp) => {
                check_breakaway(config, &ramp)?;
                let from_rad = self.position;
                self.enter(Activity::Breakaway { ramp, from_rad });
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

fn check_excitation<const N: usize>(
    config: &Config<N>,
    from_rad: &Vector<N>,
    series: &Fourier<N>,
) -> Result<(), Refusal> {
    series.validate().map_err(Refusal::Trajectory)?;
    series
        .within(&config.limits)
        .map_err(|beyond| match beyond {
            Beyond::Position(joint, value_rad) => Refusal::Unreachable { joint, value_rad },
            Beyond::Speed(joint, value_rad_per_s, limit_rad_per_s) => Refusal::TooFast {
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
