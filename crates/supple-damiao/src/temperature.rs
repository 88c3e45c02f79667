//! Temperature limits of a motor: with rising temperature first a warning, then a decreasing torque limit, then a fault.

/// Temperature limits for warning, derating and fault, ascending \[degrees Celsius\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureLimits {
    warning_celsius: f64,
    derating_celsius: f64,
    fault_celsius: f64,
}

/// Temperature level of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TemperatureLevel {
    /// Below the warning.
    Normal,
    /// At or above the warning.
    Warning,
    /// At or above the temperature from which the torque limit decreases.
    Derating,
    /// At or above the fault.
    Fault,
}

/// Fraction of the torque limit just below the fault temperature, with which an arm can still hold most poses.
pub const MIN_SHARE: f64 = 0.5;

impl TemperatureLimits {
    /// Creates the limits; returns `None` unless the temperatures are finite and ascending.
    pub fn new(
        warning_celsius: f64,
        derating_celsius: f64,
        fault_celsius: f64,
    ) -> Option<TemperatureLimits> {
        let ascending = warning_celsius < derating_celsius && derating_celsius < fault_celsius;
        let finite = warning_celsius.is_finite() && fault_celsius.is_finite();
        (ascending && finite).then_some(TemperatureLimits {
            warning_celsius,
            derating_celsius,
            fault_celsius,
        })
    }

    /// Returns the level of `celsius`. A temperature of 0 means that the motor has not measured it yet, and is normal.
    pub fn level(&self, celsius: u8) -> TemperatureLevel {
        let celsius = f64::from(celsius);
        if celsius >= self.fault_celsius {
            TemperatureLevel::Fault
        } else if celsius >= self.derating_celsius {
            TemperatureLevel::Derating
        } else if celsius >= self.warning_celsius {
            TemperatureLevel::Warning
        } else {
            TemperatureLevel::Normal
        }
    }

    /// Returns the allowed fraction of the torque limit at `celsius`: 1 below derating, decreasing linearly to [`MIN_SHARE`] at
    /// the fault.
    pub fn torque_share(&self, celsius: u8) -> f64 {
        let above = f64::from(celsius) - self.derating_celsius;
        let range = self.fault_celsius - self.derating_celsius;
        1.0 - (1.0 - MIN_SHARE) * (above / range).clamp(0.0, 1.0)
    }
}
