//! Prior equations of a fit: effects, friction by load, rotors, and great offsets.

use crate::columns::{Column, Columns};
use crate::options::Options;
use crate::qr_reduction::ReducedSystem;
use nalgebra::{DMatrix, DVector};

/// Weight of the prior of an effect: the square root of the number of samples that it counts for. Errors of the model are
/// correlated over many samples.
const EFFECT_PRIOR_WEIGHT: f64 = 50.0;
/// Offset of a joint without a cost, in proportion to its Coulomb friction: differences of friction by direction and small currents of
/// amplifiers are as large. Gravity and springs can nearly cancel a greater one in a motion, and not elsewhere.
const OFFSET_FREE_SHARE: f64 = 0.1;
/// Share of the Coulomb friction in the prior standard deviation of the offset beyond [`OFFSET_FREE_SHARE`].
const OFFSET_DRY_SHARE: f64 = 0.4;
/// Share of the root mean square torque in the same.
const OFFSET_TORQUE_SHARE: f64 = 0.005;

/// Previous solution, and for each identified joint whether its offset has a cost.
pub(crate) type OffsetCosts<'a> = (&'a DVector<f64>, &'a [bool]);

/// The columns of a fit and their nominal parameters, from which the prior follows.
#[derive(Clone, Copy)]
pub(crate) struct PriorRows<'a> {
    pub(crate) columns: &'a Columns,
    /// Columns that the fit uses, in ascending order.
    pub(crate) used: &'a [usize],
    pub(crate) options: &'a Options,
    /// Nominal parameters of the used columns.
    pub(crate) nominal: &'a DVector<f64>,
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

impl PriorRows<'_> {
    /// Returns whether great offsets have a cost in this fit: it has offsets, and is physically consistent.
    pub(crate) fn has_offset_costs(&self) -> bool {
        let offsets = self.columns.friction().offset;
        offsets && self.options.consistent_prior_weight.is_some()
    }

    /// Returns whether the offset of an identified joint is more than [`OFFSET_FREE_SHARE`] of its Coulomb friction in `x`.
    pub(crate) fn has_great_offset(&self, joint: usize, x: &DVector<f64>) -> bool {
        let offset = self.offset_and_coulomb_nm(joint, x);
        offset
            .is_some_and(|(offset_nm, coulomb_nm)| offset_nm.abs() > OFFSET_FREE_SHARE * coulomb_nm)
    }

    /// Returns the prior mean and standard deviation of a rotor's inertia.
    fn rotor_prior(&self, unknown: usize, column: &Column) -> Option<(f64, f64)> {
        let nominal = self.nominal[unknown];
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

    /// Returns the equations of the prior of effects, friction by load, rotors and offsets: coefficients of the used columns and the right
    /// side, divided by the standard deviation.
    pub(crate) fn rows(
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
}
