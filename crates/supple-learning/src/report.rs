//! Report of a learner's estimates.

use crate::freeze::FreezeReason;
use supple_core::Vector;
use supple_core::learned::LearnedTerms;

/// State of a learner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<const N: usize> {
    /// Estimated terms; the controller applies them with a delay.
    pub terms: LearnedTerms<N>,
    /// Standard deviation of each term, according to the prior and the noise model.
    pub deviations: LearnedTerms<N>,
    /// Weight of each joint's samples as time of motion, after forgetting \[s\].
    pub learned_s: [f64; N],
    /// Root mean square of the torque that the terms leave unexplained, by joint \[N m\]; zero without samples.
    pub residual_nm: [f64; N],
    /// Number of intervals that were rejected because a torque acted that the uncertainty does not explain.
    pub disturbances: u64,
    /// Reason why nothing is learned at the moment.
    pub frozen: Option<FreezeReason>,
}

impl<const N: usize> Report<N> {
    /// Returns the source of the terms, with their uncertainty, for the TOML of an arm.
    pub fn source(&self) -> String {
        let with_deviation = |value: Vector<N>, deviation: Vector<N>| {
            let each = value.iter().zip(&deviation);
            let each: Vec<String> = each.map(|(v, d)| format!("{v:.4} +- {d:.4}")).collect();
            each.join(", ")
        };
        let (terms, deviations) = (&self.terms.parameters, &self.deviations.parameters);
        let times: Vec<String> = self.learned_s.iter().map(|s| format!("{s:.1}")).collect();
        format!(
            "learned while moving, from {} s of motion by joint; standard deviations: Coulomb friction {} N m; payload \
             {:.4} +- {:.4} kg",
            times.join(", "),
            with_deviation(terms.coulomb_nm, deviations.coulomb_nm),
            terms.payload_kg,
            deviations.payload_kg
        )
    }
}
