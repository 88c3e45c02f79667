//! Moves the arm to the start of a trajectory: a slow joint-space move and a rest.

use core::time::Duration;
use supple_cli::exit::Failure;
use supple_core::controller::Request;
use supple_core::{Config, Trajectory, Vector};
use supple_experiment::{PoseMotion, pose_start, start_pose};

/// Minimum duration of the move \[s\].
const MOVE_S: f64 = 1.0;
/// Rest in the start pose before the trajectory \[s\].
const REST_S: f64 = 0.4;
/// Fraction of each joint's speed limit that the move may reach.
const SPEED_FRACTION: f64 = 0.5;
/// Ratio of peak to mean speed of a minimum-jerk move.
const MINIMUM_JERK_PEAK: f64 = 1.875;

/// A trajectory with its start pose.
#[derive(Clone, Debug)]
pub struct Approach<const N: usize> {
    trajectory: Trajectory,
    start_rad: Vector<N>,
    speed_rad_per_s: Vector<N>,
    period_s: f64,
}

impl<const N: usize> Approach<N> {
    /// Plans the approach to a trajectory of this duration.
    ///
    /// # Errors
    /// [`Failure::Experiment`] if the arm cannot follow the trajectory.
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

    /// The approach to a motion of position and orientation. [`Approach::requests`] gives the trajectory of its position
    /// alone as the last request.
    ///
    /// # Errors
    /// [`Failure::Experiment`] if the arm cannot perform the motion.
    pub fn to_pose(config: &Config<N>, motion: &PoseMotion) -> Result<Self, Failure> {
        Ok(Approach {
            start_rad: pose_start(config, "pose", motion)?,
            trajectory: motion.trajectory,
            speed_rad_per_s: config.limits.joint_speed_rad_per_s,
            period_s: config.period_s,
        })
    }

    /// Pose in which the trajectory starts \[rad\].
    pub fn start_rad(&self) -> Vector<N> {
        self.start_rad
    }

    /// Requests from a given pose: the move, the number of cycles to wait, and the trajectory.
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

    /// Upper bound of the time until the trajectory starts.
    pub fn longest_wait(&self, from_rad: &Vector<N>) -> Duration {
        Duration::from_secs_f64(self.duration_s(from_rad) + REST_S + 2.0)
    }

    fn duration_s(&self, from_rad: &Vector<N>) -> f64 {
        let needed = (0..N).map(|i| {
            let distance_rad = (self.start_rad[i] - from_rad[i]).abs();
            MINIMUM_JERK_PEAK * distance_rad / (SPEED_FRACTION * self.speed_rad_per_s[i])
        });
        // Rounded up to 0.01 s, so that equal approaches give equal logs.
        let needed = needed.fold(MOVE_S, f64::max);
        (needed * 100.0).ceil() / 100.0
    }
}
