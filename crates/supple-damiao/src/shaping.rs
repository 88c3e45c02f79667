//! First-order noise shaping of the torque: the quantisation error is carried over to the next cycle.
//!
//! ```text
//! u[k] = round(torque[k] + e[k])      e[k+1] = torque[k] + e[k] - u[k]
//! ```
//!
//! The sum of the sent torques differs from the sum of the requested torques by at most half a step at any time: over a
//! second at 1 kHz, the mean torque of an 8009 (step 26 mN m) is exact to 0.013 mN m. A constant torque between two codes,
//! such as zero, is sent as a pattern of these two codes.

use crate::code::NotANumber;
use crate::ranges::Ranges;

/// Noise shaper of one motor's torque; holds the carried quantisation error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TorqueShaper {
    carried_nm: f64,
}

impl TorqueShaper {
    /// Creates a shaper without carried error.
    pub const fn new() -> TorqueShaper {
        TorqueShaper { carried_nm: 0.0 }
    }

    /// Returns the error that the next cycle adds \[N m\], at most half a step.
    pub const fn carried_nm(&self) -> f64 {
        self.carried_nm
    }

    /// Encodes `torque_nm` \[N m\] plus the carried error. A torque outside the range saturates and carries no error.
    ///
    /// # Errors
    /// [`NotANumber`] for a torque that is not finite; the carried error is then dropped.
    pub fn encode(&mut self, torque_nm: f64, ranges: &Ranges) -> Result<u16, NotANumber> {
        let code = ranges.torque();
        let wanted_nm = torque_nm + self.carried_nm;
        self.carried_nm = 0.0;
        let sent = code.encode(wanted_nm, "torque")?;
        let left_nm = wanted_nm - code.decode(sent);
        let half_nm = 0.5 * code.step();
        if left_nm.abs() <= half_nm * (1.0 + 1e-9) {
            self.carried_nm = left_nm.clamp(-half_nm, half_nm);
        }
        Ok(sent)
    }
}
