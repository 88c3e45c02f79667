//! Torque scales from a weight of known mass: its centre of mass and the scale of each joint together.
//!
//! With torques in units of the log, a joint `j` with the torque scale `s_j` (true over logged torque) obeys
//!
//! ```text
//! tau_j = Y_j x_j + k_j Y_hand p(m, c, I),   k_j = 1 / s_j
//! ```
//!
//! where the last term is present only with the weight. The motions with and without it give `k_j p` of each joint, up to what
//! they leave undetermined; all joints carry the same body, whose mass is known.

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::error::{IdentError, positive};
use crate::fit::Fit;
use crate::motion::Motion;
use crate::payload::{blocks_with_load, parameters_of};
use crate::qr_reduction::ReducedSystem;
use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};
use supple_core::Body;
use supple_core::math::{Matrix3, Vector3};

/// Number of parameters of a body.
const BODY: usize = 10;
/// Unknowns of the body: centre of mass and inertia about it.
const SHAPE: usize = 9;
/// Prior standard deviation of the radius of gyration of the weight \[m\].
const GYRATION_M: f64 = 0.1;
/// Greatest relative standard deviation of a scale that is told apart.
const MAX_SCALE_DEVIATION: f64 = 0.05;
/// Greatest standard deviation of a coordinate of the centre of mass without a warning \[m\].
const MAX_COM_DEVIATION_M: f64 = 0.01;
/// Maximum number of steps of the solver, and relative decrease of the error at which it ends.
const STEPS: usize = 100;
const CONVERGED: f64 = 1e-12;
/// Eigenvalue of normal equations with a unit diagonal below which it is rounding.
const ROUNDING: f64 = 1e-12;

/// Result of [`weigh`].
#[derive(Clone, Debug, PartialEq)]
pub struct Weighing {
    /// Ratio of true to logged torque of each identified joint; `None` if the weight does not determine it within 5 %.
    pub torque_scale: Vec<Option<f64>>,
    /// Relative standard deviation of each scale; infinite if nothing determines it, or if the weight was not carried.
    pub torque_scale_deviation: Vec<f64>,
    /// Centre of mass of the weight in the last link's frame \[m\].
    pub com_m: Vector3<f64>,
    /// Standard deviation of each coordinate \[m\].
    pub com_deviation_m: Vector3<f64>,
}

impl Weighing {
    /// Returns what the motions do not tell apart, with a remedy; `names` are those of the identified joints.
    pub fn warnings(&self, names: &[String]) -> Vec<String> {
        let joints = names.iter().zip(&self.torque_scale);
        let joints = joints.zip(&self.torque_scale_deviation);
        let unknown = joints.filter(|((_, scale), _)| scale.is_none());
        let mut warnings: Vec<String> = unknown
            .map(|((name, _), deviation)| {
                let why = match deviation.is_finite() {
                    true => format!("standard deviation {:.0} %", 100.0 * deviation),
                    false => "the weight does not load it, or was not carried".to_owned(),
                };
                format!(
                    "{name}: its torque scale is not told apart from the place of the weight ({why}); move it through poses in \
                     which the weight loads it differently, or use a heavier one"
                )
            })
            .collect();
        let deviation_m = self.com_deviation_m.amax();
        if deviation_m > MAX_COM_DEVIATION_M {
            warnings.push(format!(
                "the centre of mass is known to {:.0} mm only; turn the last joints, so that the weight is seen from several sides",
                1e3 * deviation_m
            ));
        }
        warnings
    }
}

/// Information of the motions of one joint about `k p`: `|r (k p) - b|^2`, in units of the standard deviation.
struct JointInformation {
    r: SMatrix<f64, BODY, BODY>,
    b: SVector<f64, BODY>,
}

/// Estimates torque scales and the centre of mass of a weight of `mass_kg` at the last link, from the fitted motions `without` it
/// and motions `with` it. Deviations are those of the residuals' noise; errors of the model are not in them. Excluded intervals of
/// the motions are left out; slow samples are not.
///
/// # Errors
/// A mass that is not positive; shapes that do not agree; a search that does not converge.
pub fn weigh<const N: usize>(
    empty: &Fit<N>,
    without: &[Motion],
    with: &[Motion],
    mass_kg: f64,
) -> Result<Weighing, IdentError> {
    positive("mass_kg", mass_kg)?;
    let independent = without.iter().chain(with).map(|m| m.independent_fraction);
    let independent_fraction = independent.fold(1.0, f64::min);
    let blocks = blocks_with_load(empty, without, with)?;
    let joints = blocks
        .iter()
        .map(|block| information(block, independent_fraction));
    let joints = joints.collect::<Result<Vec<_>, _>>()?;
    let problem = Problem { joints, mass_kg };
    let x = problem.solve()?;
    Ok(problem.result(&x))
}

/// Eliminates the arm's own columns, which are the first; the last ten are those of the body.
fn information(
    block: &ReducedSystem,
    independent_fraction: f64,
) -> Result<JointInformation, IdentError> {
    let arm = block.unknowns() - BODY;
    let own: Vec<usize> = (0..arm).collect();
    let base = BaseParameters::from_regressor(&block.select(&own).a(), RANK_TOLERANCE)?;
    let rank = base.independent.len();
    let used: Vec<usize> = base
        .independent
        .into_iter()
        .chain(arm..arm + BODY)
        .collect();
    let selected = block.select(&used);
    let (a, b) = (selected.a(), selected.b());
    let columns = a.ncols();
    let stacked = a.insert_column(columns, 0.0);
    let mut stacked = stacked.resize_vertically(b.len().max(columns + 1), 0.0);
    stacked.view_mut((0, columns), (b.len(), 1)).copy_from(&b);
    let r = stacked.qr().r();
    let freedom = block.rows().saturating_sub(columns) as f64 * independent_fraction;
    let noise = (r[(columns, columns)].powi(2) / freedom.max(1.0)).sqrt();
    // Data without noise are as exact as their numbers.
    let scale = 1.0 / noise.max(1e-9 * b.norm() / freedom.max(1.0).sqrt());
    Ok(JointInformation {
        r: r.fixed_view::<BODY, BODY>(rank, rank) * scale,
        b: r.fixed_view::<BODY, 1>(rank, columns) * scale,
    })
}

struct Problem {
    joints: Vec<JointInformation>,
    mass_kg: f64,
}

impl Problem {
    /// Returns `p` and its derivatives with respect to the centre of mass and the inertia.
    fn body(&self, x: &DVector<f64>) -> (SVector<f64, BODY>, SMatrix<f64, BODY, SHAPE>) {
        let p_of = |shape: &SVector<f64, SHAPE>| {
            let [xx, xy, yy, xz, yz, zz] = [3, 4, 5, 6, 7, 8].map(|i| shape[i]);
            parameters_of(&Body {
                mass_kg: self.mass_kg,
                com_m: Vector3::new(shape[0], shape[1], shape[2]),
                inertia_kg_m2: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            })
        };
        let shape: SVector<f64, SHAPE> = x.fixed_rows::<SHAPE>(0).into_owned();
        // The parameters are quadratic in the shape: central differences are exact.
        let columns: [SVector<f64, BODY>; SHAPE] = std::array::from_fn(|i| {
            let (mut ahead, mut behind) = (shape, shape);
            ahead[i] += 0.5;
            behind[i] -= 0.5;
            p_of(&ahead) - p_of(&behind)
        });
        (p_of(&shape), SMatrix::from_columns(&columns))
    }

    /// Returns the weighted errors and their derivatives; the last six rows are the prior of the inertia.
    fn errors(&self, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let (p, slope) = self.body(x);
        let rows = BODY * self.joints.len();
        let mut errors = DVector::zeros(rows + 6);
        let mut jacobian = DMatrix::zeros(rows + 6, x.len());
        for (j, joint) in self.joints.iter().enumerate() {
            let k = x[SHAPE + j];
            let at = BODY * j;
            errors
                .fixed_rows_mut::<BODY>(at)
                .copy_from(&(joint.r * (p * k) - joint.b));
            let shape = joint.r * slope * k;
            jacobian
                .fixed_view_mut::<BODY, SHAPE>(at, 0)
                .copy_from(&shape);
            jacobian
                .fixed_view_mut::<BODY, 1>(at, SHAPE + j)
                .copy_from(&(joint.r * p));
        }
        let deviation = self.mass_kg * GYRATION_M * GYRATION_M;
        for i in 0..6 {
            errors[rows + i] = x[3 + i] / deviation;
            jacobian[(rows + i, 3 + i)] = 1.0 / deviation;
        }
        (errors, jacobian)
    }

    /// Minimises the squared errors by the method of Levenberg and Marquardt.
    fn solve(&self) -> Result<DVector<f64>, IdentError> {
        let mut x = DVector::zeros(SHAPE + self.joints.len());
        x.rows_mut(SHAPE, self.joints.len()).fill(1.0);
        let (mut errors, mut jacobian) = self.errors(&x);
        let (mut damping, mut decrease) = (1e-3, f64::INFINITY);
        for _ in 0..STEPS {
            let mut normal = jacobian.tr_mul(&jacobian);
            for i in 0..normal.nrows() {
                normal[(i, i)] += damping * normal[(i, i)] + f64::MIN_POSITIVE.sqrt();
            }
            let gradient = jacobian.tr_mul(&errors);
            let step = Cholesky::new(normal)
                .ok_or_else(undetermined)?
                .solve(&gradient);
            let next = &x - step;
            let (next_errors, next_jacobian) = self.errors(&next);
            let (before, after) = (errors.norm_squared(), next_errors.norm_squared());
            if after > before {
                damping *= 10.0;
                if damping > 1e12 {
                    break;
                }
                continue;
            }
            (x, errors, jacobian) = (next, next_errors, next_jacobian);
            damping = (damping * 0.1).max(1e-12);
            decrease = before - after;
            if decrease <= CONVERGED * before {
                break;
            }
        }
        match decrease.is_finite() && decrease > 1e-3 * errors.norm_squared() {
            true => Err(undetermined()),
            false => Ok(x),
        }
    }

    fn result(&self, x: &DVector<f64>) -> Weighing {
        let (_, jacobian) = self.errors(x);
        let deviations = variances(&jacobian.tr_mul(&jacobian)).map(f64::sqrt);
        let joints = SHAPE..SHAPE + self.joints.len();
        let relative = |i: usize| match x[i] > 0.0 {
            true => deviations[i] / x[i],
            false => f64::INFINITY,
        };
        let told_apart = |i: usize| relative(i) <= MAX_SCALE_DEVIATION;
        Weighing {
            torque_scale: joints
                .clone()
                .map(|i| told_apart(i).then(|| 1.0 / x[i]))
                .collect(),
            torque_scale_deviation: joints.map(relative).collect(),
            com_m: Vector3::new(x[0], x[1], x[2]),
            com_deviation_m: Vector3::from_fn(|i, _| deviations[i]),
        }
    }
}

/// Returns the variances of unknowns with these normal equations; infinite for one that they do not determine.
fn variances(normal: &DMatrix<f64>) -> DVector<f64> {
    let size = normal.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        let product = size[i] * size[j];
        match product > 0.0 {
            true => normal[(i, j)] / product,
            false => f64::from(u8::from(i == j)),
        }
    });
    let eigen = scaled.symmetric_eigen();
    let variance = |i: usize| {
        let row = eigen.eigenvectors.row(i);
        let terms = row.iter().zip(&eigen.eigenvalues);
        let is_free = |(v, value): (&f64, &f64)| *value < ROUNDING && v * v > ROUNDING;
        if size[i] == 0.0 || terms.clone().any(is_free) {
            return f64::INFINITY;
        }
        let determined = terms.filter(|(_, value)| **value >= ROUNDING);
        let sum: f64 = determined.map(|(v, value)| v * v / value).sum();
        sum / (size[i] * size[i])
    };
    DVector::from_fn(normal.nrows(), |i, _| variance(i))
}

fn undetermined() -> IdentError {
    IdentError::Singular {
        problem: "the logs determine neither torque scales nor the place of the weight".to_owned(),
        remedy: "log motions with and without the weight",
    }
}
