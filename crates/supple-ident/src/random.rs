//! Normal random numbers for searches and draws; the same seed gives bit-identical numbers.

use std::f64::consts::TAU;
use supple_core::math::{cos, sqrt};
pub use supple_random::Random;

/// Draws of the normal distribution.
pub trait Normal {
    /// Normal with mean 0 and standard deviation 1 (Box and Muller).
    fn normal(&mut self) -> f64;
}

impl Normal for Random {
    fn normal(&mut self) -> f64 {
        let radius = sqrt(-2.0 * (1.0 - self.uniform()).ln());
        radius * cos(TAU * self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::{Normal, Random};

    #[test]
    fn normal_numbers_have_the_expected_moments() {
        let (mut random, n) = (Random::new(3), 100_000);
        let draws: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let moment = |p: i32| draws.iter().map(|x| x.powi(p)).sum::<f64>() / f64::from(n);
        let error = 1.0 / f64::from(n).sqrt();
        assert!(moment(1).abs() < 5.0 * error);
        assert!((moment(2) - 1.0).abs() < 5.0 * 2.0_f64.sqrt() * error);
        assert!((moment(4) - 3.0).abs() < 5.0 * 96.0_f64.sqrt() * error);
    }
}
