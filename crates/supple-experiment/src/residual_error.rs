//! Tracking error that follows from the torques that a controller's feed-forward leaves in a motion.
//!
//! If the feed-forward has the error `r`, the tip deviates until the stiffness balances the error: by `F / K`
//! with the force `F` at the tip that has the torques `J' F = r` at the joints that move the tip. The relevant residuals depend
//! on the later motion: residuals of the fast excitation come from elasticity and inertia, residuals near a reversal from
//! friction that has not reversed yet, and neither acts in a slow motion elsewhere. So the residuals are
//! averaged over the samples in which the arm is near the poses and speeds of the sinusoid, and a joint slides, separately for
//! both directions: noise averages out, errors of gravity and friction stay.
//!
//! A joint whose friction falls with speed by more than its damping holds against sticks and slips, also with an exact model: the
//! difference of breakaway and Coulomb torque then counts as a residual too.
//!
//! The factor of the upper bound covers nine tenths of the calibrations of simulated arms with random effects
//! of real arms (`docs/verdict.md`).

use crate::scenario::{STIFFNESS_N_PER_M, gains_like};
use crate::tracking_prediction::GOOD_M;
use nalgebra::{DMatrix, Vector3};
use serde::{Deserialize, Serialize};
use supple_core::config::{Role, STRIBECK_AVERAGING_S};
use supple_core::dynamics::{crba, jacobian};
use supple_core::{Config, Vector};
use supple_ident::estimate::pseudo_inverse;
use supple_ident::{Motion, feedforward_nm};
use supple_model::reach::{REACH_CHECK_STEP_S, active_joints, follow, start_pose};
use supple_model::{Description, ModelError};

/// Distance from the poses of the sinusoid, and distance from its speeds, at which a sample has the weight 0.6.
const NEAR_RAD: f64 = 0.4;
const NEAR_RAD_PER_S: f64 = 0.2;
/// Time that the samples of each direction must represent \[s\]; the distances grow by this factor, up to a limit, until the
/// samples represent this time.
const MIN_TIME_S: f64 = 0.6;
const DISTANCE_GROWTH: f64 = 1.3;
const MAX_DISTANCE_FACTOR: f64 = 20.0;
/// Speed, and distance since the last reversal, above which a joint slides.
const SLIDING_RAD_PER_S: f64 = 0.06;
const SLIDING_RAD: f64 = 0.03;
/// Fraction of the force at the tip of all dry friction that the feed-forward leaves at reversals even with an exact model: 3 mm
/// at 5 N/m on the WAM.
const REVERSAL_SHARE: f64 = 0.004;
/// Range of a joint's angles in the sinusoid below which it rests; friction then holds it where it is.
const ASKED_RAD: f64 = 0.01;
/// Upper and lower bound relative to the estimate; the error at reversals is added to the upper bound, as squares.
const UPPER_FACTOR: f64 = 1.16;
const LOWER_FACTOR: f64 = 0.1;

/// Message if there is no interval.
pub const NO_INTERVAL: &str = "no interval at 5 N/m: a joint that moves the tip was not identified or slides too little in the logs that \
                               were not fitted, or the sinusoid is out of reach";

/// Interval of the tracking error: in simulation 85 % of the errors lie within it, and 88.5 % below its upper bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorInterval {
    /// Lower bound \[m\].
    pub lower_m: f64,
    /// Upper bound \[m\].
    pub upper_m: f64,
    /// Log and joint that contribute most: index of the log, joint.
    pub worst: (usize, usize),
    /// Residual of each identified joint that moves the tip, in the worst log \[N m\].
    pub residual_nm: Vec<f64>,
}

impl ErrorInterval {
    /// Returns in words whether the model is suitable for a stiffness; `joint` names the joint that contributes most.
    pub fn verdict(&self, stiffness_n_per_m: f64, joint: &str) -> String {
        let good = match self.upper_m <= GOOD_M {
            true => "good",
            false => "not good",
        };
        format!(
            "{good} for {stiffness_n_per_m} N/m: the torques that the feed-forward leaves allow a tracking error of {:.1} to \
             {:.1} mm (85 % of simulated cases); {joint} counts most",
            1e3 * self.lower_m,
            1e3 * self.upper_m
        )
    }
}

/// Poses and speeds of the sinusoid at which the paper's arm is tracked.
#[derive(Clone, Debug)]
pub struct SinusoidRegion<const N: usize> {
    lower_rad: Vector<N>,
    upper_rad: Vector<N>,
    max_rad_per_s: Vector<N>,
    active: Vec<usize>,
    /// Force at the tip for each newton metre at an active joint, RMS over the poses \[1/m\].
    force_n_per_nm: Vec<f64>,
    /// Force at the tip that even an exact model leaves at reversals \[N\].
    reversal_n: f64,
    /// Torque by which each active joint sticks and slips even with an exact model \[N m\], see [`sticking_nm`].
    sticking_nm: Vec<f64>,
}

impl<const N: usize> SinusoidRegion<N> {
    /// Creates the region of this arm; `None` if the arm cannot reach the sinusoid or no joint moves the tip.
    ///
    /// # Errors
    /// If the description does not fit `N` joints.
    pub fn new(description: &Description) -> Result<Option<Self>, ModelError> {
        let config = description.config::<N>()?;
        let (trajectory, duration_s) = description.paths().sinusoid(1.0);
        let poses = start_pose(&config, &trajectory, duration_s)
            .and_then(|start_rad| follow(&config, &start_rad, &trajectory, duration_s));
        Ok(poses.ok().and_then(|poses| Self::of_poses(&config, &poses)))
    }

    fn of_poses(config: &Config<N>, poses: &[Vector<N>]) -> Option<Self> {
        let active = active_joints(config);
        let (mut lower_rad, mut upper_rad) = (*poses.first()?, *poses.first()?);
        let mut max_rad_per_s = Vector::<N>::zeros();
        let mut squares = vec![0.0; active.len()];
        for (i, q) in poses.iter().enumerate() {
            (lower_rad, upper_rad) = (lower_rad.inf(q), upper_rad.sup(q));
            if i > 0 {
                max_rad_per_s = max_rad_per_s.sup(&((q - poses[i - 1]).abs() / REACH_CHECK_STEP_S));
            }
            let columns = jacobian(&config.arm, q);
            let transposed =
                DMatrix::from_fn(active.len(), 3, |a, axis| columns[(axis, active[a])]);
            let inverse = pseudo_inverse(&transposed, 1e-6).ok()?;
            for (square, column) in squares.iter_mut().zip(inverse.column_iter()) {
                *square += column.norm_squared() / poses.len() as f64;
            }
        }
        let force_n_per_nm: Vec<f64> = squares.into_iter().map(f64::sqrt).collect();
        let dry_n = active
            .iter()
            .zip(&force_n_per_nm)
            .map(|(&joint, force)| force * config.friction[joint].coulomb_nm);
        let sticking_nm = active
            .iter()
            .map(|&joint| sticking_nm(config, poses, joint));
        let sticking_nm = sticking_nm.collect();
        let reversal_n = REVERSAL_SHARE * dry_n.map(|n| n * n).sum::<f64>().sqrt();
        Some(SinusoidRegion {
            lower_rad,
            upper_rad,
            max_rad_per_s,
            active,
            force_n_per_nm,
            reversal_n,
            sticking_nm,
        })
    }

    /// Returns the torque by which each joint that moves the tip sticks and slips in the sinusoid at 5 N/m with an exact model
    /// \[N m\], with the index of the joint.
    pub fn sticking_joints_nm(&self) -> impl Iterator<Item = (usize, f64)> {
        let all = self.active.iter().copied().zip(self.sticking_nm.clone());
        all.filter(|(_, torque_nm)| *torque_nm > 0.0)
    }

    /// Returns the squared distance of a sample from the region, in units of [`NEAR_RAD`] and [`NEAR_RAD_PER_S`].
    fn squared_distance(&self, motion: &Motion, sample: usize) -> f64 {
        let beyond =
            |value: f64, lower: f64, upper: f64| (lower - value).max(value - upper).max(0.0);
        let angle = |j: usize| {
            beyond(motion.q[(sample, j)], self.lower_rad[j], self.upper_rad[j]) / NEAR_RAD
        };
        let speed = |j: usize| {
            beyond(motion.qd[(sample, j)].abs(), 0.0, self.max_rad_per_s[j]) / NEAR_RAD_PER_S
        };
        (0..N).map(|j| angle(j).powi(2) + speed(j).powi(2)).sum()
    }
}

/// Returns the torque by which a joint that is asked to move along these poses sticks and slips at 5 N/m: the difference of breakaway and
/// Coulomb torque if, on average, dry friction falls with speed by more than viscous friction and the law's damping hold against,
/// else zero. The feed-forward of friction follows the reference, so that it damps nothing. If its Stribeck effect follows the
/// measured speed, this is so only for a joint that is faster than the average of the measured speed.
fn sticking_nm<const N: usize>(config: &Config<N>, poses: &[Vector<N>], joint: usize) -> f64 {
    let friction = &config.friction[joint];
    let excess_nm = friction.breakaway_nm - friction.coulomb_nm;
    let angles = poses.iter().map(|q| q[joint]);
    let (lower_rad, upper_rad) = angles.fold((f64::MAX, f64::MIN), |(lower, upper), angle| {
        (lower.min(angle), upper.max(angle))
    });
    if upper_rad - lower_rad < ASKED_RAD {
        return 0.0;
    }
    // The slope of exp(-x^2) is steepest here; a joint that is hardly asked to move gets there by itself.
    let steepest = core::f64::consts::FRAC_1_SQRT_2;
    let falls_nm_s_per_rad = |speed_rad_per_s: f64| {
        let x = (speed_rad_per_s / friction.stribeck_rad_per_s).max(steepest);
        excess_nm / friction.stribeck_rad_per_s * 2.0 * x * (-x * x).exp()
    };
    let law_n_s_per_m = gains_like(&config.law.gains, STIFFNESS_N_PER_M).damping_n_s_per_m;
    let damping_nm_s_per_rad = |pair: &[Vector<N>]| {
        let speed_rad_per_s = (pair[1][joint] - pair[0][joint]).abs() / REACH_CHECK_STEP_S;
        let columns = jacobian(&config.arm, &pair[1]);
        let column = Vector3::from_fn(|axis, _| columns[(axis, joint)]);
        let of_law = column.dot(&law_n_s_per_m.component_mul(&column));
        of_law + friction.viscous_nm_s_per_rad - falls_nm_s_per_rad(speed_rad_per_s)
    };
    let pairs = poses.windows(2);
    let sum: f64 = pairs.clone().map(damping_nm_s_per_rad).sum();
    let mean_nm_s_per_rad = sum / pairs.len().max(1) as f64;
    let held = match config.law.measured_stribeck {
        true => {
            let lag_s = STRIBECK_AVERAGING_S + 1.0 / config.estimator_rad_per_s;
            free_inertia_kg_m2(config, &poses[0], joint) / lag_s
        }
        false => 0.0,
    };
    match mean_nm_s_per_rad < -held {
        true => excess_nm,
        false => 0.0,
    }
}

/// Returns the inertia of a joint while all other active joints are free \[kg m^2\].
fn free_inertia_kg_m2<const N: usize>(config: &Config<N>, q: &Vector<N>, joint: usize) -> f64 {
    let active: Vec<usize> = (0..N)
        .filter(|i| config.roles[*i] == Role::Active)
        .collect();
    let whole = crba(&config.arm, q);
    let of_active = DMatrix::from_fn(active.len(), active.len(), |i, j| {
        whole[(active[i], active[j])]
    });
    let at = active.iter().position(|i| *i == joint);
    match (of_active.try_inverse(), at) {
        (Some(inverse), Some(at)) => 1.0 / inverse[(at, at)],
        _ => whole[(joint, joint)],
    }
}

/// Returns the residual of a joint near the sinusoid \[N m\]: the root of the sum of two squares, of the mean of the mean
/// residuals of both directions, and of half their difference, which friction causes. `None` if the joint does not slide in both
/// directions for [`MIN_TIME_S`].
fn residual_nm(
    motion: &Motion,
    squared_distance: &[f64],
    joint: usize,
    residual: &[f64],
) -> Option<f64> {
    let slides = sliding(motion, joint);
    let mut factor = 1.0;
    loop {
        let mut sums = [[0.0_f64; 2]; 2];
        for (i, r) in residual.iter().enumerate().filter(|(i, _)| slides[*i]) {
            let weight = (-0.5 * squared_distance[i] / (factor * factor)).exp();
            let of_direction = &mut sums[usize::from(motion.qd[(i, joint)] > 0.0)];
            of_direction[0] += weight;
            of_direction[1] += weight * r;
        }
        let time_s = sums[0][0].min(sums[1][0]) / motion.rate_hz;
        if time_s >= MIN_TIME_S {
            let [backward, forward] = sums.map(|[weight, sum]| sum / weight);
            return Some((0.5 * (forward + backward)).hypot(0.5 * (forward - backward)));
        }
        if factor > MAX_DISTANCE_FACTOR {
            return None;
        }
        factor *= DISTANCE_GROWTH;
    }
}

/// Returns for each sample whether a joint slides and its torque is used.
fn sliding(motion: &Motion, joint: usize) -> Vec<bool> {
    let (mut travel_rad, mut forward) = (0.0, None);
    let slides = |i: usize| {
        let speed = motion.qd[(i, joint)];
        if forward.replace(speed > 0.0) != Some(speed > 0.0) {
            travel_rad = 0.0;
        }
        travel_rad += speed.abs() / motion.rate_hz;
        speed.abs() > SLIDING_RAD_PER_S && travel_rad >= SLIDING_RAD && motion.used(i, joint)
    };
    (0..motion.samples()).map(slides).collect()
}

/// Returns the interval of the tracking error of the sinusoid at a stiffness, from motions and the torques that the feed-forward
/// leaves in them, (samples, identified joints); the worst motion decides. `None` without motions, if not all joints that move
/// the tip are among `identified_joints`, or if there is no motion in which each of these joints slides in both directions for
/// some time.
pub fn error_interval<const N: usize>(
    region: &SinusoidRegion<N>,
    identified_joints: &[usize],
    held_out: &[(&Motion, &DMatrix<f64>)],
    stiffness_n_per_m: f64,
) -> Option<ErrorInterval> {
    let rows: Option<Vec<usize>> = region
        .active
        .iter()
        .map(|joint| identified_joints.iter().position(|j| j == joint))
        .collect();
    let rows = rows?;
    let mut worst: Option<ErrorInterval> = None;
    for (log, (motion, residuals)) in held_out.iter().enumerate() {
        let squared_distance: Vec<f64> = (0..motion.samples())
            .map(|sample| region.squared_distance(motion, sample))
            .collect();
        let of_joint = |(&row, &joint): (&usize, &usize)| {
            let column = residuals.column(row).clone_owned();
            residual_nm(motion, &squared_distance, joint, column.as_slice())
        };
        let found: Option<Vec<f64>> = rows.iter().zip(&region.active).map(of_joint).collect();
        let Some(found) = found else {
            continue;
        };
        let mut residual_nm = vec![0.0; identified_joints.len()];
        let mut parts = Vec::new();
        for (i, &row) in rows.iter().enumerate() {
            residual_nm[row] = found[i];
            let force_n = found[i].hypot(region.sticking_nm[i]) * region.force_n_per_nm[i];
            parts.push((region.active[i], force_n * force_n));
        }
        let squares: f64 = parts.iter().map(|part| part.1).sum();
        let error_m = squares.sqrt() / stiffness_n_per_m;
        let (joint, _) = *parts.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let interval = ErrorInterval {
            lower_m: LOWER_FACTOR * error_m,
            upper_m: (UPPER_FACTOR * error_m).hypot(region.reversal_n / stiffness_n_per_m),
            worst: (log, joint),
            residual_nm,
        };
        if worst.as_ref().is_none_or(|w| interval.upper_m > w.upper_m) {
            worst = Some(interval);
        }
    }
    worst
}

/// Returns the interval of the tracking error of the sinusoid at a stiffness for a controller with this model, from motions that
/// were not fitted, as [`error_interval`] does; `None` also if the arm cannot reach the sinusoid.
///
/// # Errors
/// If the description does not fit `N` joints.
pub fn error_interval_of<const N: usize>(
    identified: &Description,
    identified_joints: &[usize],
    held_out: &[&Motion],
    stiffness_n_per_m: f64,
) -> Result<Option<ErrorInterval>, ModelError> {
    let Some(region) = SinusoidRegion::<N>::new(identified)? else {
        return Ok(None);
    };
    let config = identified.config::<N>()?;
    let residual = |motion: &&Motion| feedforward_residual_nm(&config, identified_joints, motion);
    let residuals: Vec<_> = held_out.iter().map(residual).collect();
    let pairs: Vec<_> = held_out.iter().copied().zip(&residuals).collect();
    Ok(error_interval(
        &region,
        identified_joints,
        &pairs,
        stiffness_n_per_m,
    ))
}

/// Returns the torques of `identified_joints` in a motion beyond the feed-forward of a controller with the configuration
/// `config`, (samples, identified joints) \[N m\].
pub fn feedforward_residual_nm<const N: usize>(
    config: &Config<N>,
    identified_joints: &[usize],
    motion: &Motion,
) -> DMatrix<f64> {
    let feedforward = feedforward_nm(config, motion);
    DMatrix::from_fn(motion.samples(), identified_joints.len(), |sample, row| {
        motion.tau[(sample, identified_joints[row])] - feedforward[(sample, identified_joints[row])]
    })
}
