//! A motion as set-points that the controller accepts.

use super::RecordedMotion;
use super::smoothing::reference_at;
use crate::start::start_pose;
use supple_core::controller::{Refusal, Request, SetPoint, check_references};
use supple_core::trajectory::Segment;
use supple_core::{Controller, Reference, Trajectory, Vector};

/// Time between two set-points at the speed of the motion \[s\].
const SPACING_S: f64 = 0.04;
/// `sigma` of the kernel that smooths the motion \[s\].
const SIGMA_S: f64 = 0.1;
/// Time by which the smoothed motion begins before and ends after the recorded one \[s\]; further away it nearly rests.
const TAIL_S: f64 = 3.0 * SIGMA_S;
/// Factor by which each attempt slows down a motion that exceeds a limit.
const SLOWER: f64 = 1.1;
/// Maximum time between two set-points, which determines the slowest repetition \[s\].
const MAX_SPACING_S: f64 = 0.8;

/// Reason why a motion cannot be repeated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RepetitionError {
    /// The controller would refuse a request of the motion.
    #[error("at {time_s:.2} s of the motion: {refusal}")]
    Refused {
        /// Time in the motion \[s\].
        time_s: f64,
        /// The reason.
        refusal: Refusal,
    },
    /// The arm cannot reach the start of the motion.
    #[error("start of the motion: {0}")]
    Start(String),
    /// The requested speed is too low: the time between set-points is too long.
    #[error(
        "at {speed} times the speed the set-points are {spacing_s:.2} s apart, more than {MAX_SPACING_S} s: choose a speed of at \
         least {}",
        SPACING_S / MAX_SPACING_S
    )]
    TooSlow {
        /// Requested speed, as a multiple of the speed of the motion.
        speed: f64,
        /// Time between two set-points \[s\].
        spacing_s: f64,
    },
    /// The tip never moves.
    #[error("the tip rests during the whole motion: there is nothing to repeat")]
    NoMotion,
}

/// A planned and checked repetition of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Repetition<const N: usize> {
    /// Start pose \[rad\].
    pub start_rad: Vector<N>,
    /// Set-points, the first one at rest at the start.
    pub points: Vec<Reference>,
    /// Cycles from one set-point to the next.
    pub spacing_cycles: u64,
    /// Duration of the repetition relative to the duration of the recorded motion.
    pub slowdown: f64,
}

impl<const N: usize> Repetition<N> {
    /// Plans a repetition at `speed` times the recorded speed, or slower if a limit requires it. The start pose is the recorded
    /// pose, or without one any pose that reaches the first point.
    ///
    /// # Errors
    /// [`RepetitionError`]: a motion out of reach, or one that is too fast or needs too much torque at every speed.
    pub fn plan(
        controller: &Controller<N>,
        recorded: &RecordedMotion,
        speed: f64,
    ) -> Result<Repetition<N>, RepetitionError> {
        let config = controller.config();
        let (Some(begin_s), Some(tip_m)) = (recorded.time_s.first(), recorded.tip_m.first()) else {
            return Err(RepetitionError::NoMotion);
        };
        let length_s = recorded.duration_s() + 2.0 * TAIL_S;
        let intervals = (length_s / SPACING_S).ceil() as usize;
        let at =
            |k: usize| reference_at(recorded, begin_s - TAIL_S + SPACING_S * k as f64, SIGMA_S);
        let mut points: Vec<Reference> = (0..=intervals).map(at).collect();
        for end in [0, intervals] {
            points[end] = Reference::at_rest(points[end].position);
        }
        let start_rad = match recorded.joints_rad.first() {
            Some(joints) if joints.len() == N => Vector::from_column_slice(joints),
            _ => start_pose(config, "motion", &Trajectory::Hold(*tip_m), 0.0)
                .map_err(|error| RepetitionError::Start(error.to_string()))?,
        };
        // The number is rounded up, with a tolerance for the rounding of the division.
        let cycles = |spacing_s: f64| (spacing_s / config.period_s - 1e-9).ceil().max(1.0) as u64;
        let mut spacing_cycles = cycles(SPACING_S / speed);
        let spacing_s = spacing_cycles as f64 * config.period_s;
        if spacing_s > MAX_SPACING_S {
            return Err(RepetitionError::TooSlow { speed, spacing_s });
        }
        loop {
            let slowdown = spacing_cycles as f64 * config.period_s / SPACING_S;
            let repetition = Repetition {
                start_rad,
                points: points.iter().map(|point| slower(point, slowdown)).collect(),
                spacing_cycles,
                slowdown,
            };
            let Err((time_s, refusal)) = repetition.check(controller) else {
                return Ok(repetition);
            };
            let next = cycles(SLOWER * spacing_cycles as f64 * config.period_s);
            let slowing_may_help = !matches!(
                refusal,
                Refusal::OutOfReach { .. } | Refusal::Workspace { .. }
            );
            if !slowing_may_help || next as f64 * config.period_s > MAX_SPACING_S {
                return Err(RepetitionError::Refused {
                    time_s: (time_s / slowdown - TAIL_S).max(0.0),
                    refusal,
                });
            }
            spacing_cycles = next.max(spacing_cycles + 1);
        }
    }

    /// Does the checks of the controller and its helper before any motion.
    fn check(&self, controller: &Controller<N>) -> Result<(), (f64, Refusal)> {
        let config = controller.config();
        let spacing_s = self.spacing_cycles as f64 * config.period_s;
        let limits = &config.limits;
        for (k, pair) in self.points.windows(2).enumerate() {
            let acceleration = limits.tip_acceleration_m_per_s2;
            let peaks = Segment::new(pair[0], 0.0, pair[1], spacing_s, acceleration).peaks();
            for (entry, value, limit) in [
                (
                    "peak speed on the way to the set-point [m/s]",
                    peaks.speed_m_per_s,
                    limits.tip_speed_m_per_s,
                ),
                (
                    "peak acceleration on the way to the set-point [m/s^2]",
                    peaks.acceleration_m_per_s2,
                    acceleration,
                ),
            ] {
                if value.is_nan() || value > limit {
                    let refusal = Refusal::Value {
                        entry,
                        value,
                        limit,
                    };
                    return Err((spacing_s * k as f64, refusal));
                }
            }
        }
        let mut reached_s = 0.0;
        let timed = self.points.iter().enumerate().map(|(k, point)| {
            reached_s = spacing_s * k as f64;
            (reached_s, *point)
        });
        let checked = check_references(controller, &self.start_rad, timed);
        checked.map_err(|refusal| (reached_s, refusal))
    }

    /// Returns the hold at the first set-point, with which the repetition starts.
    pub fn start(&self) -> Trajectory {
        Trajectory::Hold(self.points[0].position)
    }

    /// Returns the number of requests.
    pub fn len(&self) -> usize {
        self.points.len() - 1
    }

    /// Returns whether the repetition has no requests, which is never true of a planned repetition.
    pub fn is_empty(&self) -> bool {
        self.points.len() < 2
    }

    /// Returns request number `k`, from 0, of a motion that starts in `start_cycle`, and the cycle in which the request must take
    /// effect. In that cycle the reference passes the previous set-point, so that the motion does not depend on when requests
    /// arrive.
    pub fn request(&self, k: usize, start_cycle: u64) -> (Request<N>, u64) {
        let at_cycle = start_cycle + self.spacing_cycles * (k as u64 + 1);
        let point = &self.points[k + 1];
        let request = Request::SetPoint(SetPoint {
            position_m: point.position,
            velocity_m_per_s: point.velocity,
            acceleration_m_per_s2: point.acceleration,
            at_cycle,
        });
        (request, at_cycle - self.spacing_cycles)
    }

    /// Returns the cycle in which a motion that starts in `start_cycle` ends.
    pub fn end_cycle(&self, start_cycle: u64) -> u64 {
        start_cycle + self.spacing_cycles * self.len() as u64
    }

    /// Returns the time in the recorded motion, from its first sample, that is repeated in this cycle \[s\].
    pub fn recorded_time_s(&self, start_cycle: u64, cycle: u64) -> f64 {
        let cycles = cycle.saturating_sub(start_cycle) as f64;
        SPACING_S * cycles / self.spacing_cycles as f64 - TAIL_S
    }
}

/// Returns the same point of a motion that takes `factor` times as long.
fn slower(point: &Reference, factor: f64) -> Reference {
    Reference {
        position: point.position,
        velocity: point.velocity / factor,
        acceleration: point.acceleration / (factor * factor),
    }
}
