//! Start poses of a tip trajectory, and a check whether the arm can follow the trajectory from a pose.

use nalgebra::Vector3;
use supple_core::config::Role;
use supple_core::dynamics::{Terms, joint_poses, terms};
use supple_core::inverse_kinematics::{IkSolution, inverse_kinematics};
use supple_core::task::Task;
use supple_core::{Config, Trajectory, Vector};

/// Time between the points at which the reach is checked \[s\].
pub const REACH_CHECK_STEP_S: f64 = 0.05;
/// Fractions of the joint ranges at which the search for a start pose begins.
const SEEDS: [f64; 3] = [0.3, 0.5, 0.7];
/// Number of evenly spread poses at which the search begins otherwise.
const CANDIDATES: u32 = 100;
/// Fraction of each joint's range, around its middle, in which these poses lie.
const RANGE_SHARE: f64 = 0.7;

/// The first point of a trajectory that the arm does not reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfReach {
    /// Time since the start of the trajectory \[s\].
    pub time_s: f64,
    /// The point, base axes \[m\].
    pub point_m: Vector3<f64>,
    /// Distance of the nearest tip position that the arm reaches \[m\].
    pub distance_m: f64,
}

/// Returns the indices of the active joints, in order from the base.
pub fn active_joints<const N: usize>(config: &Config<N>) -> Vec<usize> {
    (0..N)
        .filter(|i| config.roles[*i] == Role::Active)
        .collect()
}

/// Returns joint angles with the tip at the start of the trajectory and the elbow as high as possible; checks that
/// the arm can follow the whole trajectory from this pose. If the third active joint is no elbow, or the trajectory leads out of
/// reach, returns the pose among evenly spread poses that is farthest from a singular pose.
///
/// # Errors
/// [`OutOfReach`] is the first point out of reach.
pub fn start_pose<const N: usize>(
    config: &Config<N>,
    trajectory: &Trajectory,
    duration_s: f64,
) -> Result<Vector<N>, OutOfReach> {
    let point_m = trajectory.at(0.0).position;
    let (highest, mut nearest) = highest_elbow(config, &point_m);
    let mut failure = None;
    if let Some(start_rad) = highest {
        match follow(config, &start_rad, trajectory, duration_s) {
            Ok(_) => return Ok(start_rad),
            Err(out_of_reach) => failure = Some(out_of_reach),
        }
    }
    let mut found: Vec<(f64, Vector<N>)> = spread_poses(config, CANDIDATES)
        .map(|seed| solve(config, &seed, &point_m))
        .inspect(|found| nearest = nearest.min(found.distance_m))
        .filter_map(|found| found.reached().then_some(found.position_rad))
        .map(|q| (min_singular_value_m(config, &q), q))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, start_rad) in found {
        match follow(config, &start_rad, trajectory, duration_s) {
            Ok(_) => return Ok(start_rad),
            Err(out_of_reach) => failure = failure.or(Some(out_of_reach)),
        }
    }
    Err(failure.unwrap_or(OutOfReach {
        time_s: 0.0,
        point_m,
        distance_m: nearest,
    }))
}

/// Returns the pose with the highest elbow that reaches a point, and the minimum distance to the point \[m\].
fn highest_elbow<const N: usize>(
    config: &Config<N>,
    point_m: &Vector3<f64>,
) -> (Option<Vector<N>>, f64) {
    let active = active_joints(config);
    let elbow = active[2];
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
        let found = solve(config, &seed, point_m);
        nearest = nearest.min(found.distance_m);
        let height = joint_poses(&config.arm, &found.position_rad)[elbow]
            .translation
            .z;
        if found.reached() && best.is_none_or(|(highest, _)| height > highest + 1e-6) {
            best = Some((height, found));
        }
    }
    (best.map(|(_, found)| found.position_rad), nearest)
}

/// Checks that the arm can follow a trajectory from a pose, between its soft stops. Returns the joint angles every
/// [`REACH_CHECK_STEP_S`], from the start \[rad\].
///
/// # Errors
/// [`OutOfReach`] is the first point out of reach.
pub fn follow<const N: usize>(
    config: &Config<N>,
    start_rad: &Vector<N>,
    trajectory: &Trajectory,
    duration_s: f64,
) -> Result<Vec<Vector<N>>, OutOfReach> {
    let steps = (duration_s / REACH_CHECK_STEP_S).ceil() as u32;
    let mut q = *start_rad;
    let mut poses = vec![q];
    for k in 1..=steps {
        let time_s = f64::from(k) * REACH_CHECK_STEP_S;
        let point_m = trajectory.at(time_s).position;
        let there = solve(config, &q, &point_m);
        if !there.reached() {
            return Err(OutOfReach {
                time_s,
                point_m,
                distance_m: there.distance_m,
            });
        }
        q = there.position_rad;
        poses.push(q);
    }
    Ok(poses)
}

/// Returns joint angles that bring the tip to a point, from a seed \[rad\].
pub(crate) fn solve<const N: usize>(
    config: &Config<N>,
    seed_rad: &Vector<N>,
    point_m: &Vector3<f64>,
) -> IkSolution<N> {
    inverse_kinematics(
        &config.arm,
        &config.roles,
        &config.limits,
        seed_rad,
        point_m,
    )
}

/// Returns the smallest singular value of the Jacobian of the tip's position \[m\]; zero if the law is not defined.
pub fn min_singular_value_m<const N: usize>(config: &Config<N>, q: &Vector<N>) -> f64 {
    let mut state = Terms::default();
    terms(&config.arm, q, &Vector::zeros(), &mut state);
    Task::new(&state, &config.roles).map_or(0.0, |task| task.min_singular_value_m)
}

/// Returns poses that are spread evenly over the middle of the joint ranges.
pub fn spread_poses<const N: usize>(
    config: &Config<N>,
    count: u32,
) -> impl Iterator<Item = Vector<N>> + '_ {
    let limits = &config.limits;
    (1..=count).map(|k| {
        Vector::from_fn(|i, _| {
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            lower + (0.5 + RANGE_SHARE * (halton(k, i) - 0.5)) * (upper - lower)
        })
    })
}

/// Returns element `index` of the Halton sequence of the `dimension`-th prime, between 0 and 1.
fn halton(mut index: u32, dimension: usize) -> f64 {
    const PRIMES: [u32; 7] = [2, 3, 5, 7, 11, 13, 17];
    let base = PRIMES[dimension % PRIMES.len()];
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= f64::from(base);
        value += digit * f64::from(index % base);
        index /= base;
    }
    value
}
