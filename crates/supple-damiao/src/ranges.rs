//! Ranges of position, velocity and torque in the frames of one motor, from its registers PMAX, VMAX and TMAX.

use crate::code::LinearCode;
use core::fmt;

/// Ranges that a motor reported. They are not a table, because they differ between motors of one type (velocity of the
/// 4340: 8 in several libraries, 10 in the motor).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    position: LinearCode,
    velocity: LinearCode,
    torque: LinearCode,
}

/// Error: a range is not finite and positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeError {
    /// Name of the register.
    pub register: &'static str,
    /// Value found.
    pub found: f64,
}

impl fmt::Display for RangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RangeError { register, found } = self;
        write!(
            f,
            "{register} is {found}, it must be finite, positive and at most 10000"
        )
    }
}

impl core::error::Error for RangeError {}

impl Ranges {
    /// Creates the symmetric ranges from PMAX \[rad\], VMAX \[rad/s\] and TMAX \[N m\].
    ///
    /// # Errors
    /// [`RangeError`] for a value that is not finite, not positive or above 10000.
    pub fn new(
        position_rad: f64,
        velocity_rad_per_s: f64,
        torque_nm: f64,
    ) -> Result<Ranges, RangeError> {
        let code = |register, range: f64, bits| {
            if range > 0.0 && range <= 1e4 {
                Ok(LinearCode::new(-range, range, bits))
            } else {
                Err(RangeError {
                    register,
                    found: range,
                })
            }
        };
        Ok(Ranges {
            position: code("PMAX", position_rad, 16)?,
            velocity: code("VMAX", velocity_rad_per_s, 12)?,
            torque: code("TMAX", torque_nm, 12)?,
        })
    }

    /// Code of the position \[rad\], 16 bits.
    pub const fn position(&self) -> &LinearCode {
        &self.position
    }

    /// Code of the velocity \[rad/s\], 12 bits.
    pub const fn velocity(&self) -> &LinearCode {
        &self.velocity
    }

    /// Code of the torque \[N m\], 12 bits.
    pub const fn torque(&self) -> &LinearCode {
        &self.torque
    }
}
