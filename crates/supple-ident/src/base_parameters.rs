//! Base parameters: the identifiable combinations of the regressor columns.
//!
//! Columns are scaled to unit length and selected by QR with column pivoting. Once the diagonal drops below
//! `tolerance` times its first entry, the remaining columns depend on those selected:
//! `dependent = independent B`, so that `x_independent + B x_dependent` is what can be identified.

use crate::error::IdentError;
use crate::random::{Normal, Random};
use nalgebra::{DMatrix, DVector};

/// Diagonal entries below this fraction of the first are rounding errors.
pub const RANK_TOLERANCE: f64 = 1e-8;
/// Relative tolerance for ties in the pivot search: among columns of almost equal remaining norm the first is
/// selected. All columns start with equal norm, so that without a tolerance rounding would decide.
const TIE: f64 = 1e-6;

/// Base parameters of a regressor.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseParameters {
    /// Indices of the independent columns, increasing.
    pub independent: Vec<usize>,
    /// Indices of the dependent columns, increasing.
    pub dependent: Vec<usize>,
    /// `B`, (independent, dependent).
    pub combination: DMatrix<f64>,
    /// Condition number of the independent columns, each scaled to unit length.
    pub condition: f64,
    gram_inverse: DMatrix<f64>,
}

impl BaseParameters {
    /// Computes the base parameters of the regressor `a`, or of its upper triangular factor.
    ///
    /// # Errors
    /// [`IdentError::Singular`] if every column is zero.
    pub fn from_regressor(a: &DMatrix<f64>, tolerance: f64) -> Result<BaseParameters, IdentError> {
        let lengths: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        if longest == 0.0 || !longest.is_finite() {
            return Err(IdentError::Singular {
                problem: format!("the largest column norm of the regressor is {longest}"),
                remedy: "give a log in which the joints move",
            });
        }
        let scale = |j: usize| {
            if lengths[j] > 1e-12 * longest {
                1.0 / lengths[j]
            } else {
                0.0
            }
        };
        let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale(j));
        let order = pivot_order(&scaled, tolerance);
        let mut independent = order;
        independent.sort_unstable();
        let dependent: Vec<usize> = (0..a.ncols())
            .filter(|j| independent.binary_search(j).is_err())
            .collect();
        let singular = || IdentError::Singular {
            problem: "the selected columns are linearly dependent".to_owned(),
            remedy: "raise the tolerance of the rank",
        };
        let taken = scaled.select_columns(&independent);
        let (q, r) = taken.clone().qr().unpack();
        let projected = q.tr_mul(&scaled.select_columns(&dependent));
        let mut combination = r.solve_upper_triangular(&projected).ok_or_else(singular)?;
        for (i, &p) in independent.iter().enumerate() {
            for (k, &d) in dependent.iter().enumerate() {
                combination[(i, k)] *= scale(p) * if scale(d) > 0.0 { lengths[d] } else { 0.0 };
            }
        }
        let identity = DMatrix::identity(r.nrows(), r.nrows());
        let inverse = r.solve_upper_triangular(&identity).ok_or_else(singular)?;
        let mut gram_inverse = &inverse * inverse.transpose();
        for (i, &p) in independent.iter().enumerate() {
            gram_inverse.row_mut(i).scale_mut(scale(p));
            gram_inverse.column_mut(i).scale_mut(scale(p));
        }
        let singular_values = r.singular_values();
        Ok(BaseParameters {
            independent,
            dependent,
            combination,
            condition: singular_values.max() / singular_values.min(),
            gram_inverse,
        })
    }

    /// Converts column indices to those of a larger set, of which these columns were `positions`.
    pub fn renumbered(mut self, positions: &[usize]) -> BaseParameters {
        for list in [&mut self.independent, &mut self.dependent] {
            list.iter_mut().for_each(|i| *i = positions[*i]);
        }
        self
    }

    /// Returns the number of identifiable combinations.
    pub fn rank(&self) -> usize {
        self.independent.len()
    }

    /// Returns `x_independent + B x_dependent`.
    pub fn values(&self, x: &DVector<f64>) -> DVector<f64> {
        let part = |list: &[usize]| DVector::from_iterator(list.len(), list.iter().map(|i| x[*i]));
        part(&self.independent) + &self.combination * part(&self.dependent)
    }

    /// Returns the standard deviation of each base parameter for independent noise of `noise` on each row.
    pub fn standard_deviations(&self, noise: f64) -> DVector<f64> {
        self.gram_inverse.diagonal().map(|v| noise * v.sqrt())
    }

    /// Returns a draw from the zero-mean normal distribution of the base parameters, for independent noise of `noise`
    /// on each row; `None` if rounding makes the covariance singular.
    pub(crate) fn draw(&self, noise: f64, random: &mut Random) -> Option<DVector<f64>> {
        let root = nalgebra::Cholesky::new(self.gram_inverse.clone())?;
        let normal = DVector::from_fn(self.rank(), |_, _| random.normal());
        Some(root.l() * normal * noise)
    }

    /// Returns each base parameter as text, such as `Izz1 + 1 Iyy2 - 0.55 mcx2`.
    pub fn text(&self, names: &[String]) -> Vec<String> {
        let sum = |i: usize| {
            let mut text = names[self.independent[i]].clone();
            for (k, d) in self.dependent.iter().enumerate() {
                text += &term(self.combination[(i, k)], &names[*d]);
            }
            text
        };
        (0..self.rank()).map(sum).collect()
    }

    /// Returns the null space as text: one direction for each dependent column in which the parameters can change without a
    /// change of torque.
    pub fn null_space_text(&self, names: &[String]) -> Vec<String> {
        let direction = |k: usize| {
            let mut text = names[self.dependent[k]].clone();
            for (i, p) in self.independent.iter().enumerate() {
                text += &term(-self.combination[(i, k)], &names[*p]);
            }
            text
        };
        (0..self.dependent.len()).map(direction).collect()
    }
}

fn term(coefficient: f64, name: &str) -> String {
    if coefficient.abs() < 1e-6 {
        return String::new();
    }
    let sign = if coefficient < 0.0 { '-' } else { '+' };
    let rounded = (coefficient.abs() * 1e6).round() / 1e6;
    if rounded == 1.0 {
        format!(" {sign} {name}")
    } else {
        format!(" {sign} {rounded} {name}")
    }
}

/// Returns the columns in the order of pivoting, until the rest are negligible. Each step selects the column of largest
/// remaining norm, the first of those that tie, and removes its direction twice from the others.
pub(crate) fn pivot_order(columns: &DMatrix<f64>, tolerance: f64) -> Vec<usize> {
    let mut rest = columns.clone();
    let mut order: Vec<usize> = Vec::new();
    let mut first = 0.0;
    while order.len() < columns.ncols().min(columns.nrows()) {
        let lengths: Vec<(usize, f64)> = (0..rest.ncols())
            .filter(|j| !order.contains(j))
            .map(|j| (j, rest.column(j).norm()))
            .collect();
        let longest = lengths
            .iter()
            .map(|(_, length)| *length)
            .fold(0.0, f64::max);
        if order.is_empty() {
            first = longest;
        }
        let ties = |(_, length): &&(usize, f64)| *length >= (1.0 - TIE) * longest;
        let Some(&(pivot, length)) = lengths.iter().find(ties) else {
            break;
        };
        if longest <= tolerance * first {
            break;
        }
        let direction = rest.column(pivot) / length;
        for _ in 0..2 {
            let projections = rest.tr_mul(&direction);
            rest.ger(-1.0, &direction, &projections, 1.0);
        }
        order.push(pivot);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::{BaseParameters, RANK_TOLERANCE};
    use crate::random::{Normal, Random};
    use nalgebra::DMatrix;

    /// Returns the eight columns of rank five, three of them combinations of others.
    fn dependent(random: &mut Random) -> DMatrix<f64> {
        let free = DMatrix::from_fn(60, 5, |_, _| random.normal());
        let mix = DMatrix::from_fn(5, 8, |i, j| match (i, j) {
            (i, j) if j < 5 => f64::from(u8::from(i == j)),
            (0, 5) => -2.0,
            (1 | 2, 6) | (3, 7) => 1.0,
            _ => 0.0,
        });
        free * mix
    }

    #[test]
    fn rounding_does_not_affect_the_choice_of_columns() {
        let mut random = Random::new(4);
        let a = dependent(&mut random);
        let chosen = BaseParameters::from_regressor(&a, RANK_TOLERANCE).unwrap();
        assert_eq!(chosen.rank(), 5);
        assert!(chosen.independent.contains(&0), "the first of equals");
        for _ in 0..50 {
            // The same columns in rotated coordinates, which changes only rounding.
            let turn = DMatrix::from_fn(60, 60, |_, _| random.normal()).qr().q();
            let turned = turn * &a * (0.1 + random.uniform());
            let again = BaseParameters::from_regressor(&turned, RANK_TOLERANCE).unwrap();
            assert_eq!(again.independent, chosen.independent);
            assert!((again.combination - &chosen.combination).amax() < 1e-9);
        }
    }
}
