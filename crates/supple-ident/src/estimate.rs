//! Unconstrained least squares: ordinary, weighted by joint, and robust (Huber).
//!
//! Undetermined parameters take the values of a prior: the solver returns the solution nearest to the prior. The result may be
//! physically inconsistent; [`crate::constrained_least_squares`] has the constrained solver.

use crate::base_parameters::pivot_order;
use crate::error::IdentError;
use crate::qr_reduction::ReducedSystem;
use crate::regressor::JointRows;
use nalgebra::{DMatrix, DVector};

/// Multiple of the standard deviation beyond which residuals get less weight: 95 % efficiency for Gaussian
/// noise.
const HUBER: f64 = 1.345;
/// Ratio of standard deviation to median absolute deviation for Gaussian noise.
const MAD: f64 = 1.4826;
/// Maximum number of reweighting iterations.
const MAX_REWEIGHTINGS: usize = 20;

/// Returns the Moore-Penrose inverse by a complete orthogonal decomposition: `A = Q W` by QR with column pivoting,
/// `W' = Z T` by QR, so that the inverse is `Z T'^-1 Q'`. Columns whose remaining norm is below `tolerance`
/// times the largest count as dependent, as in [`crate::base_parameters`].
///
/// nalgebra's singular value decomposition is not used: for one in a thousand singular matrices its result is wrong in the third
/// digit, and these matrices are singular by construction.
///
/// # Errors
/// [`IdentError::Singular`] if all columns are zero or a value is not finite.
pub fn pseudo_inverse(a: &DMatrix<f64>, tolerance: f64) -> Result<DMatrix<f64>, IdentError> {
    let none = || IdentError::Singular {
        problem: "the columns are zero or not finite".to_owned(),
        remedy: "give a log in which the joints move",
    };
    let independent = pivot_order(a, tolerance);
    if independent.is_empty() || a.iter().any(|value| !value.is_finite()) {
        return Err(none());
    }
    let q = a.select_columns(&independent).qr().q();
    let (z, t) = a.tr_mul(&q).qr().unpack();
    let inverse = t.tr_solve_upper_triangular(&q.transpose());
    Ok(z * inverse.ok_or_else(none)?)
}

/// Returns the minimum-norm solution of `min |a x - b|`.
///
/// # Errors
/// As [`pseudo_inverse`].
pub fn min_norm_solution(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    tolerance: f64,
) -> Result<DVector<f64>, IdentError> {
    Ok(pseudo_inverse(a, tolerance)? * b)
}

/// Returns the solution of `min |a x - b|` nearest to `prior`, with columns scaled to unit length.
///
/// # Errors
/// As [`pseudo_inverse`].
pub fn nearest(block: &ReducedSystem, prior: &DVector<f64>) -> Result<DVector<f64>, IdentError> {
    let a = block.a();
    let lengths: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    let scale = |j: usize| {
        if lengths[j] > 1e-12 * longest {
            1.0 / lengths[j]
        } else {
            0.0
        }
    };
    let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale(j));
    let step = min_norm_solution(
        &scaled,
        &(block.b() - &a * prior),
        crate::base_parameters::RANK_TOLERANCE,
    )?;
    Ok(prior + DVector::from_fn(prior.len(), |j, _| step[j] * scale(j)))
}

/// Stacks the joints' systems, each divided by its noise.
pub fn weighted(blocks: &[ReducedSystem], noise_nm: &[f64], columns: usize) -> ReducedSystem {
    let mut all = ReducedSystem::empty(columns);
    for (block, noise) in blocks.iter().zip(noise_nm) {
        all.add(block, 1.0 / noise);
    }
    all
}

/// Returns the RMS residual of each joint \[N m\], at least 1e-6 of the joint's torque, to avoid a division by zero for
/// noise-free data.
pub fn noise_nm(blocks: &[ReducedSystem], x: &DVector<f64>) -> Vec<f64> {
    let rms = |block: &ReducedSystem| {
        let rows = block.rows().max(1) as f64;
        let floor = 1e-6 * (block.torque_squared() / rows).sqrt();
        (block.error_squared(x) / rows)
            .sqrt()
            .max(floor)
            .max(f64::MIN_POSITIVE.sqrt())
    };
    blocks.iter().map(rms).collect()
}

/// Solves by weighted least squares: estimates the noise of each joint together with the solution.
///
/// # Errors
/// As [`pseudo_inverse`].
pub fn weighted_least_squares(
    blocks: &[ReducedSystem],
    prior: &DVector<f64>,
) -> Result<(DVector<f64>, Vec<f64>), IdentError> {
    let mut noise = vec![1.0; blocks.len()];
    let mut x = nearest(&weighted(blocks, &noise, prior.len()), prior)?;
    for _ in 0..MAX_REWEIGHTINGS {
        let next = noise_nm(blocks, &x);
        let change = next.iter().zip(&noise).map(|(a, b)| (a / b - 1.0).abs());
        let settled = change.fold(0.0, f64::max) < 1e-3;
        noise = next;
        x = nearest(&weighted(blocks, &noise, prior.len()), prior)?;
        if settled {
            break;
        }
    }
    Ok((x, noise))
}

/// Returns the Huber weights of every sample of each joint, from the residuals of `x`.
pub fn huber_weights(joints: &[JointRows], x: &DVector<f64>) -> Vec<Vec<f64>> {
    let of_joint = |joint: &JointRows| {
        let residual = &joint.a * x - &joint.b;
        let mut sizes: Vec<f64> = residual.iter().map(|r| r.abs()).collect();
        let sizes_in_order = sizes.clone();
        sizes.sort_by(f64::total_cmp);
        let scale = MAD * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
        let bound = HUBER * scale;
        let weight = |size: f64| if size <= bound { 1.0 } else { bound / size };
        sizes_in_order.into_iter().map(weight).collect()
    };
    joints.iter().map(of_joint).collect()
}

#[cfg(test)]
mod tests {
    use super::pseudo_inverse;
    use crate::base_parameters::RANK_TOLERANCE;
    use crate::random::{Normal, Random};
    use nalgebra::DMatrix;

    /// The four Moore-Penrose conditions, for wide, square and tall matrices of every rank.
    #[test]
    fn the_pseudo_inverse_of_singular_matrices_is_the_moore_penrose_inverse() {
        let mut random = Random::new(7);
        for (rows, columns) in [(12, 20), (20, 20), (57, 56)] {
            for rank in 1..=rows.min(columns) {
                let mut draw = |r, c| DMatrix::from_fn(r, c, |_, _| random.normal());
                let a = draw(rows, rank) * draw(rank, columns);
                let inverse = pseudo_inverse(&a, RANK_TOLERANCE).unwrap();
                let (left, right) = (&a * &inverse, &inverse * &a);
                let size = a.amax() * inverse.amax();
                assert!((&left - left.transpose()).amax() < 1e-11 * size);
                assert!((&right - right.transpose()).amax() < 1e-11 * size);
                assert!((&left * &a - &a).amax() < 1e-11 * size * a.amax());
                assert!((&right * &inverse - &inverse).amax() < 1e-11 * size * inverse.amax());
            }
        }
    }
}
