//! Start pose of a run, and a check that the arm can reach its whole trajectory.

use crate::error::ExperimentError;
use crate::trace::xyz;
use supple_core::config::Role;
use supple_core::dynamics::joint_poses;
use supple_core::inverse_kinematics::{IkSolution, inverse_kinematics};
use supple_core::nalgebra::Vector3;
use supple_core::{Config, Trajectory, Vector};

/// Time between the points at which the reach is checked \[s\].
const REACH_CHECK_STEP_S: f64 = 0.05;
/// Fractions of the joint ranges at which the search for a start pose begins.
const SEEDS: [f64; 3] = [0.3, 0.5, 0.7];

/// Indices of the active joints, in order from the base.
pub fn active_joints<const N: usize>(config: &Config<N>) -> Vec<usize> {
    (0..N)
        .filter(|i| config.roles[*i] == Role::Active)
        .collect()
}

/// Joint angles that put the tip at the start of the trajectory with the elbow as high as possible; checks that
/// the whole trajectory can be reached from there.
///
/// # Errors
/// [`ExperimentError::BeyondJointStop`] names the first point out of reach.
pub fn start_pose<const N: usize>(
    config: &Config<N>,
    experiment: &str,
    trajectory: &Trajectory,
    duration_s: f64,
) -> Result<Vector<N>, ExperimentError> {
    let start = trajectory.at(0.0).position;
    let active = active_joints(config);
    let elbow = active[2];
    let solve = |seed: &Vector<N>, point: &Vector3<f64>| {
        inverse_kinematics(&config.arm, &config.roles, &config.limits, seed, point)
    };
    let mut best: Option<(f64, IkSolution<N>)> = None;
    let mut nearest = f64::MAX;
    let seeds = SEEDS
        .iter()
        .flat_map(|a| SEEDS.iter().map(move |b| (*a, *b)));
    for (shoulder_fraction, elbow_fraction) in seeds {
        let seed = Vector::from_fn(|i, _| {
            let (lower, upper) = (
                config.limits.position_lower_rad[i],
                config.limits.position_upper_rad[i],
            );
            let fraction = match i {
                _ if i == elbow => elbow_fraction,
                _ if i == active[1] => shoulder_fraction,
                _ => return 0.0_f64.clamp(lower, upper),
            };
            lower + fraction * (upper - lower)
        });
        let found = solve(&seed, &start);
        nearest = nearest.min(found.distance_m);
        let height = joint_poses(&config.arm, &found.position_rad)[elbow]
            .translation
            .z;
        if found.reached() && best.is_none_or(|(highest, _)| height > highest + 1e-6) {
            best = Some((height, found));
        }
    }
    let out_of_reach = |time_s, point, distance_m| ExperimentError::BeyondJointStop {
        experiment: experiment.to_owned(),
        time_s,
        point_m: xyz(&point),
        distance_m,
    };
    let Some((_, found)) = best else {
        return Err(out_of_reach(0.0, start, nearest));
    };
    let mut q = found.position_rad;
    let steps = (duration_s / REACH_CHECK_STEP_S).ceil() as u32;
    for k in 1..=steps {
        let time_s = f64::from(k) * REACH_CHECK_STEP_S;
        let point = trajectory.at(time_s).position;
        let there = solve(&q, &point);
        if !there.reached() {
            return Err(out_of_reach(time_s, point, there.distance_m));
        }
        q = there.position_rad;
    }
    Ok(found.position_rad)
}
