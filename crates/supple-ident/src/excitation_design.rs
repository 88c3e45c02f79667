//! Design of exciting trajectories within the limits of the arm.
//!
//! A (1+1) evolution strategy mutates one Fourier series for each joint ([`Fourier`]) and keeps a mutation that
//! improves the criterion of the base regressor; the success rate controls its step size. The amplitudes of
//! every candidate are scaled down until angles, joint speeds, tip speed, torques and workspace are within
//! limits. The criterion is the condition number of the base regressor, columns scaled to unit length, or minus
//! the logarithm of the determinant of its information matrix.

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::columns::{Columns, FrictionColumns};
use crate::error::{IdentError, positive};
use crate::random::{Normal, Random};
use crate::regressor::rows;
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};
use supple_core::dynamics::{jacobian, rnea, tip_pose};
use supple_core::trajectory::{Fourier, HARMONICS, JointReference};
use supple_core::{Config, Vector};

/// Fraction of the speed limits available to the reference; the rest is margin for the control loop.
const SPEED_FRACTION: f64 = 0.8;
/// Fraction of the torque limits available to model and friction torques.
const TORQUE_FRACTION: f64 = 0.7;
/// Maximum number of scalings of a candidate before it is rejected.
const MAX_SCALINGS: usize = 60;
/// Points of a period at which a candidate is evaluated.
const POINTS: usize = 150;

/// Harmonics and amplitudes of a nearly constant speed: exactly one at three Chebyshev nodes of (0, 0.9) in
/// phase.
const CONSTANT_SPEED_HARMONICS: [(usize, f64); 3] = [(1, 1.218), (3, -0.279), (5, 0.072)];
/// Maximum sum of their sines divided by their order: 1.218 + 0.279 / 3 + 0.072 / 5.
const CONSTANT_SPEED_MAX_SUM: f64 = 1.3254;

/// Maximum number of candidates.
pub const MAX_CANDIDATES: usize = 1_000_000;
/// Maximum duration of a motion \[s\].
pub const MAX_DURATION_S: f64 = 7200.0;

/// Criterion to minimise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Condition number of the base regressor, columns scaled to unit length.
    #[default]
    Condition,
    /// `-log det(Y' Y) / rank` of the base regressor: D-optimality.
    DOptimality,
}

/// A box that the tip must not leave, base axes \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// Minimum coordinates.
    pub lower_m: [f64; 3],
    /// Maximum coordinates.
    pub upper_m: [f64; 3],
}

/// Options of the design.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignOptions {
    /// Joints to excite, in increasing order; the others rest at their held or home positions.
    pub excited_joints: Vec<usize>,
    /// Length of a period \[s\].
    pub period_s: f64,
    /// Number of periods.
    pub periods: f64,
    /// Criterion to minimise.
    pub criterion: Criterion,
    /// Workspace of the tip, if it is limited.
    pub workspace: Option<Workspace>,
    /// Number of candidates, at most [`MAX_CANDIDATES`].
    pub candidates: usize,
    /// Seed of the search.
    pub seed: u64,
}

impl DesignOptions {
    /// Returns the default options for these joints: four periods of 15 s, condition number, 3,000 candidates.
    pub fn new(excited_joints: &[usize]) -> DesignOptions {
        DesignOptions {
            excited_joints: excited_joints.to_vec(),
            period_s: 15.0,
            periods: 4.0,
            criterion: Criterion::Condition,
            workspace: None,
            candidates: 3000,
            seed: 0,
        }
    }
}

/// A designed series with its quality.
#[derive(Clone, Debug, PartialEq)]
pub struct ExcitationDesign<const N: usize> {
    /// The series.
    pub series: Fourier<N>,
    /// Rank of the regressor.
    pub rank: usize,
    /// Condition number of its base regressor, columns scaled to unit length.
    pub condition: f64,
    /// Best value of the criterion after each candidate.
    pub history: Vec<f64>,
}

/// Runs the search; `progress` receives the number of candidates and the best value so far.
///
/// # Errors
/// Options out of range; limits that no candidate meets.
pub fn design<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    request: &DesignOptions,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<ExcitationDesign<N>, IdentError> {
    positive("period_s", request.period_s)?;
    positive("periods", request.periods)?;
    positive("candidates", request.candidates as f64)?;
    if request.candidates > MAX_CANDIDATES {
        return Err(IdentError::Option {
            option: "candidates",
            value: request.candidates as f64,
            must: "at most 1000000",
        });
    }
    let duration_s = request.period_s * request.periods;
    if duration_s > MAX_DURATION_S {
        return Err(IdentError::Option {
            option: "period_s times periods",
            value: duration_s,
            must: "at most 7200 s",
        });
    }
    let columns = Columns::new(
        N,
        &request.excited_joints,
        true,
        FrictionColumns::COULOMB,
        &[],
    )?;
    let search = Search {
        config,
        request,
        home_rad,
        independent: structural_base(config, home_rad, &columns)?,
        columns,
    };
    let mut random = Random::new(request.seed);
    let mut best: Option<(Fourier<N>, f64)> = None;
    let mut history = Vec::with_capacity(request.candidates);
    let mut step = 0.3;
    // The first candidates are independent random ones; the later ones refine the best.
    let starts = (request.candidates / 10).max(1);
    for tried in 0..request.candidates {
        let candidate = match &best {
            Some((parent, _)) if tried >= starts => search.mutated(parent, step, &mut random),
            _ => search.random_candidate(&mut random),
        };
        let evaluated = search
            .scaled_to_limits(candidate)
            .map(|series| (search.criterion(&series), series));
        let improves = |value: f64| best.as_ref().is_none_or(|(_, lowest)| value < *lowest);
        let success = match evaluated {
            Some((value, series)) if value.is_finite() && improves(value) => {
                best = Some((series, value));
                true
            }
            _ => false,
        };
        if tried >= starts {
            // 1/5 success rule.
            step = (step * if success { 1.35 } else { 0.93 }).clamp(1e-3, 1.0);
        }
        let value = best.as_ref().map_or(f64::INFINITY, |(_, value)| *value);
        history.push(value);
        progress(tried + 1, value);
    }
    let Some((series, _)) = best else {
        return Err(IdentError::Singular {
            problem: "no candidate motion meets the limits and moves every joint".to_owned(),
            remedy: "widen the joint ranges, the workspace or the speeds",
        });
    };
    let base = BaseParameters::from_regressor(&search.regressor(&series), RANK_TOLERANCE)?;
    Ok(ExcitationDesign {
        series,
        rank: base.rank(),
        condition: base.condition,
        history,
    })
}

/// Returns the slow sinusoidal motion for friction at low speed and torque ripple: neighbouring joints use different
/// harmonics, with speeds up to `speed_rad_per_s`.
///
/// # Errors
/// Options out of range.
pub fn slow_series<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    excited_joints: &[usize],
    speed_rad_per_s: f64,
    period_s: f64,
) -> Result<Fourier<N>, IdentError> {
    positive("speed_rad_per_s", speed_rad_per_s)?;
    positive("period_s", period_s)?;
    let omega = TAU / period_s;
    let mut series = Fourier::at_rest(*home_rad, omega);
    for (order, &joint) in excited_joints.iter().enumerate() {
        let k = order % 3;
        let (lower, upper) = range(config, joint);
        let reach = 0.45 * (upper - lower);
        let amplitude = (speed_rad_per_s / ((k + 1) as f64 * omega)).min(reach);
        series.sine_rad[k][joint] = amplitude;
        series.centre_rad[joint] = home_rad[joint].clamp(lower + amplitude, upper - amplitude);
    }
    series.ramp_s = 0.05 * period_s;
    series.duration_s = period_s + series.ramp_s;
    Ok(series)
}

/// Returns the motion in each direction at nearly constant speed, for torque ripple: each joint's speed stays within 1.5 % of
/// `speed_rad_per_s` over 57 % of a period and reverses smoothly in the rest. A joint with a short range
/// moves more slowly. The joints reverse one after the other.
///
/// # Errors
/// Options out of range.
pub fn constant_speed_series<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    excited_joints: &[usize],
    speed_rad_per_s: f64,
    period_s: f64,
) -> Result<Fourier<N>, IdentError> {
    positive("speed_rad_per_s", speed_rad_per_s)?;
    positive("period_s", period_s)?;
    let omega = TAU / period_s;
    let mut series = Fourier::at_rest(*home_rad, omega);
    for (order, &joint) in excited_joints.iter().enumerate() {
        let (lower, upper) = range(config, joint);
        let reach = 0.45 * (upper - lower);
        let amplitude = (speed_rad_per_s / omega).min(reach / CONSTANT_SPEED_MAX_SUM);
        let phase = PI * order as f64 / excited_joints.len() as f64;
        for (k, weight) in CONSTANT_SPEED_HARMONICS {
            let (sine, cosine) = (k as f64 * phase).sin_cos();
            let size = amplitude * weight / k as f64;
            series.sine_rad[k - 1][joint] = size * cosine;
            series.cosine_rad[k - 1][joint] = size * sine;
        }
        let travel = CONSTANT_SPEED_MAX_SUM * amplitude;
        series.centre_rad[joint] = home_rad[joint].clamp(lower + travel, upper - travel);
    }
    series.ramp_s = 0.05 * period_s;
    series.duration_s = period_s + series.ramp_s;
    Ok(series)
}

/// Returns the range of a joint between its soft zones, with a margin.
fn range<const N: usize>(config: &Config<N>, joint: usize) -> (f64, f64) {
    let limits = &config.limits;
    let zone = 1.1 * limits.soft_zone_rad;
    (
        limits.position_lower_rad[joint] + zone,
        limits.position_upper_rad[joint] - zone,
    )
}

/// Returns the independent columns of the regressor for random motion of the excited joints.
fn structural_base<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    columns: &Columns,
) -> Result<Vec<usize>, IdentError> {
    let mut random = Random::new(1);
    let joint_count = columns.identified_joints().len();
    let states = 4 * columns.len();
    let mut all = DMatrix::zeros(states * joint_count, columns.len());
    for i in 0..states {
        let mut draw = |scale: f64| Vector::<N>::from_fn(|_, _| scale * random.signed());
        let (anywhere, qd, qdd) = (draw(PI), draw(2.0), draw(4.0));
        let q = Vector::<N>::from_fn(|j, _| {
            let moves = columns.identified_joints().contains(&j);
            if moves { anywhere[j] } else { home_rad[j] }
        });
        let block = rows(&config.arm, columns, &q, &qd, &qdd);
        all.rows_mut(i * joint_count, joint_count).copy_from(&block);
    }
    Ok(BaseParameters::from_regressor(&all, RANK_TOLERANCE)?.independent)
}

struct Search<'a, const N: usize> {
    config: &'a Config<N>,
    request: &'a DesignOptions,
    home_rad: &'a Vector<N>,
    independent: Vec<usize>,
    columns: Columns,
}

impl<const N: usize> Search<'_, N> {
    fn random_candidate(&self, random: &mut Random) -> Fourier<N> {
        let mut series = Fourier::at_rest(*self.home_rad, TAU / self.request.period_s);
        series.ramp_s = 0.1 * self.request.period_s;
        series.duration_s = self.request.periods * self.request.period_s + series.ramp_s;
        for &joint in &self.request.excited_joints {
            let (lower, upper) = range(self.config, joint);
            series.centre_rad[joint] = lower + (upper - lower) * (0.3 + 0.4 * random.uniform());
            for k in 0..HARMONICS {
                let size = 0.3 * (upper - lower) / (k + 1) as f64;
                series.sine_rad[k][joint] = size * random.normal();
                series.cosine_rad[k][joint] = size * random.normal();
            }
        }
        series
    }

    fn mutated(&self, parent: &Fourier<N>, step: f64, random: &mut Random) -> Fourier<N> {
        let mut series = *parent;
        for &joint in &self.request.excited_joints {
            let (lower, upper) = range(self.config, joint);
            let span = upper - lower;
            let centre = series.centre_rad[joint] + 0.2 * step * span * random.normal();
            series.centre_rad[joint] = centre.clamp(lower + 0.1 * span, upper - 0.1 * span);
            for k in 0..HARMONICS {
                let size = step * 0.3 * span / (k + 1) as f64;
                series.sine_rad[k][joint] += size * random.normal();
                series.cosine_rad[k][joint] += size * random.normal();
            }
        }
        series
    }

    /// Returns the reference states over one period at full speed.
    fn states(&self, series: &Fourier<N>) -> impl Iterator<Item = JointReference<N>> {
        let (series, period_s) = (*series, series.period_s());
        let steady = Fourier {
            duration_s: 3.0 * period_s,
            ..series
        };
        (0..POINTS).map(move |i| {
            let into = steady.ramp_s + period_s * i as f64 / POINTS as f64;
            steady.at(into)
        })
    }

    /// Scales the amplitudes down until every limit holds; `None` after too many scalings.
    fn scaled_to_limits(&self, mut series: Fourier<N>) -> Option<Fourier<N>> {
        let scale = |series: &mut Fourier<N>, joint: usize, by: f64| {
            for k in 0..HARMONICS {
                series.sine_rad[k][joint] *= by;
                series.cosine_rad[k][joint] *= by;
            }
        };
        // Joint by joint: angle and speed are linear in the joint's amplitudes.
        for &joint in &self.request.excited_joints {
            let (lower, upper) = range(self.config, joint);
            let centre = series.centre_rad[joint];
            let limit = SPEED_FRACTION * self.config.limits.joint_speed_rad_per_s[joint];
            let by = self.states(&series).fold(1.0_f64, |by, state| {
                let off = state.position_rad[joint] - centre;
                let margin = if off > 0.0 {
                    upper - centre
                } else {
                    centre - lower
                };
                let speed = state.velocity_rad_per_s[joint].abs();
                by.min(margin / off.abs().max(1e-12))
                    .min(limit / speed.max(1e-12))
            });
            scale(&mut series, joint, 0.999 * by);
        }
        for _ in 0..MAX_SCALINGS {
            let by = self
                .states(&series)
                .fold(1.0_f64, |by, state| by.min(self.limit_scale(&state)));
            if by >= 1.0 {
                return Some(series);
            }
            for &joint in &self.request.excited_joints {
                scale(&mut series, joint, by.clamp(0.8, 0.99));
            }
        }
        None
    }

    /// Returns the scale factor that tip speed, torques and workspace require; 1 if their limits hold.
    fn limit_scale(&self, state: &JointReference<N>) -> f64 {
        let (config, limits) = (self.config, &self.config.limits);
        let (q, qd) = (&state.position_rad, &state.velocity_rad_per_s);
        let tip = jacobian(&config.arm, q).fixed_rows::<3>(0) * qd;
        let mut by = (SPEED_FRACTION * limits.tip_speed_m_per_s / tip.norm().max(1e-12)).min(1.0);
        let torque = rnea(&config.arm, q, qd, &state.acceleration_rad_per_s2);
        for j in 0..N {
            let all = torque[j] + config.friction[j].torque_nm(qd[j]);
            if all.abs() > TORQUE_FRACTION * limits.joint_torque_nm[j] {
                by = by.min(0.95);
            }
        }
        if let Some(workspace) = &self.request.workspace {
            let tip = tip_pose(&config.arm, q).translation;
            let outside = (0..3).any(|axis| {
                !(workspace.lower_m[axis]..=workspace.upper_m[axis]).contains(&tip[axis])
            });
            if outside {
                by = by.min(0.9);
            }
        }
        by
    }

    fn regressor(&self, series: &Fourier<N>) -> DMatrix<f64> {
        let joint_count = self.request.excited_joints.len();
        let mut all = DMatrix::zeros(POINTS * joint_count, self.independent.len());
        for (i, state) in self.states(series).enumerate() {
            let (q, qd) = (&state.position_rad, &state.velocity_rad_per_s);
            let qdd = &state.acceleration_rad_per_s2;
            let block = rows(&self.config.arm, &self.columns, q, qd, qdd);
            all.rows_mut(i * joint_count, joint_count)
                .copy_from(&block.select_columns(&self.independent));
        }
        all
    }

    fn criterion(&self, series: &Fourier<N>) -> f64 {
        let a = self.regressor(series);
        let mut gram = a.tr_mul(&a);
        let n = gram.nrows();
        match self.request.criterion {
            Criterion::Condition => {
                let lengths: Vec<f64> = (0..n).map(|i| gram[(i, i)].sqrt()).collect();
                if lengths.contains(&0.0) {
                    return f64::INFINITY;
                }
                for i in 0..n {
                    for j in 0..n {
                        gram[(i, j)] /= lengths[i] * lengths[j];
                    }
                }
                let values = gram.symmetric_eigenvalues();
                if values.min() <= 0.0 {
                    return f64::INFINITY;
                }
                (values.max() / values.min()).sqrt()
            }
            Criterion::DOptimality => match nalgebra::Cholesky::new(gram) {
                Some(root) => -root.ln_determinant() / n as f64,
                None => f64::INFINITY,
            },
        }
    }
}
