//! Detects faults of a motor in the cycle.
//!
//! The drive calls [`MotorGuard::cycle`] once per cycle with the feedback that arrived in it. An error code, or a motor that
//! reports that it is disabled, is a fault in the same cycle; a silent motor is a fault in the second cycle. A fault stays
//! until the operator resets the drive: the guard clears no error and enables no motor.

use crate::feedback::Feedback;
use crate::ranges::Ranges;
use crate::register::{Register, Value};
use crate::status::Status;
use crate::temperature::{TemperatureLevel, TemperatureLimits};
use core::fmt;

/// Number of consecutive cycles without feedback that is a fault.
pub const SILENT_CYCLES: u32 = 2;

/// Fault for which a motor may no longer apply torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorFault {
    /// The motor reports an error and has no torque.
    Error(Status),
    /// The motor is disabled although this host did not disable it: it lost its supply, or another host disabled it.
    Disabled,
    /// No feedback arrived in this number of consecutive cycles.
    Silent {
        /// Number of cycles.
        cycles: u32,
    },
    /// The motor is above the fault temperature.
    Hot {
        /// Temperature \[degrees Celsius\].
        celsius: u8,
    },
    /// The position changed by more than the motor can turn in a cycle: a range register changed, or the encoder slipped.
    PositionJump {
        /// Distance \[rad\].
        by_rad: f64,
        /// Maximum distance in a cycle \[rad\].
        limit_rad: f64,
    },
    /// A register has another value than at start-up.
    RegisterChanged {
        /// Register.
        register: Register,
        /// Value at start-up.
        was: Value,
        /// Value found.
        is: Value,
    },
    /// Feedback of another motor has this motor's reply id: two motors have the same reply id.
    ForeignFeedback {
        /// Low four bits of the id that answered.
        found: u8,
    },
    /// More than one reply arrived to a command: two motors have this id.
    TwoAnswers,
}

impl fmt::Display for MotorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MotorFault::Error(status) => write!(f, "{status}"),
            MotorFault::Disabled => {
                write!(
                    f,
                    "disabled without a request: it lost its supply, or another host disabled it"
                )
            }
            MotorFault::Silent { cycles } => write!(f, "no feedback in {cycles} cycles"),
            MotorFault::Hot { celsius } => write!(f, "{celsius} degrees Celsius"),
            MotorFault::PositionJump { by_rad, limit_rad } => write!(
                f,
                "position jumped by {by_rad:.4} rad in a cycle, the maximum is {limit_rad:.4} rad"
            ),
            MotorFault::RegisterChanged { register, was, is } => {
                write!(f, "{register} changed from {was} to {is}")
            }
            MotorFault::ForeignFeedback { found } => {
                write!(f, "motor {found} replied with the reply id of this motor")
            }
            MotorFault::TwoAnswers => write!(f, "two motors reply with this id"),
        }
    }
}

impl core::error::Error for MotorFault {}

/// Guard of one motor while it should be enabled.
#[derive(Clone, Copy, Debug)]
pub struct MotorGuard {
    id: u8,
    ranges: Ranges,
    thermal: TemperatureLimits,
    /// Maximum distance that the motor can turn in a cycle \[rad\].
    jump_rad: f64,
    silent: u32,
    /// Last position \[rad\].
    position_rad: Option<f64>,
    heat: TemperatureLevel,
    celsius: u8,
    fault: Option<MotorFault>,
}

impl MotorGuard {
    /// Creates the guard of the motor with `id`, which reported `ranges`, for cycles of `period_s` \[s\].
    pub fn new(id: u8, ranges: Ranges, thermal: TemperatureLimits, period_s: f64) -> MotorGuard {
        // Rounding changes a position by one step; a cycle without feedback doubles the distance.
        let jump_rad = ranges.velocity().max() * period_s + 2.0 * ranges.position().step();
        MotorGuard {
            id,
            ranges,
            thermal,
            jump_rad,
            silent: 0,
            position_rad: None,
            heat: TemperatureLevel::Normal,
            celsius: 0,
            fault: None,
        }
    }

    /// Checks one cycle. `feedback` is the last feedback that arrived in the cycle, if any; `replies` is the number of frames
    /// that arrived for the one command of the cycle.
    ///
    /// # Errors
    /// The first fault, in this and in all later cycles. Silence is an exception: it is reported only while it lasts. The status of a hot
    /// motor that switches its torque off replaces [`MotorFault::Hot`].
    pub fn cycle(&mut self, feedback: Option<&Feedback>, replies: u32) -> Result<(), MotorFault> {
        if let Some(fault) = self.fault {
            // A hot motor may switch its torque off later.
            let status = feedback.map(|feedback| feedback.status);
            let later = match (fault, status) {
                (MotorFault::Hot { .. }, Some(Status::Disabled)) => MotorFault::Disabled,
                (MotorFault::Hot { .. }, Some(status)) if status.is_error() => {
                    MotorFault::Error(status)
                }
                _ => fault,
            };
            self.fault = Some(later);
            return Err(later);
        }
        let found = self.check(feedback, replies);
        self.fault = found
            .err()
            .filter(|fault| !matches!(fault, MotorFault::Silent { .. }));
        found
    }

    fn check(&mut self, feedback: Option<&Feedback>, replies: u32) -> Result<(), MotorFault> {
        let Some(feedback) = feedback else {
            self.silent += 1;
            return match self.silent {
                cycles if cycles >= SILENT_CYCLES => Err(MotorFault::Silent { cycles }),
                _ => Ok(()),
            };
        };
        let cycles = self.silent + 1;
        self.silent = 0;
        if feedback.motor != self.id & 0xF {
            let found = feedback.motor;
            return Err(MotorFault::ForeignFeedback { found });
        }
        if replies > 1 {
            return Err(MotorFault::TwoAnswers);
        }
        match feedback.status {
            Status::Enabled => {}
            Status::Disabled => return Err(MotorFault::Disabled),
            error => return Err(MotorFault::Error(error)),
        }
        self.celsius = feedback.hottest_celsius();
        self.heat = self.thermal.level(self.celsius);
        if self.heat == TemperatureLevel::Fault {
            let celsius = self.celsius;
            return Err(MotorFault::Hot { celsius });
        }
        let position_rad = feedback.position_rad(&self.ranges);
        let last_rad = self.position_rad.replace(position_rad);
        if let Some(last_rad) = last_rad {
            let by_rad = (position_rad - last_rad).abs();
            let limit_rad = self.jump_rad * f64::from(cycles);
            if by_rad > limit_rad {
                return Err(MotorFault::PositionJump { by_rad, limit_rad });
            }
        }
        Ok(())
    }

    /// Compares a register that was read between cycles with its value at start-up.
    ///
    /// # Errors
    /// [`MotorFault::RegisterChanged`] if the values differ, or an earlier fault.
    pub fn register(
        &mut self,
        register: Register,
        was: Value,
        is: Value,
    ) -> Result<(), MotorFault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        // The bytes are compared, so that a NaN is equal to itself.
        if was.to_bytes() == is.to_bytes() {
            return Ok(());
        }
        let fault = MotorFault::RegisterChanged { register, was, is };
        self.fault = Some(fault);
        Err(fault)
    }

    /// Returns the number of cycles since the last feedback, 0 in a cycle with feedback. From 2 on, the state is not used.
    pub const fn age_cycles(&self) -> u32 {
        self.silent
    }

    /// Returns the temperature level of the motor.
    pub const fn heat(&self) -> TemperatureLevel {
        self.heat
    }

    /// Temperature \[degrees Celsius\]; 0 until the motor has measured it.
    pub const fn celsius(&self) -> u8 {
        self.celsius
    }

    /// Returns the fraction of the torque limit that the temperature allows.
    pub fn torque_share(&self) -> f64 {
        self.thermal.torque_share(self.celsius)
    }

    /// The fault, if any.
    pub const fn fault(&self) -> Option<MotorFault> {
        self.fault
    }
}
