//! The estimate: prior and samples of all joints together, within the bounds.
//!
//! Joints have only the payload and the tilt in common, so that each joint's own unknowns `x` are eliminated first:
//! with `L x + C y = l` for each joint, the shared unknowns `y` solve `(S - sum C^T L^-1 C) y = s - sum C^T L^-1 l`.
//! An unknown beyond its bound is fixed at the bound, and the other unknowns are solved again.

use crate::information::Information;
use crate::prior::unknowns::{ALL, JOINT, SHARED};
use crate::prior::{Prior, joint_of, shared_of};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use supple_core::learned::LearnedTerms;

/// Maximum number of solutions with further unknowns fixed at their bounds.
const ROUNDS: usize = 8;
/// Precision of a fixed unknown relative to the precision of its bound.
const FIXED: f64 = 1e12;

/// An estimate of all unknowns.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Each joint's own unknowns.
    pub joints: Vec<DVector<f64>>,
    /// Shared unknowns.
    pub shared: DVector<f64>,
    /// Covariance of the unknowns in each joint's equations, (ALL, ALL).
    pub covariance: Vec<DMatrix<f64>>,
}

impl Estimate {
    /// Returns the learned terms.
    pub fn terms<const N: usize>(&self) -> LearnedTerms<N> {
        crate::prior::terms_of(&self.joints, &self.shared)
    }

    /// Returns the unknowns of the equations of a joint.
    pub fn unknowns(&self, joint: usize) -> DVector<f64> {
        let mut all = DVector::zeros(ALL);
        all.rows_mut(0, JOINT).copy_from(&self.joints[joint]);
        all.rows_mut(JOINT, SHARED).copy_from(&self.shared);
        all
    }

    /// Returns the standard deviations of the parameters; those of the map are zero.
    pub fn deviations<const N: usize>(&self) -> LearnedTerms<N> {
        let root = |joint: usize, first: usize, count: usize| {
            let covariance = &self.covariance[joint];
            DVector::from_fn(count, |k, _| {
                covariance[(first + k, first + k)].max(0.0).sqrt()
            })
        };
        let joints: Vec<DVector<f64>> = (0..N).map(|joint| root(joint, 0, JOINT)).collect();
        crate::prior::terms_of(&joints, &root(0, JOINT, SHARED))
    }
}

/// Unknowns that are fixed, with their values.
type Fixed = Vec<Option<f64>>;

/// Solves for all unknowns. `None` if the equations are not positive definite, for example because a number is not finite.
pub fn solve<const N: usize>(prior: &Prior<N>, samples: &[Information]) -> Option<Estimate> {
    let mut joint_fixed: Vec<Fixed> = vec![vec![None; JOINT]; N];
    let mut shared_fixed: Fixed = vec![None; SHARED];
    let mut estimate = solve_with(prior, samples, &joint_fixed, &shared_fixed)?;
    for _ in 0..ROUNDS {
        let mut beyond = fix(&estimate.shared, &prior.shared_bound, &mut shared_fixed);
        for (joint, fixed) in joint_fixed.iter_mut().enumerate() {
            beyond |= fix(&estimate.joints[joint], &prior.joint_bound[joint], fixed);
        }
        if !beyond {
            break;
        }
        estimate = solve_with(prior, samples, &joint_fixed, &shared_fixed)?;
    }
    for (x, bound) in estimate.joints.iter_mut().zip(&prior.joint_bound) {
        clamp(x, bound);
    }
    clamp(&mut estimate.shared, &prior.shared_bound);
    let finite = |x: &DVector<f64>| x.iter().all(|x| x.is_finite());
    (finite(&estimate.shared) && estimate.joints.iter().all(finite)).then_some(estimate)
}

/// Returns the estimate before any sample.
pub fn of_prior<const N: usize>(prior: &Prior<N>) -> Option<Estimate> {
    solve(prior, &vec![Information::empty(); N])
}

/// Returns an estimate with these terms, and with the covariance of another estimate.
pub fn with_terms<const N: usize>(estimate: &Estimate, terms: &LearnedTerms<N>) -> Estimate {
    Estimate {
        joints: (0..N).map(|joint| joint_of(terms, joint)).collect(),
        shared: shared_of(&terms.parameters),
        covariance: estimate.covariance.clone(),
    }
}

/// Fixes the unknowns that are beyond their bounds; returns whether there are any.
fn fix(x: &DVector<f64>, bound: &DVector<f64>, fixed: &mut Fixed) -> bool {
    let mut any = false;
    for (k, fixed) in fixed.iter_mut().enumerate() {
        if fixed.is_none() && x[k].abs() > bound[k] {
            *fixed = Some(bound[k].copysign(x[k]));
            any = true;
        }
    }
    any
}

fn clamp(x: &mut DVector<f64>, bound: &DVector<f64>) {
    for (x, bound) in x.iter_mut().zip(bound) {
        *x = x.clamp(-bound, *bound);
    }
}

/// Adds the equations of fixed unknowns.
fn add_fixed(
    fixed: &Fixed,
    bound: &DVector<f64>,
    gram: &mut DMatrix<f64>,
    right: &mut DVector<f64>,
) {
    for (k, value) in fixed.iter().enumerate() {
        if let Some(value) = value {
            let precision = FIXED / bound[k].max(1e-9).powi(2);
            gram[(k, k)] += precision;
            right[k] += precision * value;
        }
    }
}

struct Eliminated {
    factor: Cholesky<f64, Dyn>,
    cross: DMatrix<f64>,
    right: DVector<f64>,
}

fn solve_with<const N: usize>(
    prior: &Prior<N>,
    samples: &[Information],
    joint_fixed: &[Fixed],
    shared_fixed: &Fixed,
) -> Option<Estimate> {
    let mut shared = DMatrix::from_diagonal(&prior.shared_precision);
    let mut shared_right = prior.shared_precision.component_mul(&prior.shared_mean);
    add_fixed(
        shared_fixed,
        &prior.shared_bound,
        &mut shared,
        &mut shared_right,
    );
    let mut eliminated = Vec::with_capacity(N);
    for (joint, sample) in samples.iter().enumerate() {
        let own = sample.gram.view((0, 0), (JOINT, JOINT));
        let mut gram = &prior.joint_precision[joint] + own;
        let mut right =
            &prior.joint_precision[joint] * &prior.joint_mean[joint] + sample.right.rows(0, JOINT);
        add_fixed(
            &joint_fixed[joint],
            &prior.joint_bound[joint],
            &mut gram,
            &mut right,
        );
        let cross = sample.gram.view((0, JOINT), (JOINT, SHARED)).into_owned();
        let factor = Cholesky::new(gram)?;
        shared += sample.gram.view((JOINT, JOINT), (SHARED, SHARED))
            - cross.tr_mul(&factor.solve(&cross));
        shared_right += sample.right.rows(JOINT, SHARED) - cross.tr_mul(&factor.solve(&right));
        eliminated.push(Eliminated {
            factor,
            cross,
            right,
        });
    }
    let shared = Cholesky::new(shared)?;
    let y = shared.solve(&shared_right);
    let shared_covariance = shared.inverse();
    let (mut joints, mut covariance) = (Vec::new(), Vec::new());
    for Eliminated {
        factor,
        cross,
        right,
    } in eliminated
    {
        joints.push(factor.solve(&(right - &cross * &y)));
        let gain = factor.solve(&cross);
        let with_shared = -&gain * &shared_covariance;
        let mut whole = DMatrix::zeros(ALL, ALL);
        let own = factor.inverse() - &with_shared * gain.transpose();
        whole.view_mut((0, 0), (JOINT, JOINT)).copy_from(&own);
        whole
            .view_mut((0, JOINT), (JOINT, SHARED))
            .copy_from(&with_shared);
        whole
            .view_mut((JOINT, 0), (SHARED, JOINT))
            .copy_from(&with_shared.transpose());
        whole
            .view_mut((JOINT, JOINT), (SHARED, SHARED))
            .copy_from(&shared_covariance);
        covariance.push(whole);
    }
    Some(Estimate {
        joints,
        shared: y,
        covariance,
    })
}
