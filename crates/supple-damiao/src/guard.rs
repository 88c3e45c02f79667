//! Conditions of a motor in a running cycle, as named faults.
//!
//! [`MotorGuard::cycle`] is called once per cycle with the feedback that arrived in it. An error code or a motor that
//! came back disabled is a fault in the same cycle, a silent motor in the second cycle. A fault stays until the
//! operator resets the drive: nothing here clears an error or enables a motor.

use crate::feedback::Feedback;
use crate::ranges::Ranges;
use crate::register::{Register, Value};
use crate::status::Status;
use crate::temperature::{Heat, Thermal};
use core::fmt;

/// Cycles without feedback in a row that are a fault.
pub const SILENT_CYCLES: u32 = 2;

/// Why a motor may no longer be driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorFault {
    /// The motor reports an error and has no torque.
    Error(Status),
    /// The motor is disabled though nobody asked for it: it lost its supply, or another host disabled it.
    Disabled,
    /// No feedback in this many cycles in a row.
    Silent {
        /// Cycles.
        cycles: u32,
    },
    /// Hotter than the arm allows.
    Hot {
        /// Temperature \[degrees Celsius\].
        celsius: u8,
    },
    /// The position jumped farther than the motor can turn: a range register changed, or the encoder slipped.
    PositionJump {
        /// Distance \[rad\].
        by_rad: f64,
        /// Distance at the highest speed \[rad\].
        limit_rad: f64,
    },
    /// A register has another value than at the start.
    RegisterChanged {
        /// Register.
        register: Register,
        /// Value at the start.
        was: Value,
        /// Value found.
        is: Value,
    },
    /// Feedback that is not this motor's on its reply id: two motors have one.
    ForeignFeedback {
        /// Low four bits of the id that answered.
        found: u8,
    },
    /// More answers than questions: two motors have this id.
    TwoAnswers,
}

impl fmt::Display for MotorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MotorFault::Error(status) => write!(f, "{status}"),
            MotorFault::Disabled => {
                write!(
                    f,
                    "disabled without a request: lost its supply, or another host"
                )
            }
            MotorFault::Silent { cycles } => write!(f, "no feedback in {cycles} cycles"),
            MotorFault::Hot { celsius } => write!(f, "{celsius} degrees Celsius"),
            MotorFault::PositionJump { by_rad, limit_rad } => write!(
                f,
                "position jumped by {by_rad:.4} rad in a cycle, possible are {limit_rad:.4} rad"
            ),
            MotorFault::RegisterChanged { register, was, is } => {
                write!(f, "{register} changed from {was} to {is}")
            }
            MotorFault::ForeignFeedback { found } => {
                write!(f, "motor {found} answered with its reply id")
            }
            MotorFault::TwoAnswers => write!(f, "two motors answer with its id"),
        }
    }
}

impl core::error::Error for MotorFault {}

/// Guard of one motor while it is meant to be enabled.
#[derive(Clone, Copy, Debug)]
pub struct MotorGuard {
    id: u8,
    ranges: Ranges,
    thermal: Thermal,
    /// Distance that the motor can turn in a cycle \[rad\].
    jump_rad: f64,
    silent: u32,
    /// Last position \[rad\].
    position_rad: Option<f64>,
    heat: Heat,
    celsius: u8,
    fault: Option<MotorFault>,
}

impl MotorGuard {
    /// Guard of the motor with `id`, with the ranges that it reported, in cycles of `period_s` \[s\].
    pub fn new(id: u8, ranges: Ranges, thermal: Thermal, period_s: f64) -> MotorGuard {
        // Rounding moves a position by one step; a bridged cycle doubles the distance.
        let jump_rad = ranges.velocity().max() * period_s + 2.0 * ranges.position().step();
        MotorGuard {
            id,
            ranges,
            thermal,
            jump_rad,
            silent: 0,
            position_rad: None,
            heat: Heat::Normal,
            celsius: 0,
            fault: None,
        }
    }

    /// Judges one cycle. `feedback` is the last one that arrived in it, `None` if none did; `answers` is how many frames
    /// arrived for the one command of the cycle.
    ///
    /// # Errors
    /// The first fault, in this and in all later cycles. Silence is reported as long as it lasts; what follows it is checked again.
    pub fn cycle(&mut self, feedback: Option<&Feedback>, answers: u32) -> Result<(), MotorFault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let found = self.judge(feedback, answers);
        self.fault = found
            .err()
            .filter(|fault| !matches!(fault, MotorFault::Silent { .. }));
        found
    }

    fn judge(&mut self, feedback: Option<&Feedback>, answers: u32) -> Result<(), MotorFault> {
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
        if answers > 1 {
            return Err(MotorFault::TwoAnswers);
        }
        match feedback.status {
            Status::Enabled => {}
            Status::Disabled => return Err(MotorFault::Disabled),
            error => return Err(MotorFault::Error(error)),
        }
        self.celsius = feedback.hottest_celsius();
        self.heat = self.thermal.heat(self.celsius);
        if self.heat == Heat::Fault {
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

    /// Compares a register that was read between cycles with its value at the start.
    ///
    /// # Errors
    /// [`MotorFault::RegisterChanged`], or the earlier fault.
    pub fn register(
        &mut self,
        register: Register,
        was: Value,
        is: Value,
    ) -> Result<(), MotorFault> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        // By bytes, so that a NaN is equal to itself.
        if was.to_bytes() == is.to_bytes() {
            return Ok(());
        }
        let fault = MotorFault::RegisterChanged { register, was, is };
        self.fault = Some(fault);
        Err(fault)
    }

    /// Cycles since the last feedback: 0 in a cycle with one. A state is not used if this is 2 or more.
    pub const fn age_cycles(&self) -> u32 {
        self.silent
    }

    /// How hot the motor is.
    pub const fn heat(&self) -> Heat {
        self.heat
    }

    /// Temperature \[degrees Celsius\]; 0 until the motor has measured it.
    pub const fn celsius(&self) -> u8 {
        self.celsius
    }

    /// Share of the torque limit that the temperature leaves.
    pub fn torque_share(&self) -> f64 {
        self.thermal.torque_share(self.celsius)
    }

    /// The fault, if any.
    pub const fn fault(&self) -> Option<MotorFault> {
        self.fault
    }
}
