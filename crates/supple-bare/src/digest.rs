//! A hash of many numbers.

use supple_core::{Matrix, Pose};

/// Fowler-Noll-Vo hash, 64 bits, of the bytes of all added numbers.
pub struct Digest(u64);

impl Digest {
    pub const fn new() -> Digest {
        Digest(0xcbf2_9ce4_8422_2325)
    }

    pub fn number(&mut self, value: f64) {
        for byte in value.to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    pub fn matrix<const R: usize, const C: usize>(&mut self, values: &Matrix<R, C>) {
        values.iter().for_each(|value| self.number(*value));
    }

    pub fn pose(&mut self, pose: &Pose) {
        self.matrix(&pose.rotation);
        self.matrix(&pose.translation);
    }

    pub fn value(&self) -> u64 {
        self.0
    }
}
