//! Seeded random numbers, with numerical edge cases.

use supple_core::Vector;
use supple_core::math::Vector3;
pub use supple_random::Random;

/// Draws that the tests need.
pub trait Draws {
    /// Gaussian, mean zero, variance one.
    fn normal(&mut self) -> f64;
    /// True with probability 1 / `times`.
    fn once_in(&mut self, times: u64) -> bool;
    /// Ordinary numbers and numerical edge cases.
    fn number(&mut self) -> f64;
    /// A point of such numbers.
    fn point(&mut self) -> Vector3<f64>;
    /// Uniform in -`reach` to `reach` for each joint.
    fn joints<const N: usize>(&mut self, reach: f64) -> Vector<N>;
}

impl Draws for Random {
    fn normal(&mut self) -> f64 {
        let uniform = 0.5 * (self.signed() + 1.0);
        (-2.0 * (1.0 - uniform).ln()).sqrt() * (std::f64::consts::PI * self.signed()).cos()
    }

    fn once_in(&mut self, times: u64) -> bool {
        self.below(times) == 0
    }

    fn number(&mut self) -> f64 {
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
            2 => 1e3 * self.signed(),
            _ => self.signed(),
        }
    }

    fn point(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    fn joints<const N: usize>(&mut self, reach: f64) -> Vector<N> {
        Vector::from_fn(|_, _| reach * self.signed())
    }
}
