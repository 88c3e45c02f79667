//! Seeded random numbers.

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use supple_core::Vector;
use supple_core::math::Vector3;

/// Pseudo-random numbers.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(SplitMix64::seed_from_u64(seed))
    }

    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in -1 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
    }

    /// Gaussian, mean zero, variance one.
    pub fn normal(&mut self) -> f64 {
        let uniform = 0.5 * (self.unit() + 1.0);
        (-2.0 * (1.0 - uniform).ln()).sqrt() * (std::f64::consts::PI * self.unit()).cos()
    }

    pub fn below(&mut self, end: u64) -> u64 {
        self.bits() % end
    }

    /// True with probability 1 / `times`.
    pub fn once_in(&mut self, times: u64) -> bool {
        self.below(times) == 0
    }

    /// Ordinary numbers and numerical edge cases.
    pub fn number(&mut self) -> f64 {
        const AWKWARD: [f64; 12] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            5e-324,
            -5e-324,
            0.0,
            -0.0,
            1e300,
            -1e-300,
        ];
        match self.below(8) {
            0 => AWKWARD[self.below(12) as usize],
            1 => f64::from_bits(self.bits()),
            2 => 1e3 * self.unit(),
            _ => self.unit(),
        }
    }

    /// A point of such numbers.
    pub fn point(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    /// Uniform in -`reach` to `reach` for each joint.
    pub fn joints<const N: usize>(&mut self, reach: f64) -> Vector<N> {
        Vector::from_fn(|_, _| reach * self.unit())
    }
}
