//! One stage of a fit: rows, weights and solution.

use crate::columns::Columns;
use crate::constrained_least_squares::{Constraints, solve};
use crate::error::{IdentError, shape_error};
use crate::estimate::{huber_weights, nearest, noise_nm, weighted, weighted_least_squares};
use crate::joint_rows::JointRows;
use crate::options::{Options, Weights};
use crate::prior_rows::{OffsetCosts, PriorRows};
use crate::qr_reduction::ReducedSystem;
use nalgebra::{DVector, SVector};

/// Maximum number of reweighting iterations.
const MAX_REWEIGHTINGS: usize = 5;
/// A joint's offset has no cost if the joint's residual with the cost is more than this multiple of that without it.
const OFFSET_SHOWN: f64 = 1.5;

/// A fit of some columns to given rows.
pub(crate) struct FitStage<'a> {
    pub(crate) columns: &'a Columns,
    /// Columns that the fit uses, in ascending order.
    pub(crate) used: &'a [usize],
    /// One [`JointRows`] per identified joint for each part of the data.
    pub(crate) parts: &'a [Vec<JointRows>],
    pub(crate) options: &'a Options,
    /// Nominal parameters of the used columns.
    pub(crate) nominal: DVector<f64>,
    /// Nominal parameters of the links.
    pub(crate) links: Vec<SVector<f64, 10>>,
}

/// Solution of a stage.
pub(crate) struct StageSolution {
    /// Parameters of the used columns.
    pub(crate) x: DVector<f64>,
    /// Reduced system of each identified joint, with the last weights.
    pub(crate) blocks: Vec<ReducedSystem>,
    /// What the equations of each identified joint are divided by: its RMS residual, one value for all, or the given one \[N m\].
    pub(crate) noise_nm: Vec<f64>,
    /// Upper bound on the distance of the objective from its optimum, for a consistent fit.
    pub(crate) optimality_gap: Option<f64>,
}

impl FitStage<'_> {
    /// Returns one reduced system for each joint, over all parts.
    pub(crate) fn blocks(&self, weights: Option<&[Vec<Vec<f64>>]>) -> Vec<ReducedSystem> {
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
    pub(crate) fn solve(&self, blocks: &[ReducedSystem]) -> Result<StageSolution, IdentError> {
        let prior = self.prior_rows();
        let mut costs = vec![prior.has_offset_costs(); blocks.len()];
        loop {
            let solution = self.reweighted(blocks.to_vec(), &costs)?;
            let (x, blocks) = (&solution.x, &solution.blocks);
            let joints = self.columns.identified_joints();
            let mut with_cost = costs.iter().zip(joints).filter(|(cost, _)| **cost);
            if !with_cost.any(|(_, joint)| prior.has_great_offset(*joint, x)) {
                return Ok(solution);
            }
            let without = self.step(blocks, &solution.noise_nm, None)?.0;
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

    fn prior_rows(&self) -> PriorRows<'_> {
        PriorRows {
            columns: self.columns,
            used: self.used,
            options: self.options,
            nominal: &self.nominal,
        }
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
                weighted_least_squares(&blocks, &self.nominal)?.1
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
        Ok(StageSolution {
            x,
            blocks,
            noise_nm: noise,
            optimality_gap: gap,
        })
    }

    fn step(
        &self,
        blocks: &[ReducedSystem],
        noise: &[f64],
        offset_costs: Option<OffsetCosts>,
    ) -> Result<(DVector<f64>, Option<f64>), IdentError> {
        let mut stacked = weighted(blocks, noise, self.used.len());
        stacked.append(&self.prior_rows().rows(blocks, offset_costs), 0);
        let Some(prior_weight) = self.options.consistent_prior_weight else {
            return Ok((nearest(&stacked, &self.nominal)?, None));
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

/// Returns the same noise for all joints, so that the residuals, relative to which the prior is weighted, are about one.
fn equal_noise(blocks: &[ReducedSystem], x: &DVector<f64>) -> Vec<f64> {
    let squares: f64 = noise_nm(blocks, x).iter().map(|n| n * n).sum();
    vec![(squares / blocks.len() as f64).sqrt(); blocks.len()]
}
