//! Reasons why start-up refuses a motor; each error contains register, found value, expected value and remedy.

use crate::feedback::FeedbackError;
use crate::firmware::{Firmware, FirmwareError};
use crate::register::Register;
use crate::status::Status;
use core::fmt;

/// Refusal of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refusal {
    /// Id of the motor in the arm's file.
    pub motor: u8,
    /// The reason.
    pub problem: Problem,
}

/// Reason of a refusal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Problem {
    /// The motor does not answer.
    Silent,
    /// More than one motor answers.
    TwoAnswers,
    /// A frame with the motor's reply id is not its feedback.
    ForeignFeedback(FeedbackError),
    /// The motor answers with another id than expected.
    ReplyIdMismatch {
        /// Found.
        found: u16,
        /// Expected.
        expected: u16,
    },
    /// The motor answers with frames of the other format.
    FormatMismatch {
        /// Whether the frames of the motor are FD frames.
        found_fd: bool,
    },
    /// The motor was enabled before this host enabled it.
    AlreadyEnabled,
    /// The motor reports an error.
    MotorError(Status),
    /// The motor did not answer the read of a register.
    RegisterNotRead(Register),
    /// An integer register has another value than expected.
    IntegerMismatch {
        /// Register.
        register: Register,
        /// Found.
        found: u32,
        /// Expected.
        expected: u32,
    },
    /// A floating-point register has another value than expected.
    NumberMismatch {
        /// Register.
        register: Register,
        /// Found.
        found: f64,
        /// Expected.
        expected: f64,
    },
    /// The firmware is of another series than expected.
    FirmwareSeriesMismatch {
        /// Found.
        found: Firmware,
        /// Expected, two digits.
        expected: [u8; 2],
    },
    /// The firmware is not supported for an arm.
    UnsupportedFirmware(FirmwareError),
    /// A register does not have the value that was written.
    WriteIgnored {
        /// Register.
        register: Register,
        /// Found after the write.
        found: u32,
        /// Written.
        expected: u32,
    },
    /// The position in the feedback differs from the position in the register.
    PositionMismatch {
        /// Position in the feedback \[rad\].
        feedback_rad: f64,
        /// Position in the register \[rad\].
        register_rad: f64,
    },
}

impl Problem {
    /// Returns the remedy.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Problem::Silent => {
                "check its supply, cable and bit rate, and its id with `supple motors`"
            }
            Problem::TwoAnswers => {
                "give every motor its own id with `supple motors`, with one motor at a time on the bus"
            }
            Problem::ForeignFeedback(_) => {
                "give every motor its own id and MST_ID with `supple motors`, with one motor at a time on the bus"
            }
            Problem::ReplyIdMismatch { .. } => {
                "set MST_ID of the motor, or reply_id in the arm's file"
            }
            Problem::FormatMismatch { .. } => {
                "set can_br of all motors to the same format, and `format` in the arm's file accordingly"
            }
            Problem::AlreadyEnabled => "stop the other host, or switch the motor off and on",
            Problem::MotorError(_) => {
                "remove the cause, let hot motors cool down, then clear it with `supple motors`"
            }
            Problem::RegisterNotRead(_) => {
                "check the cable; firmware below version 13 has no registers"
            }
            Problem::IntegerMismatch { .. } => {
                "set the register with `supple motors`, or correct the arm's file"
            }
            Problem::NumberMismatch { register, .. } => match *register {
                Register::GEAR_RATIO => {
                    "the motor is of another type, or two motors are swapped: check ids and the arm's file"
                }
                _ => {
                    "check that the motor is the right one, then correct the arm's file; never write this register"
                }
            },
            Problem::FirmwareSeriesMismatch { .. } => {
                "the motor is of another type, or two motors are swapped: check ids and the arm's file"
            }
            Problem::UnsupportedFirmware(_) => {
                "update the motor's firmware with the maker's program"
            }
            Problem::WriteIgnored { .. } => {
                "update the motor's firmware, or allow a motor without watchdog in the arm's file with without_watchdog = true"
            }
            Problem::PositionMismatch { .. } => {
                "switch the motor off and on; do not set a zero position while it turns"
            }
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Silent => write!(f, "does not answer"),
            Problem::TwoAnswers => write!(f, "two motors answer with this id"),
            Problem::ForeignFeedback(error) => write!(f, "{error}"),
            Problem::ReplyIdMismatch { found, expected } => {
                write!(f, "answers with id {found:#05x}, expected {expected:#05x}")
            }
            Problem::FormatMismatch { found_fd } => {
                let (found, expected) = match found_fd {
                    true => ("FD", "classic"),
                    false => ("classic", "FD"),
                };
                write!(f, "answers with {found} frames, expected {expected}")
            }
            Problem::AlreadyEnabled => write!(f, "is already enabled"),
            Problem::MotorError(status) => write!(f, "reports: {status}"),
            Problem::RegisterNotRead(register) => write!(f, "{register} does not answer"),
            Problem::IntegerMismatch {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found}, expected {expected}"),
            Problem::NumberMismatch {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found}, expected {expected}"),
            Problem::FirmwareSeriesMismatch { found, expected } => {
                let [a, b] = expected.map(char::from);
                write!(f, "{} is {found}, expected {a}{b}..", Register::FIRMWARE)
            }
            Problem::UnsupportedFirmware(error) => write!(f, "{}: {error}", Register::FIRMWARE),
            Problem::WriteIgnored {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found} after {expected} was written"),
            Problem::PositionMismatch {
                feedback_rad,
                register_rad,
            } => write!(
                f,
                "position is {feedback_rad:.4} rad in its feedback and {register_rad:.4} rad in {}",
                Register::SHAFT_POSITION
            ),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let remedy = self.problem.remedy();
        write!(f, "motor {} {}; {remedy}", self.motor, self.problem)
    }
}

impl core::error::Error for Refusal {}
