//! Errors of descriptions. Every message names file, element, value and remedy.

use supple_core::ArmError;

/// Error of reading, checking or using a description.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A file cannot be read.
    #[error("{file}: cannot be read: {error}; {remedy}")]
    Read {
        /// Path as the caller gave it.
        file: String,
        /// Error of the operating system.
        error: std::io::Error,
        /// Suggested remedy.
        remedy: &'static str,
    },
    /// A file cannot be written.
    #[error(
        "{file}: cannot be written: {error}; name a folder in which a regular file can be written"
    )]
    Write {
        /// Path.
        file: String,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// A file cannot be parsed, or contains unknown keys or wrong types. The message of the parser
    /// contains line, column and the expected token.
    #[error("{file}: {message}\n{remedy}")]
    Syntax {
        /// File name.
        file: String,
        /// Message of the parser.
        message: String,
        /// Suggested remedy.
        remedy: &'static str,
    },
    /// An element has an invalid value.
    #[error(transparent)]
    Invalid(Box<Finding>),
    /// A URDF has ignored content, and strict reading was requested.
    #[error("{}; remove it, or load the arm without strict", lines(findings))]
    Strict {
        /// Ignored content, each kind once.
        findings: Vec<Finding>,
    },
    /// The requested arm is not built in.
    #[error(
        "no arm named `{found}` is built in; the built-in arms are {expected}; another \
         arm is given by the path of its TOML"
    )]
    UnknownAsset {
        /// Requested name.
        found: String,
        /// Known names.
        expected: String,
    },
    /// A file does not have the name of a URDF.
    #[error("{file}: the name of a URDF ends with .urdf or .xml; rename the file")]
    NotUrdf {
        /// File name.
        file: String,
    },
    /// The description and the caller disagree about the number of joints.
    #[error("{file}: arm `{arm}` has {found} moving joints, the caller expects {expected}")]
    JointCount {
        /// File of the description.
        file: String,
        /// Name of the arm.
        arm: String,
        /// Number of joints that the caller expects.
        expected: usize,
        /// Number of joints of the arm.
        found: usize,
    },
    /// No controller is compiled for this number of joints.
    #[error(
        "an arm of {found} moving joints is not supported, 3 to 7 are; fix joints of the arm at an \
         angle under [fixed_joints_rad], or set tip_frame to another link"
    )]
    Dof {
        /// Number of joints of the arm.
        found: usize,
    },
    /// The parts are valid, but do not form a valid arm.
    #[error("{file}: {error}; correct the named element in the URDF or the TOML")]
    Arm {
        /// File of the description.
        file: String,
        /// Error of the constructor of the arm; joints are counted from 0.
        error: ArmError,
    },
}

/// An element with an invalid or ignored value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {element}: {problem}, found {value}; {remedy}")]
pub struct Finding {
    /// File that contains the element.
    pub file: String,
    /// The element, in words that occur in the file.
    pub element: String,
    /// The problem.
    pub problem: String,
    /// The value found.
    pub value: String,
    /// Suggested remedy.
    pub remedy: String,
}

fn lines(findings: &[Finding]) -> String {
    let lines: Vec<String> = findings.iter().map(ToString::to_string).collect();
    lines.join("; ")
}

/// Creates the errors of one file.
#[derive(Clone, Copy)]
pub(crate) struct Reporter<'a> {
    pub file: &'a str,
}

impl Reporter<'_> {
    pub fn invalid(
        &self,
        element: impl Into<String>,
        problem: impl Into<String>,
        value: impl ToString,
        remedy: impl Into<String>,
    ) -> ModelError {
        ModelError::Invalid(Box::new(Finding {
            file: self.file.to_owned(),
            element: element.into(),
            problem: problem.into(),
            value: supple_files::excerpt(&value.to_string()).into_owned(),
            remedy: remedy.into(),
        }))
    }

    /// Rejects NaN and infinity.
    pub fn finite(&self, element: &str, value: f64) -> Result<(), ModelError> {
        self.check(element, value, value.is_finite(), "finite")
    }

    /// Rejects values that are not finite and above zero.
    pub fn positive(&self, element: &str, value: f64) -> Result<(), ModelError> {
        let valid = value.is_finite() && value > 0.0;
        self.check(element, value, valid, "finite and above zero")
    }

    /// Rejects values that are not finite or below zero.
    pub fn not_negative(&self, element: &str, value: f64) -> Result<(), ModelError> {
        let valid = value.is_finite() && value >= 0.0;
        self.check(element, value, valid, "finite and not negative")
    }

    /// Rejects values outside a range, ends included.
    pub fn within(
        &self,
        element: &str,
        value: f64,
        range: core::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<(), ModelError> {
        if range.contains(&value) {
            return Ok(());
        }
        let (min, max) = range.into_inner();
        Err(self.invalid(
            element,
            format!("must be from {min} to {max} {unit}"),
            value,
            "give a number in this range, in this unit",
        ))
    }

    fn check(&self, element: &str, value: f64, valid: bool, must: &str) -> Result<(), ModelError> {
        if valid {
            return Ok(());
        }
        Err(self.invalid(
            element,
            format!("must be {must}"),
            value,
            format!("give a number that is {must}"),
        ))
    }
}
