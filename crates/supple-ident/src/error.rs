//! Errors of identification: location, problem and remedy.

use crate::log_checks::finding::Finding;
use std::fmt;

/// Error of identification. Columns are named as in `q[2]`: quantity and joint, counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentError {
    /// A column or the clock of a log cannot be used.
    #[error("{column}: {problem}; {remedy}")]
    Log {
        /// Column, such as `tau[3]` or `t`.
        column: String,
        /// Problem, with value and sample.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The checks of [`crate::log_checks`] found errors in a log.
    #[error("{}", joined(.0))]
    WrongLog(Vec<Finding>),
    /// Two shapes do not agree.
    #[error("{argument}: expected {expected}, got {found}")]
    Shape {
        /// Argument or column.
        argument: String,
        /// Expected value.
        expected: String,
        /// Actual value.
        found: String,
    },
    /// An option is out of range.
    #[error("{option} is {value}, it must be {must}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Expected value.
        must: &'static str,
    },
    /// The data are insufficient.
    #[error("{problem}; {remedy}")]
    Singular {
        /// Problem.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Another thread has ended the identification, see [`crate::Cancellation`].
    #[error("the identification was cancelled")]
    Cancelled,
    /// The estimate is physically inconsistent; only unconstrained methods can give this.
    #[error("the estimate is physically inconsistent ({0}); use the consistent method")]
    NotPhysical(supple_core::ArmError),
}

fn joined(findings: &[Finding]) -> String {
    let all: Vec<String> = findings.iter().map(ToString::to_string).collect();
    all.join("; also ")
}

/// A warning about the data or the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Column, such as `q[2]`.
    pub column: String,
    /// Problem.
    pub problem: String,
    /// Remedy.
    pub remedy: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.column, self.problem, self.remedy)
    }
}

pub(crate) fn log_error(
    column: impl Into<String>,
    problem: impl Into<String>,
    remedy: &'static str,
) -> IdentError {
    IdentError::Log {
        column: column.into(),
        problem: problem.into(),
        remedy,
    }
}

pub(crate) fn shape_error(
    argument: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> IdentError {
    IdentError::Shape {
        argument: argument.into(),
        expected: expected.into(),
        found: found.into(),
    }
}

/// Rejects an option that is not a positive finite number.
pub(crate) fn positive(option: &'static str, value: f64) -> Result<(), IdentError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(IdentError::Option {
        option,
        value,
        must: "finite and positive",
    })
}
