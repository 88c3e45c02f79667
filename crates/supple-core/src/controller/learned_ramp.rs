//! The learned terms in force, and the ramp to new terms.

use crate::model::learned::LearnedTerms;

/// Time in which new terms come into force \[s\].
pub const LEARNED_RAMP_S: f64 = 1.0;

/// The learned terms in force, and the ramp to their target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Learned<const N: usize> {
    /// Whether learning is on, so that new terms are accepted.
    pub on: bool,
    pub current: LearnedTerms<N>,
    pub target: LearnedTerms<N>,
    /// Cycles until the target is in force.
    pub cycles_left: u32,
    /// Whether any term is not zero; otherwise no learned torque is computed.
    pub in_use: bool,
}

impl<const N: usize> Learned<N> {
    /// Starts with the terms of the configuration in force.
    pub fn new(initial: &LearnedTerms<N>) -> Self {
        Learned {
            on: false,
            current: *initial,
            target: *initial,
            cycles_left: 0,
            in_use: *initial != LearnedTerms::zero(),
        }
    }

    /// Starts a ramp to other terms.
    pub fn approach(&mut self, target: LearnedTerms<N>, period_s: f64) {
        self.target = target;
        self.cycles_left = (LEARNED_RAMP_S / period_s) as u32 + 1;
        self.in_use = true;
    }

    /// Advances the ramp by one cycle. The ramp ends exactly at the target.
    #[inline(never)]
    pub fn advance(&mut self) {
        let share = 1.0 / f64::from(self.cycles_left);
        self.cycles_left -= 1;
        if self.cycles_left == 0 {
            self.current = self.target;
            self.in_use = self.current != LearnedTerms::zero();
            return;
        }
        self.current
            .each(&self.target, |now, target| *now += (target - *now) * share);
    }
}
