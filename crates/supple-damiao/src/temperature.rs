//! Temperature of a motor: warning, then a decreasing torque limit, then a fault.

/// The three temperatures \[degrees Celsius\], ascending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    warning_celsius: f64,
    derating_celsius: f64,
    fault_celsius: f64,
}

/// How hot a motor is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Heat {
    /// Below the warning.
    Normal,
    /// At or above the warning.
    Warning,
    /// At or above the temperature from which the torque limit decreases.
    Derating,
    /// At or above the fault.
    Fault,
}

/// Share of the torque limit that is left just below the fault: an arm in most poses still carries itself.
pub const MIN_SHARE: f64 = 0.5;

impl Thermal {
    /// From three temperatures; `None` unless they are finite and ascending.
    pub fn new(warning_celsius: f64, derating_celsius: f64, fault_celsius: f64) -> Option<Thermal> {
        let ascending = warning_celsius < derating_celsius && derating_celsius < fault_celsius;
        let finite = warning_celsius.is_finite() && fault_celsius.is_finite();
        (ascending && finite).then_some(Thermal {
            warning_celsius,
            derating_celsius,
            fault_celsius,
        })
    }

    /// How hot a motor of `celsius` is. A temperature of 0 is one that the motor has not measured yet, and is normal.
    pub fn heat(&self, celsius: u8) -> Heat {
        let celsius = f64::from(celsius);
        if celsius >= self.fault_celsius {
            Heat::Fault
        } else if celsius >= self.derating_celsius {
            Heat::Derating
        } else if celsius >= self.warning_celsius {
            Heat::Warning
        } else {
            Heat::Normal
        }
    }

    /// Share of the torque limit at `celsius`: 1 below derating, then falling linearly to [`MIN_SHARE`] at the fault.
    pub fn torque_share(&self, celsius: u8) -> f64 {
        let above = f64::from(celsius) - self.derating_celsius;
        let range = self.fault_celsius - self.derating_celsius;
        1.0 - (1.0 - MIN_SHARE) * (above / range).clamp(0.0, 1.0)
    }
}
