//! What is wrong with a log or a request, where, and what to do about it.

use std::fmt;

/// Why nothing was identified. Columns are named as in `q[2]`: quantity and joint, counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentError {
    /// A column or the clock of a log cannot be used.
    #[error("{column}: {problem}; {remedy}")]
    Log {
        /// Column, such as `tau[3]` or `t`.
        column: String,
        /// What is wrong, with the value and the sample.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Two shapes that must agree do not.
    #[error("{argument}: expected {expected}, got {found}")]
    Shape {
        /// Argument or column.
        argument: String,
        /// What it must be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// An option that makes no sense.
    #[error("{option} is {value}, it must be {must}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Value found.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// The data do not determine what was asked.
    #[error("{problem}; {remedy}")]
    Singular {
        /// What is missing.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The parameters found are no arm: only possible without the constraints of a body.
    #[error("the estimate is not an arm ({0}); use the physically consistent method")]
    NotPhysical(supple_core::ArmError),
}

/// Something doubtful that was let pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Column, such as `q[2]`.
    pub column: String,
    /// What is doubtful.
    pub problem: String,
    /// What to do.
    pub remedy: &'static str,
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

/// Refuses an option that is not a positive finite number.
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
