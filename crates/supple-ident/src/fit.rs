//! Fits a model to prepared motions: regressor rows, weights, solution, statistics.

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::columns::{Column, Columns};
use crate::constrained_least_squares::{Constraints, solve};
use crate::effect_rows;
use crate::error::{IdentError, Warning, shape_error};
use crate::estimate::{huber_weights, nearest, noise_nm, weighted, weighted_least_squares};
use crate::joint_rows::JointRows;
use crate::model;
use crate::motion::{Motion, Preparation};
pub use crate::options::{Options, Weights};
use crate::qr_reduction::ReducedSystem;
use crate::random::Random;
use crate::regressor::{joint_rows, rows_under_load};
use crate::selection_result::SelectionResult;
use nalgebra::{DMatrix, DVector};
use supple_core::dynamics::{regressor, regressor_times};
use supple_core::friction::LoadTorque;
use supple_core::learned::LearnedTerms;
use supple_core::{Arm, Config, Friction, Vector};

/// Minimum number of samples of a joint.
const MIN_ROWS: usize = 20;

/// Smallest eigenvalue of the scaled normal equations of the slow samples from which their torques are determined.
const LEAST_INFORMATION: f64 = 1e-4;

/// Number of equal intervals of speed that have the same weight in the fit of slow motion.
const SPEED_BINS: usize = 15;
/// Greatest weight of one of their samples, so that a few samples do not count for all.
const MAX_SPEED_WEIGHT: f64 = 10.0;
/// Part of the Stribeck effect that a direction must have shown in [`MIN_ROWS`] samples; less would be extrapolated by its inverse.
const SEEN_SHARE: f64 = 0.3;

/// Maximum number of reweighting iterations.
const MAX_REWEIGHTINGS: usize = 5;
/// Number of fixed-point passes of a prediction for a motor whose friction depends on its own torque.
const LOAD_PASSES: usize = 4;

/// Weight of the prior of an effect: the square root of the number of samples that it counts for. Errors of the model are
/// correlated over many samples.
const EFFECT_PRIOR_WEIGHT: f64 = 50.0;
/// Offset of a joint without a cost, in proportion to its Coulomb friction: differences of friction by direction and small currents of
/// amplifiers are as large. Gravity and springs can nearly cancel a greater one in a motion, and not elsewhere.
const OFFSET_FREE_SHARE: f64 = 0.1;
/// A joint's offset has no cost if the joint's residual with the cost is more than this multiple of that without it.
const OFFSET_SHOWN: f64 = 1.5;
/// Share of the Coulomb friction in the prior standard deviation of the offset beyond [`OFFSET_FREE_SHARE`].
const OFFSET_DRY_SHARE: f64 = 0.4;
/// Share of the root mean square torque in the same.
const OFFSET_TORQUE_SHARE: f64 = 0.005;

/// An identified model.
#[derive(Clone, Debug)]
pub struct Fit<const N: usize> {
    /// Regressor columns.
    pub columns: Columns,
    /// Parameter of each column.
    pub x: DVector<f64>,
    /// Combinations that the data determine, with rank and condition number.
    pub base: BaseParameters,
    /// Standard deviation of each base parameter.
    pub base_std: DVector<f64>,
    /// RMS residual of each identified joint \[N m\].
    pub noise_nm: Vec<f64>,
    /// Upper bound on the distance of the objective from its optimum, for a consistent fit.
    pub optimality_gap: Option<f64>,
    /// `|tau - tau_hat| / |tau|` over the fitted samples.
    pub training_relative: f64,
    /// Preparation of validation logs.
    pub preparation: Preparation,
    /// Options selected by cross-validation, in order.
    pub choices: Vec<SelectionResult>,
    /// Warnings.
    pub warnings: Vec<Warning>,
    /// Load \[N m\] of each identified joint at which load-dependent friction best matches load-independent
    /// friction over the fitted samples; zero without load columns.
    pub load_nm: Vec<f64>,
    /// Travel of each joint of the arm over which its dry friction reverses after a reversal of motion \[rad\]; zero if the
    /// data do not determine it, see [`crate::presliding_rad`].
    pub presliding_rad: Vec<f64>,
    /// Standard deviation of the weighted residuals, corrected for the correlation that the filter introduces.
    spread: f64,
    nominal: Arm<N>,
}

/// Fits `motions` of an arm, for the joints `identified_joints`. Undetermined parameters are regularised
/// towards `nominal`.
///
/// # Errors
/// Invalid columns or shapes; errors of the solver.
pub fn fit<const N: usize>(
    nominal: &Arm<N>,
    motions: &[Motion],
    identified_joints: &[usize],
    options: &Options,
) -> Result<Fit<N>, IdentError> {
    let columns = Columns::new(
        N,
        identified_joints,
        options.rotor,
        options.friction,
        &options.couplings,
    )?
    .with_effects(&options.effects);
    let parts = motions
        .iter()
        .map(|motion| joint_rows(nominal, &columns, motion));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    let independent_fraction = motions
        .iter()
        .map(|m| m.independent_fraction)
        .fold(1.0, f64::min);
    fit_rows(nominal, columns, &parts, independent_fraction, options)
}

/// Does the same as [`fit`], from given rows: for each part of the data, one [`JointRows`] per identified joint.
///
/// # Errors
/// As [`fit`].
pub fn fit_rows<const N: usize>(
    nominal: &Arm<N>,
    columns: Columns,
    parts: &[Vec<JointRows>],
    independent_fraction: f64,
    options: &Options,
) -> Result<Fit<N>, IdentError> {
    options.cancellation.check()?;
    let second_stage =
        options.slow_rad_per_s > 0.0 && options.friction.stribeck_rad_per_s.is_some();
    let used: Vec<usize> = (0..columns.len())
        .filter(|i| !(second_stage && columns.list()[*i].is_of_slow_motion()))
        .collect();
    let stage = FitStage {
        columns: &columns,
        used: &used,
        parts,
        options,
        prior: model::prior(nominal, &columns).select_rows(&used),
        links: model::link_parameters::<N>(&model::prior(nominal, &columns)).to_vec(),
    };
    let blocks = stage.blocks(None);
    // A joint with too few rows has undetermined friction and rotor inertia; reject it.
    for (block, joint) in blocks.iter().zip(columns.identified_joints()) {
        if block.rows() < MIN_ROWS {
            let slow = options.slow_rad_per_s;
            return Err(IdentError::Log {
                column: format!("q[{joint}]"),
                problem: format!("has {} samples faster than {slow} rad/s", block.rows()),
                remedy: "move the joint faster, lower slow_rad_per_s, or leave it out of the moving joints",
            });
        }
    }
    let rows: usize = blocks.iter().map(ReducedSystem::rows).sum();
    if rows < used.len() {
        return Err(shape_error(
            "log",
            format!("at least {} rows above slow_rad_per_s", used.len()),
            format!("{rows}"),
        ));
    }
    let (solution, blocks, noise, gap) = stage.solve(&blocks)?;
    let stacked = weighted(&blocks, &noise, used.len());
    let base = BaseParameters::from_regressor(&stacked.a(), RANK_TOLERANCE)?;
    let freedom = (rows - base.rank().min(rows - 1)) as f64 * independent_fraction;
    let spread = (stacked.error_squared(&solution) / freedom.max(1.0)).sqrt();
    let base_std = base.standard_deviations(spread);
    let mut x = DVector::zeros(columns.len());
    used.iter()
        .enumerate()
        .for_each(|(k, i)| x[*i] = solution[k]);
    if second_stage {
        fit_stribeck(&columns, parts, &mut x);
    }
    let error: f64 = blocks.iter().map(|b| b.error_squared(&solution)).sum();
    let torque: f64 = blocks.iter().map(ReducedSystem::torque_squared).sum();
    Ok(Fit {
        training_relative: (error / torque).sqrt(),
        preparation: Preparation::default(),
        choices: Vec::new(),
        warnings: Vec::new(),
        spread,
        base: base.renumbered(&used),
        base_std,
        noise_nm: noise_nm(&blocks, &solution),
        load_nm: load_torques_nm(&columns, parts),
        presliding_rad: vec![0.0; N],
        columns,
        x,
        optimality_gap: gap,
        nominal: *nominal,
    })
}

/// Returns the prior mean and standard deviation of an effect's column.
fn effect_prior(column: &Column) -> Option<(f64, f64)> {
    match column {
        Column::Spring(_) => Some((0.0, 0.2)),
        Column::Compliance(_) => Some((0.33, 0.33)),
        Column::MotorCoulomb(_) | Column::MotorViscous(_) => Some((0.0, 0.5)),
        Column::Tilt(_) => Some((0.0, 0.005)),
        Column::TorqueScale(_) => Some((0.0, 0.03)),
        _ => None,
    }
}

struct FitStage<'a> {
    columns: &'a Columns,
    used: &'a [usize],
    parts: &'a [Vec<JointRows>],
    options: &'a Options,
    prior: DVector<f64>,
    links: Vec<nalgebra::SVector<f64, 10>>,
}

/// Previous solution, and the joints whose offsets have a cost.
type OffsetCosts<'a> = (&'a DVector<f64>, &'a [bool]);
type StageSolution = (DVector<f64>, Vec<ReducedSystem>, Vec<f64>, Option<f64>);

impl FitStage<'_> {
    /// Returns one reduced system for each joint, over all parts.
    fn blocks(&self, weights: Option<&[Vec<Vec<f64>>]>) -> Vec<ReducedSystem> {
        let joints = self.columns.identified_joints().len();
        let of_joint = |j: usize| {
            let mut all = ReducedSystem::empty(self.used.len());
            for (p, part) in self.parts.iter().enumerate() {
                let weights = weights.map(|w| &w[p][j][..]);
                let slow = self.options.slow_rad_per_s;
                let block = match weights {
                    None => part[j].block(slow),
                    some => part[j].reduced(slow, some),
                };
                all.add(&block.select(self.used), 1.0);
            }
            all
        };
        (0..joints).map(of_joint).collect()
    }

    /// Solves with a cost of great offsets; without it for joints whose motion shows such an offset.
    fn solve(&self, blocks: &[ReducedSystem]) -> Result<StageSolution, IdentError> {
        let mut costs = vec![self.has_offset_costs(); blocks.len()];
        loop {
            let solution = self.reweighted(blocks.to_vec(), &costs)?;
            let (x, blocks, noise, _) = &solution;
            let is_great = |(cost, joint): (&bool, &usize)| {
                let offset = self.offset_and_coulomb_nm(*joint, x);
                *cost
                    && offset.is_some_and(|(offset_nm, coulomb_nm)| {
                        offset_nm.abs() > OFFSET_FREE_SHARE * coulomb_nm
                    })
            };
            let joints = self.columns.identified_joints();
            if !costs.iter().zip(joints).any(is_great) {
                return Ok(solution);
            }
            let without = self.step(blocks, noise, None)?.0;
            let residuals = noise_nm(blocks, x)
                .into_iter()
                .zip(noise_nm(blocks, &without));
            let mut changed = false;
            for (cost, (with_nm, without_nm)) in costs.iter_mut().zip(residuals) {
                let shown = *cost && with_nm > OFFSET_SHOWN * without_nm;
                changed |= shown;
                *cost &= !shown;
            }
            if !changed {
                return Ok(solution);
            }
        }
    }

    /// Returns whether great offsets have a cost in this fit: it has offsets, and is physically consistent.
    fn has_offset_costs(&self) -> bool {
        let offsets = self.columns.friction().offset;
        offsets && self.options.consistent_prior_weight.is_some()
    }

    /// Solves with repeated weights. `offset_costs`: the joints whose offsets have a cost.
    fn reweighted(
        &self,
        mut blocks: Vec<ReducedSystem>,
        offset_costs: &[bool],
    ) -> Result<StageSolution, IdentError> {
        let joints = blocks.len();
        let mut noise = match &self.options.weights {
            Weights::Equal => vec![1.0; joints],
            Weights::Given(noise) if noise.len() == joints => noise.clone(),
            Weights::Given(noise) => {
                let expected = format!("{joints} values, one for each moving joint");
                return Err(shape_error("weights", expected, format!("{}", noise.len())));
            }
            Weights::ByJointResidual | Weights::Huber => {
                weighted_least_squares(&blocks, &self.prior)?.1
            }
        };
        let (mut x, mut gap) = self.step(&blocks, &noise, None)?;
        if matches!(
            self.options.weights,
            Weights::ByJointResidual | Weights::Huber
        ) {
            for _ in 0..MAX_REWEIGHTINGS {
                self.options.cancellation.check()?;
                if self.options.weights == Weights::Huber {
                    let mut full = DVector::zeros(self.columns.len());
                    self.used
                        .iter()
                        .enumerate()
                        .for_each(|(k, i)| full[*i] = x[k]);
                    let weights = self.parts.iter().map(|part| huber_weights(part, &full));
                    blocks = self.blocks(Some(&weights.collect::<Vec<_>>()));
                }
                let next = noise_nm(&blocks, &x);
                let change = next.iter().zip(&noise).map(|(a, b)| (a / b - 1.0).abs());
                let settled = change.fold(0.0, f64::max) < 1e-3;
                noise = next;
                (x, gap) = self.step(&blocks, &noise, Some((&x, offset_costs)))?;
                if settled {
                    break;
                }
            }
        }
        if matches!(self.options.weights, Weights::Equal | Weights::Given(_)) {
            if self.options.weights == Weights::Equal {
                noise = equal_noise(&blocks, &x);
            }
            (x, gap) = self.step(&blocks, &noise, Some((&x, offset_costs)))?;
        }
        Ok((x, blocks, noise, gap))
    }

    /// Returns the prior mean and standard deviation of a rotor's inertia.
    fn rotor_prior(&self, unknown: usize, column: &Column) -> Option<(f64, f64)> {
        let nominal = self.prior[unknown];
        let is_rotor = matches!(column, Column::Rotor(_)) && nominal > 0.0;
        let relative = self.options.rotor_deviation.filter(|_| is_rotor)?;
        Some((nominal, relative * nominal))
    }

    /// Returns the prior mean and standard deviation of friction by load, in fits with a prior: under a nearly constant load it is
    /// not told apart from Coulomb friction.
    fn load_prior(&self, column: &Column) -> Option<(f64, f64)> {
        let has_prior = self.options.consistent_prior_weight.is_some();
        (has_prior && matches!(column, Column::Load(_))).then_some((0.0, 0.1))
    }

    /// Returns a joint's offset and the magnitude of its Coulomb friction in `x`.
    fn offset_and_coulomb_nm(&self, joint: usize, x: &DVector<f64>) -> Option<(f64, f64)> {
        let value = |column| {
            let column = self.columns.position(column)?;
            Some(x[self.used.binary_search(&column).ok()?])
        };
        let offset_nm = value(Column::Offset(joint))?;
        Some((offset_nm, value(Column::Coulomb(joint))?.abs()))
    }

    /// Returns the prior mean and standard deviation of an offset that has a cost: from the previous solution, so that repeated
    /// solutions have a cost only of what is beyond [`OFFSET_FREE_SHARE`].
    fn offset_prior(
        &self,
        column: &Column,
        blocks: &[ReducedSystem],
        offset_costs: Option<OffsetCosts>,
    ) -> Option<(f64, f64)> {
        let (Column::Offset(joint), Some((x, costs))) = (column, offset_costs) else {
            return None;
        };
        let identified = self.columns.identified_joints();
        let row = identified.iter().position(|j| j == joint)?;
        if !costs[row] {
            return None;
        }
        let (offset_nm, coulomb_nm) = self.offset_and_coulomb_nm(*joint, x)?;
        let free_nm = OFFSET_FREE_SHARE * coulomb_nm;
        let mean_nm = offset_nm.clamp(-free_nm, free_nm);
        let block = &blocks[row];
        let torque_nm = (block.torque_squared() / block.rows() as f64).sqrt();
        let deviation_nm = OFFSET_DRY_SHARE * coulomb_nm + OFFSET_TORQUE_SHARE * torque_nm;
        (deviation_nm > 0.0).then_some((mean_nm, deviation_nm))
    }

    /// Returns the rows of the prior of effects, friction by load, rotors and offsets.
    fn effect_prior(
        &self,
        blocks: &[ReducedSystem],
        offset_costs: Option<OffsetCosts>,
    ) -> DMatrix<f64> {
        let known = self.used.iter().enumerate().filter_map(|(k, i)| {
            let column = &self.columns.list()[*i];
            let prior = effect_prior(column)
                .or_else(|| self.load_prior(column))
                .or_else(|| self.offset_prior(column, blocks, offset_costs));
            let (mean, deviation) = prior.or_else(|| self.rotor_prior(k, column))?;
            Some((k, mean, EFFECT_PRIOR_WEIGHT / deviation))
        });
        let known: Vec<_> = known.collect();
        let mut rows = DMatrix::zeros(known.len(), self.used.len() + 1);
        for (row, (k, mean, weight)) in known.into_iter().enumerate() {
            rows[(row, k)] = weight;
            rows[(row, self.used.len())] = weight * mean;
        }
        rows
    }

    fn step(
        &self,
        blocks: &[ReducedSystem],
        noise: &[f64],
        offset_costs: Option<OffsetCosts>,
    ) -> Result<(DVector<f64>, Option<f64>), IdentError> {
        let mut stacked = weighted(blocks, noise, self.used.len());
        stacked.append(&self.effect_prior(blocks, offset_costs), 0);
        let Some(prior_weight) = self.options.consistent_prior_weight else {
            return Ok((nearest(&stacked, &self.prior)?, None));
        };
        let index_of = |i: &usize| self.used.binary_search(i).ok();
        let forms = self.columns.not_negative().into_iter();
        let solution = solve(
            &stacked,
            &Constraints {
                links: self.links.clone(),
                not_negative: forms
                    .filter_map(|form| {
                        let form = form.into_iter().map(|(i, c)| Some((index_of(&i)?, c)));
                        form.collect::<Option<Vec<_>>>()
                    })
                    .collect(),
                prior_weight,
                tolerance: 1e-9,
            },
        )?;
        Ok((solution.x, Some(solution.optimality_gap)))
    }
}

/// Returns for each identified joint the multiple of its Coulomb column that is nearest to its load column.
fn load_torques_nm(columns: &Columns, parts: &[Vec<JointRows>]) -> Vec<f64> {
    let of_joint = |(row, &joint): (usize, &usize)| {
        let indices = [Column::Load(joint), Column::Coulomb(joint)].map(|c| columns.position(c));
        let [Some(load), Some(dry)] = indices else {
            return 0.0;
        };
        let (mut product, mut square) = (0.0, 0.0);
        for part in parts {
            let dry = part[row].a.column(dry);
            product += dry.dot(&part[row].a.column(load));
            square += dry.norm_squared();
        }
        product / square.max(f64::MIN_POSITIVE)
    };
    columns
        .identified_joints()
        .iter()
        .enumerate()
        .map(of_joint)
        .collect()
}

/// Returns the same noise for all joints, so that the residuals, relative to which the prior is weighted, are about one.
fn equal_noise(blocks: &[ReducedSystem], x: &DVector<f64>) -> Vec<f64> {
    let squares: f64 = noise_nm(blocks, x).iter().map(|n| n * n).sum();
    vec![(squares / blocks.len() as f64).sqrt(); blocks.len()]
}

/// Second stage: fits `B >= |O|` of each joint to samples below three Stribeck speeds in steady sliding outside
/// the band. Inside the band the friction law is a parabola through zero, but real friction persists until standstill,
/// which would bias the estimate. A constant is fitted together with them and discarded: it absorbs gravity errors.
fn fit_stribeck(columns: &Columns, parts: &[Vec<JointRows>], x: &mut DVector<f64>) {
    let reach = 3.0 * columns.friction().stribeck_rad_per_s.unwrap_or(0.0);
    let band = columns.friction().band_rad_per_s;
    for (row, &joint) in columns.identified_joints().iter().enumerate() {
        let Some(stribeck) = columns.position(Column::Stribeck(joint)) else {
            continue;
        };
        let offset = columns.position(Column::StribeckOffset(joint));
        let (mut shapes, mut torques_nm, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts {
            let part = &part[row];
            let residual = &part.b - &part.a * &*x;
            for i in (0..residual.len()).filter(|i| part.is_slow_sliding(*i, &(band..=reach))) {
                shapes.push([stribeck, offset.unwrap_or(stribeck)].map(|c| part.a[(i, c)]));
                torques_nm.push(residual[i]);
                speeds.push(part.speed[i]);
            }
        }
        if shapes.len() < MIN_ROWS {
            continue;
        }
        let weights = speed_weights(&speeds, reach);
        // Each column is this sum of the shapes of `B` and `O`. The mean of the residuals is a nuisance.
        let fitted = |columns: &[[f64; 2]]| {
            let a = DMatrix::from_fn(shapes.len(), 1 + columns.len(), |i, c| {
                let shape = c.checked_sub(1).map_or(1.0, |c| {
                    columns[c][0] * shapes[i][0] + columns[c][1] * shapes[i][1]
                });
                weights[i].sqrt() * shape
            });
            let b = torques_nm.iter().zip(&weights);
            normal_solution(
                &a,
                &b.map(|(nm, weight)| nm * weight.sqrt()).collect::<Vec<_>>(),
            )
        };
        // The excess of each direction, B + O and B - O, is not negative.
        let (positive, negative) = ([0.5, 0.5], [0.5, -0.5]);
        let both = offset.and_then(|_| fitted(&[positive, negative]));
        let alone = |column: [f64; 2]| fitted(&[column]).map_or(0.0, |x| x[1].max(0.0));
        let excess_nm = both.map(|both| match (both[1] < 0.0, both[2] < 0.0) {
            (false, false) => [both[1], both[2]],
            (false, true) => [alone(positive), 0.0],
            (true, false) => [0.0, alone(negative)],
            (true, true) => [0.0; 2],
        });
        // What gears show is below the Coulomb friction.
        let coulomb = columns.position(Column::Coulomb(joint));
        let most_nm = coulomb.map_or(0.0, |c| x[c].max(0.0));
        let is_seen = |sign: f64| {
            let seen = shapes.iter().filter(|of| sign * of[0] >= SEEN_SHARE);
            seen.count() >= MIN_ROWS
        };
        let seen = [is_seen(1.0), is_seen(-1.0)];
        let [positive_nm, negative_nm] = match excess_nm {
            Some(of) => [0, 1].map(|k| if seen[k] { of[k].min(most_nm) } else { 0.0 }),
            // One direction alone does not tell them apart.
            None if seen[0] || seen[1] => [alone([1.0, 0.0]).min(most_nm); 2],
            None => [0.0; 2],
        };
        x[stribeck] = 0.5 * (positive_nm + negative_nm);
        if let Some(offset) = offset {
            x[offset] = 0.5 * (positive_nm - negative_nm);
        }
    }
}

/// Returns the weight of each slow sample with which all speeds up to `reach_rad_per_s` count the same, as far as the greatest weight
/// allows: most samples of a smooth motion are near its greatest speed, and what a joint does near rest would not count.
pub(crate) fn speed_weights(speeds_rad_per_s: &[f64], reach_rad_per_s: f64) -> Vec<f64> {
    let bin =
        |speed: &f64| ((speed / reach_rad_per_s * SPEED_BINS as f64) as usize).min(SPEED_BINS - 1);
    let mut counts = [0_usize; SPEED_BINS];
    speeds_rad_per_s
        .iter()
        .for_each(|speed| counts[bin(speed)] += 1);
    let filled = counts.iter().filter(|count| **count > 0).count().max(1);
    let share = speeds_rad_per_s.len() as f64 / filled as f64;
    let weights = speeds_rad_per_s.iter();
    weights
        .map(|speed| (share / counts[bin(speed)] as f64).min(MAX_SPEED_WEIGHT))
        .collect()
}

/// Returns the least-squares solution of a few columns; `None` if they do not determine it.
fn normal_solution(a: &DMatrix<f64>, torques_nm: &[f64]) -> Option<DVector<f64>> {
    let square = a.tr_mul(a);
    let scale: DVector<f64> = square.diagonal().map(|d| d.sqrt());
    if scale.iter().any(|size| *size <= 0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(square.nrows(), square.ncols(), |i, j| {
        square[(i, j)] / (scale[i] * scale[j])
    });
    let eigenvalues = scaled.symmetric_eigenvalues();
    if eigenvalues.min() < LEAST_INFORMATION {
        return None;
    }
    let right = a
        .tr_mul(&DVector::from_column_slice(torques_nm))
        .component_div(&scale);
    Some(scaled.cholesky()?.solve(&right).component_div(&scale))
}

impl<const N: usize> Fit<N> {
    /// Returns the identified arm.
    ///
    /// # Errors
    /// [`IdentError::NotPhysical`], for plain least squares only.
    pub fn arm(&self) -> Result<Arm<N>, IdentError> {
        model::arm(&self.nominal, &self.columns, &self.x)
    }

    /// Returns the friction of every joint of the arm in the controller's friction law; load-dependent friction refers to the
    /// load [`Fit::load_nm`].
    pub fn friction(&self) -> Vec<Friction> {
        self.friction_of(&self.x)
    }

    /// Returns springs, tilt and torque scales as learned terms of a controller with this configuration.
    pub fn learned(&self, config: &Config<N>) -> LearnedTerms<N> {
        effect_rows::learned(&self.columns, &|column| self.value(column), config)
    }

    /// Returns the compliance between encoder and link of each joint \[rad/(N m)\]; zero where it is not identified.
    pub fn compliance_rad_per_nm(&self) -> [f64; N] {
        core::array::from_fn(|j| effect_rows::COMPLIANCE_UNIT * self.value(Column::Compliance(j)))
    }

    /// Returns the torque scale of each joint relative to the common scale of all joints; zero where it is not identified.
    pub fn torque_scale(&self) -> [f64; N] {
        core::array::from_fn(|j| self.value(Column::TorqueScale(j)))
    }

    pub(crate) fn value(&self, column: Column) -> f64 {
        self.columns.position(column).map_or(0.0, |i| self.x[i])
    }

    fn friction_of(&self, x: &DVector<f64>) -> Vec<Friction> {
        let mut friction = model::friction(&self.columns, x, &self.load_nm);
        for (friction, presliding_rad) in friction.iter_mut().zip(&self.presliding_rad) {
            friction.presliding_rad = *presliding_rad;
        }
        friction
    }

    /// Returns the nominal arm: kinematics and prior.
    pub fn nominal(&self) -> &Arm<N> {
        &self.nominal
    }

    /// Returns the number of column combinations that the data determine.
    pub fn rank(&self) -> usize {
        self.base.rank()
    }

    /// Returns the condition number of the independent columns, scaled to unit length.
    pub fn condition(&self) -> f64 {
        self.base.condition
    }

    /// Predicts the torques of one state \[N m\]. Joints that are not identified count as held: at rest, independent of `qd` and
    /// `qdd`, and without friction.
    pub fn predict(&self, q: &Vector<N>, qd: &Vector<N>, qdd: &Vector<N>) -> Vector<N> {
        let identified_joints = self.columns.identified_joints();
        let with_held_at_rest = |v: &Vector<N>| {
            Vector::<N>::from_fn(|j, _| {
                if identified_joints.contains(&j) {
                    v[j]
                } else {
                    0.0
                }
            })
        };
        let link_regressor = regressor(
            &self.nominal,
            q,
            &with_held_at_rest(qd),
            &with_held_at_rest(qdd),
        );
        let links = model::link_parameters::<N>(&self.x);
        let mut torque = regressor_times(&link_regressor, &links);
        let passes = if self.columns.friction().load == Some(LoadTorque::Motor) {
            LOAD_PASSES
        } else {
            1
        };
        for pass in 0..passes {
            let load = (pass > 0).then_some(&torque);
            let rows = rows_under_load(&self.nominal, &self.columns, [q, qd, qdd], load);
            let explained = rows * &self.x;
            for (row, &joint) in identified_joints.iter().enumerate() {
                let rotor = match self.columns.position(Column::Rotor(joint)) {
                    Some(_) => 0.0,
                    None => self.nominal.armature()[joint] * qdd[joint],
                };
                torque[joint] = explained[row] + rotor;
            }
        }
        torque
    }

    /// Draws a random model from the posterior: the estimate plus a draw of its normal distribution. Held joints have
    /// no friction.
    ///
    /// # Errors
    /// [`IdentError::NotPhysical`] if the fit itself is physically inconsistent.
    pub fn draw(&self, seed: u64) -> Result<(Arm<N>, Vec<Friction>), IdentError> {
        let mut random = Random::new(seed);
        let mut change = self
            .base
            .draw(self.spread, &mut random)
            .unwrap_or_else(|| DVector::zeros(self.rank()));
        loop {
            let mut x = self.x.clone();
            for (i, position) in self.base.independent.iter().enumerate() {
                x[*position] += change[i];
            }
            let friction = self.friction_of(&x);
            match model::arm(&self.nominal, &self.columns, &x) {
                Ok(arm) if friction.iter().all(|f| f.validate().is_ok()) => {
                    return Ok((arm, friction));
                }
                // At the boundary of the feasible set, a draw may be infeasible; shorten it.
                _ if change.amax() > 1e-12 => change *= 0.5,
                _ => return Ok((self.arm()?, self.friction())),
            }
        }
    }

    /// Returns the values of the base parameters, in the order of [`BaseParameters::text`].
    pub fn base_parameters(&self) -> DVector<f64> {
        self.base.values(&self.x)
    }
}
