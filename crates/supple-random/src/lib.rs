//! Seeded random numbers for searches, emulators, injected faults, tests and benchmarks.
//!
//! The same seed gives bit-identical numbers on every machine and in every build. The numbers are unsuitable for secrets, and for
//! the noise of the simulated plant, which has its own generator.
#![no_std]
#![forbid(unsafe_code)]

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A random-number generator.
#[derive(Clone, Debug)]
pub struct Random(SplitMix64);

impl Random {
    /// Creates a generator from a seed.
    pub fn new(seed: u64) -> Random {
        Random(SplitMix64::seed_from_u64(seed))
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a number below `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: u64) -> u64 {
        self.bits() % end.max(1)
    }

    /// Returns an index into `length` items; 0 if there are no items.
    pub fn index(&mut self, length: usize) -> usize {
        self.below(length as u64) as usize
    }

    /// Returns a uniformly distributed number in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a uniformly distributed number in \[-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    /// Results of searches and experiments depend on these numbers.
    #[test]
    fn the_numbers_of_a_seed_never_change() {
        let mut random = Random::new(1);
        assert_eq!(random.bits(), 0x910a_2dec_8902_5cc1);
        assert_eq!(random.below(1000), 0xbeeb_8da1_658e_ec67 % 1000);
        let third = 0xf893_a2ee_fb32_555e_u64;
        assert_eq!(random.uniform(), (third >> 11) as f64 * (-53.0_f64).exp2());
    }

    #[test]
    fn numbers_are_in_their_ranges() {
        let mut random = Random::new(2);
        for _ in 0..1000 {
            assert!((0.0..1.0).contains(&random.uniform()));
            assert!((-1.0..1.0).contains(&random.signed()));
            assert!(random.index(7) < 7);
        }
        assert_eq!((random.below(0), random.index(0)), (0, 0));
    }
}
