//! The paper's estimator, Eq. (3.7) and (3.8): twelve columns, least squares by the pseudo-inverse, with known
//! `m3` and `S`.
//!
//! The twelve columns have rank ten for any data, so that `(Lambda^T Lambda)^-1` does not exist; the
//! pseudo-inverse gives the minimum-norm solution, of which ten combinations are determined. Compare parameter
//! sets by [`Parameters::base`].

use crate::base_parameters::{BaseParameters, RANK_TOLERANCE};
use crate::error::{IdentError, shape_error};
use crate::joint_rows::JointRows;
use crate::motion::Motion;
use nalgebra::{DMatrix, DVector};
use supple_core::Vector;
use supple_model::paper::Parameters;

/// Minimum number of samples: the number that the paper used.
pub const MIN_SAMPLES: usize = 1600;

/// Result of the paper's estimator.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Minimum-norm solution, in the order of [`Parameters::PSI_NAMES`].
    pub psi: [f64; 12],
    /// The ten determined combinations, in the order of [`Parameters::BASE_NAMES`].
    pub base: [f64; 10],
    /// Standard deviation of each entry of `base`.
    pub base_std: [f64; 10],
    /// Independent columns, rank and condition number.
    pub columns: BaseParameters,
    /// RMS torque residual \[N m\].
    pub residual_nm: f64,
}

/// Returns `known` with its `psi` replaced.
pub fn with_psi(known: &Parameters, psi: &[f64; 12]) -> Parameters {
    let [ix1, ix2, iz2, iy2, m2r2, m3r3, ix3, iy3, iz3, v1, v2, v3] = *psi;
    Parameters {
        iz1_kg_m2: ix1,
        ix2_kg_m2: ix2,
        iz2_kg_m2: iz2,
        iy2_kg_m2: iy2,
        m2r2_kg_m: m2r2,
        m3r3_kg_m: m3r3,
        ix3_kg_m2: ix3,
        iy3_kg_m2: iy3,
        iz3_kg_m2: iz3,
        viscous_nm_s_per_rad: [v1, v2, v3],
        ..*known
    }
}

/// Returns the twelve-column regressor of one state and the contribution of `m3` and `S`: `tau = lambda psi + rest`.
pub fn lambda(
    known: &Parameters,
    q: &Vector<3>,
    qd: &Vector<3>,
    qdd: &Vector<3>,
) -> (DMatrix<f64>, Vector<3>) {
    let torque = |psi: &[f64; 12]| {
        let set = with_psi(known, psi);
        let friction = set.friction();
        set.inverse_dynamics(q, qd, qdd) + Vector::<3>::from_fn(|j, _| friction[j].torque_nm(qd[j]))
    };
    let rest = torque(&[0.0; 12]);
    let mut lambda = DMatrix::zeros(3, 12);
    for c in 0..12 {
        let mut unit = [0.0; 12];
        unit[c] = 1.0;
        lambda.set_column(c, &(torque(&unit) - rest));
    }
    (lambda, rest)
}

/// Estimates `psi` from `motion`, with `m3`, `S`, lengths and gravity taken from `known`.
///
/// # Errors
/// [`IdentError::Shape`] for fewer than 1600 samples or a number of joints other than three;
/// [`IdentError::Singular`] if the motion determines fewer than ten combinations.
pub fn estimate(known: &Parameters, motion: &Motion) -> Result<Estimate, IdentError> {
    let samples = motion.samples();
    if samples < MIN_SAMPLES || motion.q.ncols() != 3 {
        let found = format!("({samples}, {})", motion.q.ncols());
        let expected = format!("({MIN_SAMPLES} or more, 3)");
        return Err(shape_error("motion", expected, found));
    }
    let mut stacked = JointRows::new(
        DMatrix::zeros(3 * samples, 12),
        DVector::zeros(3 * samples),
        vec![0.0; 3 * samples],
    );
    for i in 0..samples {
        let at = |m: &DMatrix<f64>| Vector::<3>::from_fn(|j, _| m[(i, j)]);
        let (rows, rest) = lambda(known, &at(&motion.q), &at(&motion.qd), &at(&motion.qdd));
        stacked.a.rows_mut(3 * i, 3).copy_from(&rows);
        stacked
            .b
            .rows_mut(3 * i, 3)
            .copy_from(&(at(&motion.tau) - rest));
    }
    let block = stacked.reduced(0.0, None);
    let columns = BaseParameters::from_regressor(&block.a(), RANK_TOLERANCE)?;
    if columns.rank() < 10 {
        return Err(IdentError::Singular {
            problem: format!(
                "the motion determines {} combinations of 10",
                columns.rank()
            ),
            remedy: "move all three joints, over larger arcs and at several speeds",
        });
    }
    let solution = crate::estimate::min_norm_solution(&block.a(), &block.b(), RANK_TOLERANCE)?;
    let psi: [f64; 12] = std::array::from_fn(|i| solution[i]);
    let freedom = (3 * samples - columns.rank()) as f64 * motion.independent_fraction;
    let error = block.error_squared(&solution);
    let noise = (error / freedom.max(1.0)).sqrt();
    Ok(Estimate {
        psi,
        base: with_psi(known, &psi).base(),
        base_std: base_deviations(&block.a(), noise)?,
        columns,
        residual_nm: (error / (3 * samples) as f64).sqrt(),
    })
}

/// Returns the standard deviations of the paper's base parameters, which are linear in psi: their covariance is that of `T psi`.
fn base_deviations(a: &DMatrix<f64>, noise: f64) -> Result<[f64; 10], IdentError> {
    let inverse = crate::estimate::pseudo_inverse(a, RANK_TOLERANCE)?;
    let covariance = &inverse * inverse.transpose();
    let mut to_base = DMatrix::zeros(10, 12);
    for c in 0..12 {
        let mut unit = [0.0; 12];
        unit[c] = 1.0;
        let base = with_psi(&Parameters::PUBLISHED, &unit).base();
        to_base.set_column(c, &DVector::from_row_slice(&base));
    }
    let spread = &to_base * covariance * to_base.transpose();
    Ok(std::array::from_fn(|i| noise * spread[(i, i)].sqrt()))
}
