//! Why a start-up refuses a motor: register, found, expected and remedy.

use crate::feedback::FeedbackError;
use crate::firmware::{Firmware, FirmwareError};
use crate::register::Register;
use crate::status::Status;
use core::fmt;

/// Why a motor is refused.
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
    /// No answer at all.
    Silent,
    /// More than one motor answers.
    TwoAnswers,
    /// A frame with its reply id is not its feedback.
    Reply(FeedbackError),
    /// It answers with another id than expected.
    ReplyId {
        /// Found.
        found: u16,
        /// Expected.
        expected: u16,
    },
    /// Answers in frames of the other format.
    Format {
        /// Whether its frames are FD.
        found_fd: bool,
    },
    /// It is enabled before this host enabled it.
    Enabled,
    /// It reports an error.
    Error(Status),
    /// A register did not answer.
    NotRead(Register),
    /// An integer register that differs.
    Integer {
        /// Register.
        register: Register,
        /// Found.
        found: u32,
        /// Expected.
        expected: u32,
    },
    /// A number that differs.
    Number {
        /// Register.
        register: Register,
        /// Found.
        found: f64,
        /// Expected.
        expected: f64,
    },
    /// A firmware of another series than expected.
    Series {
        /// Found.
        found: Firmware,
        /// Expected, two digits.
        expected: [u8; 2],
    },
    /// A firmware that cannot carry an arm.
    Firmware(FirmwareError),
    /// A register that keeps another value than the one written.
    NotWritten {
        /// Register.
        register: Register,
        /// Found after the write.
        found: u32,
        /// Written.
        expected: u32,
    },
    /// Feedback and register disagree about the position.
    Position {
        /// By feedback \[rad\].
        feedback_rad: f64,
        /// By register \[rad\].
        register_rad: f64,
    },
}

impl Problem {
    /// What to do about it.
    pub const fn remedy(&self) -> &'static str {
        match self {
            Problem::Silent => {
                "check its supply, cable and bit rate, and its id with `supple motors`"
            }
            Problem::TwoAnswers => {
                "give every motor its own id, one at a time on the bus: `supple motors`"
            }
            Problem::Reply(_) => {
                "give every motor its own id and its own MST_ID, one at a time on the bus: `supple motors`"
            }
            Problem::ReplyId { .. } => "set MST_ID of the motor, or reply_id in the arm's file",
            Problem::Format { .. } => {
                "set can_br of all motors alike, and `format` in the arm's file to it"
            }
            Problem::Enabled => "stop the other host, or switch the motor off and on",
            Problem::Error(_) => {
                "remove the cause, let hot motors cool down, then clear it with `supple motors`"
            }
            Problem::NotRead(_) => "check the cable; firmware below version 13 has no registers",
            Problem::Integer { .. } => {
                "set the register with `supple motors`, or correct the arm's file"
            }
            Problem::Number { register, .. } => match *register {
                Register::GEAR_RATIO => {
                    "another type of motor, or two motors swapped: check ids and the arm's file"
                }
                _ => {
                    "correct the arm's file if the motor is the right one; never write this register"
                }
            },
            Problem::Series { .. } => {
                "another type of motor, or two motors swapped: check ids and the arm's file"
            }
            Problem::Firmware(_) => "update the motor's firmware with the maker's program",
            Problem::NotWritten { .. } => {
                "update its firmware, or allow it by name in the arm's file with without_watchdog = true"
            }
            Problem::Position { .. } => {
                "switch the motor off and on; do not set a zero while it turns"
            }
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Silent => write!(f, "does not answer"),
            Problem::TwoAnswers => write!(f, "two motors answer with this id"),
            Problem::Reply(error) => write!(f, "{error}"),
            Problem::ReplyId { found, expected } => {
                write!(f, "answers with id {found:#05x}, expected {expected:#05x}")
            }
            Problem::Format { found_fd } => {
                let (found, expected) = match found_fd {
                    true => ("FD", "classic"),
                    false => ("classic", "FD"),
                };
                write!(f, "answers with {found} frames, expected {expected}")
            }
            Problem::Enabled => write!(f, "is already enabled"),
            Problem::Error(status) => write!(f, "reports: {status}"),
            Problem::NotRead(register) => write!(f, "{register} does not answer"),
            Problem::Integer {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found}, expected {expected}"),
            Problem::Number {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found}, expected {expected}"),
            Problem::Series { found, expected } => {
                let [a, b] = expected.map(char::from);
                write!(f, "{} is {found}, expected {a}{b}..", Register::FIRMWARE)
            }
            Problem::Firmware(error) => write!(f, "{}: {error}", Register::FIRMWARE),
            Problem::NotWritten {
                register,
                found,
                expected,
            } => write!(f, "{register} is {found} after {expected} was written"),
            Problem::Position {
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
