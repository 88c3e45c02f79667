//! Start pose of a run, and a check that the arm can reach its whole trajectory.

use crate::error::ExperimentError;
use crate::trace::xyz;
use supple_core::{Config, Trajectory, Vector};
use supple_model::reach;
pub use supple_model::reach::active_joints;
pub(crate) use supple_model::reach::spread_poses;

/// Returns joint angles with the tip at the start of the trajectory, see [`reach::start_pose`].
///
/// # Errors
/// [`ExperimentError::BeyondJointStop`] names the first point out of reach.
pub fn start_pose<const N: usize>(
    config: &Config<N>,
    experiment: &str,
    trajectory: &Trajectory,
    duration_s: f64,
) -> Result<Vector<N>, ExperimentError> {
    reach::start_pose(config, trajectory, duration_s).map_err(|beyond| {
        ExperimentError::BeyondJointStop {
            experiment: experiment.to_owned(),
            time_s: beyond.time_s,
            point_m: xyz(&beyond.point_m),
            distance_m: beyond.distance_m,
        }
    })
}
