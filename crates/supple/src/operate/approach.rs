//! The way to the start of a trajectory: a move in joint space, slow enough, then a rest.

use crate::exit::Failure;
use core::time::Duration;
use supple_core::controller::Request;
use supple_core::{Config, Trajectory, Vector};
use supple_experiment::start_pose;

/// Shortest move \[s\].
const MOVE_S: f64 = 1.0;
/// Rest in the start pose before the trajectory \[s\].
const REST_S: f64 = 0.4;
/// Share of each joint's speed limit that the move reaches.
const SPEED_SHARE: f64 = 0.5;
/// Peak speed of a minimum-jerk move is this times its mean speed.
const MINIMUM_JERK_PEAK: f64 = 1.875;

/// A trajectory with the pose that it starts from.
#[derive(Clone, Debug)]
pub struct Approach<const N: usize> {
    trajectory: Trajectory,
    start_rad: Vector<N>,
    speed_rad_per_s: Vector<N>,
    period_s: f64,
}

impl<const N: usize> Approach<N> {
    /// The way to a trajectory of this duration.
    ///
    /// # Errors
    /// [`Failure::Experiment`] where the arm cannot follow it.
    pub fn new(
        config: &Config<N>,
        trajectory: Trajectory,
        duration_s: f64,
    ) -> Result<Self, Failure> {
        Ok(Approach {
            start_rad: start_pose(config, "trajectory", &trajectory, duration_s)?,
            trajectory,
            speed_rad_per_s: config.limits.joint_speed_rad_per_s,
            period_s: config.period_s,
        })
    }

    /// What to ask for, from a pose: the move, the trajectory, and the cycles between the two.
    pub fn requests(&self, from_rad: &Vector<N>) -> (Request<N>, u64, Request<N>) {
        let duration_s = self.duration_s(from_rad);
        let between = ((duration_s + REST_S) / self.period_s).round() as u64;
        let target_rad = self.start_rad;
        (
            Request::Move {
                target_rad,
                duration_s,
            },
            between,
            Request::Track(self.trajectory),
        )
    }

    /// When the trajectory has begun at the latest, if all goes well.
    pub fn longest_wait(&self, from_rad: &Vector<N>) -> Duration {
        Duration::from_secs_f64(self.duration_s(from_rad) + REST_S + 2.0)
    }

    fn duration_s(&self, from_rad: &Vector<N>) -> f64 {
        let needed = (0..N).map(|i| {
            let way_rad = (self.start_rad[i] - from_rad[i]).abs();
            MINIMUM_JERK_PEAK * way_rad / (SPEED_SHARE * self.speed_rad_per_s[i])
        });
        // Whole hundredths: the same words in every log of the same way.
        let needed = needed.fold(MOVE_S, f64::max);
        (needed * 100.0).ceil() / 100.0
    }
}
