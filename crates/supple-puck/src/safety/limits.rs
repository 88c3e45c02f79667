//! Limits that the safety module monitors, and resets at power-up.

use crate::property::{Property, Value};
use crate::torque::PuckTorque;
use core::fmt;

/// Limit of a Cartesian speed in Q4.12 m/s, 1/4096 to 7.9998 m/s. It applies to the elbow, 550 mm from the shoulder, and to
/// the point 350 mm beyond the elbow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SpeedLimit(i16);

/// Error: the speed is not a valid limit of the safety module \[m/s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLimitError(pub f64);

impl fmt::Display for SpeedLimitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "speed limit is {} m/s, it must be at least 1/4096 and below 8",
            self.0
        )
    }
}

impl core::error::Error for SpeedLimitError {}

impl SpeedLimit {
    const PER_M_PER_S: f64 = 4096.0;

    /// Returns the largest representable limit that is not above `speed_m_per_s`. Values below 1/4096 m/s are an error instead
    /// of being rounded to 0, because 0 means "no limit".
    ///
    /// # Errors
    /// [`SpeedLimitError`] for a value outside the range from 1/4096 to just below 8.
    pub fn from_m_per_s(speed_m_per_s: f64) -> Result<SpeedLimit, SpeedLimitError> {
        let raw = libm::floor(speed_m_per_s * SpeedLimit::PER_M_PER_S);
        if (1.0..=f64::from(i16::MAX)).contains(&raw) {
            Ok(SpeedLimit(raw as i16))
        } else {
            Err(SpeedLimitError(speed_m_per_s))
        }
    }

    /// Converts the value of [`Property::VL1`] or [`Property::VL2`]; `Ok(None)` means no limit.
    ///
    /// # Errors
    /// [`SpeedLimitError`] with the corresponding speed for a value that is negative or does not fit into 16 bits.
    pub fn from_value(value: i32) -> Result<Option<SpeedLimit>, SpeedLimitError> {
        match i16::try_from(value) {
            Ok(0) => Ok(None),
            Ok(raw) if raw > 0 => Ok(Some(SpeedLimit(raw))),
            _ => Err(SpeedLimitError(f64::from(value) / SpeedLimit::PER_M_PER_S)),
        }
    }

    /// The property's value, 1 to 32767.
    pub const fn value(self) -> i16 {
        self.0
    }

    /// The limit \[m/s\].
    pub fn m_per_s(self) -> f64 {
        f64::from(self.0) / SpeedLimit::PER_M_PER_S
    }
}

/// The four limits of the safety module. The defaults are those of the module according to libbarrett: 0.5 and 1 m/s, 4731 and 5204
/// units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafetyLimits {
    /// VL1: speed above which the pendant warns; `None` for no warning.
    pub speed_warning: Option<SpeedLimit>,
    /// VL2: speed above which the module enters idle; `None` for no limit.
    pub speed_fault: Option<SpeedLimit>,
    /// TL1: commanded torque of any motor above which the pendant warns. Not negative.
    pub torque_warning: PuckTorque,
    /// TL2: commanded torque of any motor above which the module enters idle. Not negative.
    pub torque_fault: PuckTorque,
}

/// Error: the limits are inconsistent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SafetyLimitsError {
    /// The speed warning limit is above the fault limit.
    Speed(SpeedLimit, SpeedLimit),
    /// The torque warning limit is above the fault limit.
    Torque(PuckTorque, PuckTorque),
    /// A torque limit is negative.
    Negative(PuckTorque),
}

impl fmt::Display for SafetyLimitsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SafetyLimitsError::Speed(warning, fault) => write!(
                f,
                "speed warning is {} m/s, it must not be above the fault at {} m/s",
                warning.m_per_s(),
                fault.m_per_s()
            ),
            SafetyLimitsError::Torque(warning, fault) => write!(
                f,
                "torque warning is {} units, it must not be above the fault at {}",
                warning.units(),
                fault.units()
            ),
            SafetyLimitsError::Negative(torque) => {
                write!(
                    f,
                    "torque limit is {} units, it must not be negative",
                    torque.units()
                )
            }
        }
    }
}

impl core::error::Error for SafetyLimitsError {}

impl Default for SafetyLimits {
    fn default() -> SafetyLimits {
        SafetyLimits {
            speed_warning: Some(SpeedLimit(2048)),
            speed_fault: Some(SpeedLimit(4096)),
            torque_warning: PuckTorque::saturating(4731),
            torque_fault: PuckTorque::saturating(5204),
        }
    }
}

impl SafetyLimits {
    /// Rejects inconsistent limits.
    ///
    /// # Errors
    /// [`SafetyLimitsError`] for a warning limit above its fault limit, or a negative torque.
    pub fn validate(&self) -> Result<(), SafetyLimitsError> {
        for torque in [self.torque_warning, self.torque_fault] {
            if torque < PuckTorque::ZERO {
                return Err(SafetyLimitsError::Negative(torque));
            }
        }
        if self.torque_warning > self.torque_fault {
            return Err(SafetyLimitsError::Torque(
                self.torque_warning,
                self.torque_fault,
            ));
        }
        match (self.speed_warning, self.speed_fault) {
            (Some(warning), Some(fault)) if warning > fault => {
                Err(SafetyLimitsError::Speed(warning, fault))
            }
            _ => Ok(()),
        }
    }

    /// Returns the properties and values to set, at intervals of at least 10 ms.
    pub fn settings(&self) -> [(Property, Value); 4] {
        let speed = |limit: Option<SpeedLimit>| limit.map_or(0, SpeedLimit::value);
        [
            (Property::VL1, speed(self.speed_warning)),
            (Property::VL2, speed(self.speed_fault)),
            (Property::TL1, self.torque_warning.units()),
            (Property::TL2, self.torque_fault.units()),
        ]
        .map(|(property, value)| (property, Value::Wide(i32::from(value))))
    }
}
