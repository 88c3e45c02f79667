//! Linear codes, which represent numbers of a closed interval as unsigned integers of 12 or 16 bits.
//!
//! ```text
//! code = round((x - min) / (max - min) (2^bits - 1))      x = code / (2^bits - 1) (max - min) + min
//! ```
//!
//! Public drivers round down, which biases every torque by half a step and changes 8 to 18 % of all codes in a round
//! trip. This crate uses the nearest code: the error is at most half a step, and every code survives a round trip.

use core::fmt;

/// Linear code of an interval with a number of bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearCode {
    min: f64,
    max: f64,
    max_code: u16,
}

/// Error: the value is not a finite number and has no code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotANumber {
    /// The quantity.
    pub quantity: &'static str,
}

impl fmt::Display for NotANumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is not a finite number", self.quantity)
    }
}

impl core::error::Error for NotANumber {}

impl LinearCode {
    /// Creates the code of `min..=max` with 1 to 16 bits. The caller has checked that both ends are finite and `min < max`.
    pub(crate) const fn new(min: f64, max: f64, bits: u32) -> LinearCode {
        LinearCode {
            min,
            max,
            max_code: (u32::MAX >> (32 - bits)) as u16,
        }
    }

    /// Returns the nearest code; a value outside the interval gets the code of the nearer end.
    ///
    /// # Errors
    /// [`NotANumber`] for a value that is not finite.
    pub fn encode(&self, value: f64, quantity: &'static str) -> Result<u16, NotANumber> {
        if !value.is_finite() {
            return Err(NotANumber { quantity });
        }
        let value = value.clamp(self.min, self.max);
        let fraction = (value - self.min) / (self.max - self.min);
        // The value is not negative, so the cast rounds down.
        Ok((fraction * f64::from(self.max_code) + 0.5) as u16)
    }

    /// Returns the value of a code; ignores bits above those of the code.
    pub fn decode(&self, code: u16) -> f64 {
        let code = f64::from(code & self.max_code);
        code / f64::from(self.max_code) * (self.max - self.min) + self.min
    }

    /// Difference between neighbouring codes.
    pub fn step(&self) -> f64 {
        (self.max - self.min) / f64::from(self.max_code)
    }

    /// The upper end of the interval.
    pub const fn max(&self) -> f64 {
        self.max
    }
}
