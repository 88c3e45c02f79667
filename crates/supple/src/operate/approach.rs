//! Moves the arm to the start of a trajectory: a slow joint-space move and a rest.

use core::time::Duration;
use supple_cli::exit::Failure;
use supple_core::config::Role;
use supple_core::controller::Request;
use supple_core::{Config, Trajectory, Vector};
use supple_experiment::{PoseMotion, approach_s, pose_start, start_pose};

/// Rest in the start pose before the trajectory \[s\].
const REST_S: f64 = 0.4;

/// A trajectory with its start pose, to which the arm moves before it follows the trajectory.
#[derive(Clone, Debug)]
pub struct Approach<const N: usize> {
    trajectory: Trajectory,
    start_rad: Vector<N>,
    config: Config<N>,
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
            config: *config,
        })
    }

    /// Creates the approach to a trajectory from a measured pose in which the tip is at its start. Held joints move to their held
    /// angles, from which a measured angle may differ by a count of its encoder.
    pub fn from_pose(config: &Config<N>, trajectory: Trajectory, start_rad: Vector<N>) -> Self {
        Approach {
            trajectory,
            start_rad: Vector::from_fn(|i, _| match config.roles[i] {
                Role::Active => start_rad[i],
                Role::Held { position_rad, .. } => position_rad,
            }),
            config: *config,
        }
    }

    /// Plans the approach to a motion of position and orientation. The last request of [`Approach::requests`] is then the
    /// trajectory of its position alone.
    ///
    /// # Errors
    /// [`Failure::Experiment`] if the arm cannot perform the motion.
    pub fn to_pose(config: &Config<N>, motion: &PoseMotion) -> Result<Self, Failure> {
        Ok(Approach {
            start_rad: pose_start(config, "pose", motion)?,
            trajectory: motion.trajectory,
            config: *config,
        })
    }

    /// Pose in which the trajectory starts \[rad\].
    pub fn start_rad(&self) -> Vector<N> {
        self.start_rad
    }

    /// Returns the requests from a given pose: the move, the number of cycles to wait, and the trajectory.
    pub fn requests(&self, from_rad: &Vector<N>) -> (Request<N>, u64, Request<N>) {
        let duration_s = self.duration_s(from_rad);
        let between = ((duration_s + REST_S) / self.config.period_s).round() as u64;
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
        approach_s(&self.config, from_rad, &self.start_rad)
    }
}
