//! An excitation that tells the parameters of an arm apart, within what the arm may do.
//!
//! A Fourier series a joint ([`Fourier`]) is changed at random and kept when the criterion of its base
//! regressor has improved: an evolution strategy with one parent and one child, its step steered by the
//! rate of success. Every candidate is first shrunk until angles, joint speeds, tip speed, torques and
//! workspace are within their limits. The criterion is the condition number of the base regressor, columns
//! scaled to unit length, or minus the logarithm of the determinant of its information.

use crate::base::{Base, RANK_TOLERANCE};
use crate::columns::{Columns, FrictionColumns};
use crate::error::{IdentError, positive};
use crate::random::Random;
use crate::regressor::rows;
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};
use supple_core::dynamics::{jacobian, rnea, tip_pose};
use supple_core::trajectory::{Fourier, HARMONICS, JointReference};
use supple_core::{Config, Vector};

/// Share of the speed limits that a reference may use: the rest is the loop's.
const SPEED_SHARE: f64 = 0.8;
/// Share of the torque limits that model and friction may use.
const TORQUE_SHARE: f64 = 0.7;
/// Shrinkings tried before a candidate is given up.
const SHRINKINGS: usize = 60;
/// Points of a period at which a candidate is judged.
const POINTS: usize = 150;

/// Harmonics and shares of a speed that is nearly constant: they make it one at three Chebyshev nodes of
/// (0, 0.9) of their phase, and so nearly one between.
const STEADY: [(usize, f64); 3] = [(1, 1.218), (3, -0.279), (5, 0.072)];
/// Greatest sum of their sines by their order: 1.218 + 0.279 / 3 + 0.072 / 5.
const STEADY_WAY: f64 = 1.3254;

/// Candidates that are tried at most.
pub const MOST_CANDIDATES: usize = 1_000_000;
/// Longest motion \[s\].
pub const LONGEST_S: f64 = 7200.0;

/// What is to be small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Condition number of the base regressor, columns scaled to unit length.
    #[default]
    Condition,
    /// `-log det(Y' Y) / rank` of the base regressor: D-optimality.
    DOptimality,
}

/// A box that the tip stays in, base axes \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace {
    /// Least coordinates.
    pub lower_m: [f64; 3],
    /// Greatest coordinates.
    pub upper_m: [f64; 3],
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// Joints to excite, increasing; the others rest where they are held, or at home.
    pub moving: Vec<usize>,
    /// Length of a period \[s\].
    pub period_s: f64,
    /// Number of periods.
    pub periods: f64,
    /// What is to be small.
    pub criterion: Criterion,
    /// Where the tip must stay, if anywhere.
    pub workspace: Option<Workspace>,
    /// Candidates tried, at most [`MOST_CANDIDATES`].
    pub candidates: usize,
    /// Seed of the search.
    pub seed: u64,
}

impl Design {
    /// Four periods of 15 s of these joints, condition number, 3,000 candidates.
    pub fn of(moving: &[usize]) -> Design {
        Design {
            moving: moving.to_vec(),
            period_s: 15.0,
            periods: 4.0,
            criterion: Criterion::Condition,
            workspace: None,
            candidates: 3000,
            seed: 0,
        }
    }
}

/// A series and what it is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Designed<const N: usize> {
    /// The series.
    pub series: Fourier<N>,
    /// Rank of its base regressor.
    pub rank: usize,
    /// Condition number of its base regressor, columns scaled to unit length.
    pub condition: f64,
    /// Best value of the criterion after each candidate.
    pub history: Vec<f64>,
}

/// Searches. `progress` hears the number of candidates tried and the best value so far.
///
/// # Errors
/// Options out of range; limits so narrow that no candidate meets them.
pub fn design<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    request: &Design,
    progress: &mut dyn FnMut(usize, f64),
) -> Result<Designed<N>, IdentError> {
    positive("period_s", request.period_s)?;
    positive("periods", request.periods)?;
    positive("candidates", request.candidates as f64)?;
    if request.candidates > MOST_CANDIDATES {
        return Err(IdentError::Option {
            option: "candidates",
            value: request.candidates as f64,
            must: "at most 1000000",
        });
    }
    let duration_s = request.period_s * request.periods;
    if duration_s > LONGEST_S {
        return Err(IdentError::Option {
            option: "period_s times periods",
            value: duration_s,
            must: "at most 7200 s",
        });
    }
    let columns = Columns::new(N, &request.moving, true, FrictionColumns::COULOMB, &[])?;
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
    // A few independent starts before the best is refined.
    let starts = (request.candidates / 10).max(1);
    for tried in 0..request.candidates {
        let candidate = match &best {
            Some((parent, _)) if tried >= starts => search.changed(parent, step, &mut random),
            _ => search.fresh(&mut random),
        };
        let judged = search
            .shrunk(candidate)
            .map(|series| (search.criterion(&series), series));
        let improves = |value: f64| best.as_ref().is_none_or(|(_, least)| value < *least);
        let success = match judged {
            Some((value, series)) if value.is_finite() && improves(value) => {
                best = Some((series, value));
                true
            }
            _ => false,
        };
        if tried >= starts {
            // Stationary where one in five succeeds.
            step = (step * if success { 1.35 } else { 0.93 }).clamp(1e-3, 1.0);
        }
        let value = best.as_ref().map_or(f64::INFINITY, |(_, value)| *value);
        history.push(value);
        progress(tried + 1, value);
    }
    let Some((series, _)) = best else {
        return Err(IdentError::Singular {
            problem: "no motion tried meets the limits and moves every joint".to_owned(),
            remedy: "widen the joint ranges, the workspace or the speeds",
        });
    };
    let base = Base::of(&search.regressor(&series), RANK_TOLERANCE)?;
    Ok(Designed {
        series,
        rank: base.rank(),
        condition: base.condition,
        history,
    })
}

/// Slow motion of the same joints at constant low acceleration, for what friction does at low speed and
/// for torque ripple: each joint on a harmonic of its own, up to `speed_rad_per_s`.
///
/// # Errors
/// Options out of range.
pub fn slow_series<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    moving: &[usize],
    speed_rad_per_s: f64,
    period_s: f64,
) -> Result<Fourier<N>, IdentError> {
    positive("speed_rad_per_s", speed_rad_per_s)?;
    positive("period_s", period_s)?;
    let omega = TAU / period_s;
    let mut series = Fourier::at_rest(*home_rad, omega);
    for (order, &joint) in moving.iter().enumerate() {
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

/// Runs at constant speed, to and fro once, for torque ripple: each joint's speed stays within 1.5 % of
/// `speed_rad_per_s` over 57 % of a period and turns over smoothly in the rest. A joint whose range is too
/// short for that goes slower. The joints turn round one after the other.
///
/// # Errors
/// Options out of range.
pub fn constant_speed_series<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    moving: &[usize],
    speed_rad_per_s: f64,
    period_s: f64,
) -> Result<Fourier<N>, IdentError> {
    positive("speed_rad_per_s", speed_rad_per_s)?;
    positive("period_s", period_s)?;
    let omega = TAU / period_s;
    let mut series = Fourier::at_rest(*home_rad, omega);
    for (order, &joint) in moving.iter().enumerate() {
        let (lower, upper) = range(config, joint);
        let reach = 0.45 * (upper - lower);
        let amplitude = (speed_rad_per_s / omega).min(reach / STEADY_WAY);
        let phase = PI * order as f64 / moving.len() as f64;
        for (k, share) in STEADY {
            let (sine, cosine) = (k as f64 * phase).sin_cos();
            let size = amplitude * share / k as f64;
            series.sine_rad[k - 1][joint] = size * cosine;
            series.cosine_rad[k - 1][joint] = size * sine;
        }
        let way = STEADY_WAY * amplitude;
        series.centre_rad[joint] = home_rad[joint].clamp(lower + way, upper - way);
    }
    series.ramp_s = 0.05 * period_s;
    series.duration_s = period_s + series.ramp_s;
    Ok(series)
}

/// Range of a joint between its soft zones, a little inside.
fn range<const N: usize>(config: &Config<N>, joint: usize) -> (f64, f64) {
    let limits = &config.limits;
    let zone = 1.1 * limits.soft_zone_rad;
    (
        limits.position_lower_rad[joint] + zone,
        limits.position_upper_rad[joint] - zone,
    )
}

/// Columns that random motion of the moving joints tells apart.
fn structural_base<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    columns: &Columns,
) -> Result<Vec<usize>, IdentError> {
    let mut random = Random::new(1);
    let moving = columns.moving().len();
    let states = 4 * columns.len();
    let mut all = DMatrix::zeros(states * moving, columns.len());
    for i in 0..states {
        let mut draw = |scale: f64| Vector::<N>::from_fn(|_, _| scale * random.signed());
        let (anywhere, qd, qdd) = (draw(PI), draw(2.0), draw(4.0));
        let q = Vector::<N>::from_fn(|j, _| {
            let moves = columns.moving().contains(&j);
            if moves { anywhere[j] } else { home_rad[j] }
        });
        let block = rows(&config.arm, columns, &q, &qd, &qdd);
        all.rows_mut(i * moving, moving).copy_from(&block);
    }
    Ok(Base::of(&all, RANK_TOLERANCE)?.independent)
}

struct Search<'a, const N: usize> {
    config: &'a Config<N>,
    request: &'a Design,
    home_rad: &'a Vector<N>,
    independent: Vec<usize>,
    columns: Columns,
}

impl<const N: usize> Search<'_, N> {
    fn fresh(&self, random: &mut Random) -> Fourier<N> {
        let mut series = Fourier::at_rest(*self.home_rad, TAU / self.request.period_s);
        series.ramp_s = 0.1 * self.request.period_s;
        series.duration_s = self.request.periods * self.request.period_s + series.ramp_s;
        for &joint in &self.request.moving {
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

    fn changed(&self, parent: &Fourier<N>, step: f64, random: &mut Random) -> Fourier<N> {
        let mut series = *parent;
        for &joint in &self.request.moving {
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

    /// States at full pace over a period.
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

    /// Shrunk until every limit holds; `None` where that takes too much.
    fn shrunk(&self, mut series: Fourier<N>) -> Option<Fourier<N>> {
        let scale = |series: &mut Fourier<N>, joint: usize, by: f64| {
            for k in 0..HARMONICS {
                series.sine_rad[k][joint] *= by;
                series.cosine_rad[k][joint] *= by;
            }
        };
        // Each joint by itself: angle and speed are linear in its amplitudes.
        for &joint in &self.request.moving {
            let (lower, upper) = range(self.config, joint);
            let centre = series.centre_rad[joint];
            let limit = SPEED_SHARE * self.config.limits.joint_speed_rad_per_s[joint];
            let by = self.states(&series).fold(1.0_f64, |by, state| {
                let off = state.position_rad[joint] - centre;
                let room = if off > 0.0 {
                    upper - centre
                } else {
                    centre - lower
                };
                let speed = state.velocity_rad_per_s[joint].abs();
                by.min(room / off.abs().max(1e-12))
                    .min(limit / speed.max(1e-12))
            });
            scale(&mut series, joint, 0.999 * by);
        }
        for _ in 0..SHRINKINGS {
            let by = self
                .states(&series)
                .fold(1.0_f64, |by, state| by.min(self.room(&state)));
            if by >= 1.0 {
                return Some(series);
            }
            for &joint in &self.request.moving {
                scale(&mut series, joint, by.clamp(0.8, 0.99));
            }
        }
        None
    }

    /// Factor by which motion must shrink for tip speed, torques and workspace; 1 where they hold.
    fn room(&self, state: &JointReference<N>) -> f64 {
        let (config, limits) = (self.config, &self.config.limits);
        let (q, qd) = (&state.position_rad, &state.velocity_rad_per_s);
        let tip = jacobian(&config.arm, q).fixed_rows::<3>(0) * qd;
        let mut by = (SPEED_SHARE * limits.tip_speed_m_per_s / tip.norm().max(1e-12)).min(1.0);
        let torque = rnea(&config.arm, q, qd, &state.acceleration_rad_per_s2);
        for j in 0..N {
            let all = torque[j] + config.friction[j].torque_nm(qd[j]);
            if all.abs() > TORQUE_SHARE * limits.joint_torque_nm[j] {
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
        let moving = self.request.moving.len();
        let mut all = DMatrix::zeros(POINTS * moving, self.independent.len());
        for (i, state) in self.states(series).enumerate() {
            let (q, qd) = (&state.position_rad, &state.velocity_rad_per_s);
            let qdd = &state.acceleration_rad_per_s2;
            let block = rows(&self.config.arm, &self.columns, q, qd, qdd);
            all.rows_mut(i * moving, moving)
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
