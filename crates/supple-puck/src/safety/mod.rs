//! The safety module: its mode, its limits, and the pendant's lights and buttons.
//!
//! The safety module monitors torque commands and position replies. It ends torque mode if a torque, a speed or the voltage
//! exceeds its limit, or if position replies stop. The host can lower the mode of the module but never raise it; that
//! requires a person who presses the pendant.
//! Source: libbarrett, btclient, OWD, manual page 48.

mod limits;
mod pendant;

pub use limits::{SafetyLimits, SafetyLimitsError, SpeedLimit, SpeedLimitError};
pub use pendant::{Button, Level, PenWord, Pendant, PendantError, SevenSegment};

use crate::status::UnknownValue;

/// [`Property::MODE`](crate::Property::MODE) of the safety module, lowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SafetyMode {
    /// Emergency stop: the motor pucks have no power and lose their positions.
    EStop = 0,
    /// The motors brake.
    Idle = 1,
    /// The motors apply torques.
    Active = 2,
}

impl SafetyMode {
    /// Converts the property's value.
    ///
    /// # Errors
    /// [`UnknownValue`] for a value other than 0, 1 or 2.
    pub const fn from_value(value: i32) -> Result<SafetyMode, UnknownValue> {
        match value {
            0 => Ok(SafetyMode::EStop),
            1 => Ok(SafetyMode::Idle),
            2 => Ok(SafetyMode::Active),
            _ => Err(UnknownValue {
                property: "MODE of the safety module",
                value,
                expected: "0 (e-stop), 1 (idle) or 2 (active)",
            }),
        }
    }

    /// The property's value.
    pub const fn value(self) -> i16 {
        self as i16
    }

    /// Returns the mode after the host has requested `requested`: the module accepts a lower mode and ignores a higher one.
    pub fn after_request(self, requested: SafetyMode) -> SafetyMode {
        self.min(requested)
    }
}
