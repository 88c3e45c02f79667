//! Seeded random numbers for searches and draws: the same seed gives the same bits.

use std::f64::consts::TAU;
use supple_core::math::{cos, sqrt};

/// A stream (splitmix64, Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Uniform in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in \[-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = sqrt(-2.0 * (1.0 - self.uniform()).ln());
        radius * cos(TAU * self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn normal_numbers_have_their_moments() {
        let (mut random, n) = (Random::new(3), 100_000);
        let draws: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let moment = |p: i32| draws.iter().map(|x| x.powi(p)).sum::<f64>() / f64::from(n);
        let error = 1.0 / f64::from(n).sqrt();
        assert!(moment(1).abs() < 5.0 * error);
        assert!((moment(2) - 1.0).abs() < 5.0 * 2.0_f64.sqrt() * error);
        assert!((moment(4) - 3.0).abs() < 5.0 * 96.0_f64.sqrt() * error);
    }
}
