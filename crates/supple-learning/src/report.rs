//! What a learner has estimated.

use crate::freeze::Frozen;
use supple_core::learned::LearnedTerms;

/// State of a learner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<const N: usize> {
    /// Estimated terms; those in force follow them with a delay.
    pub terms: LearnedTerms<N>,
    /// Standard deviation of each, as far as the prior and the noise model go.
    pub deviations: LearnedTerms<N>,
    /// Time of motion that each joint's samples weigh, after forgetting \[s\].
    pub learned_s: [f64; N],
    /// Root mean square of the torque that the terms leave unexplained, by joint \[N m\]; zero without samples.
    pub residual_nm: [f64; N],
    /// Number of intervals that were rejected because a torque acted that the uncertainty does not explain.
    pub disturbances: u64,
    /// Why nothing is learned at the moment.
    pub frozen: Option<Frozen>,
}
