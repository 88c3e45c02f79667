//! Why a description is refused: one type, and every message names file, element, value and remedy.

use supple_core::ArmError;

/// A description, or a use of one, that is refused.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A file that cannot be read.
    #[error("{file}: cannot be read: {error}; {remedy}")]
    Read {
        /// Path as it was asked for.
        file: String,
        /// What the system says.
        error: std::io::Error,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A file that cannot be written.
    #[error(
        "{file}: cannot be written: {error}; name a folder in which it can be, as a regular file"
    )]
    Write {
        /// Path.
        file: String,
        /// What the system says.
        error: std::io::Error,
    },
    /// A file that is not well formed, or has keys or types that are not in the schema. The message
    /// of the parser carries line, column and what was expected.
    #[error("{file}: {message}\n{remedy}")]
    Syntax {
        /// File name.
        file: String,
        /// Message of the parser.
        message: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// An element that is read but cannot be true.
    #[error(transparent)]
    Invalid(Box<Finding>),
    /// A URDF with what is not read, where nothing may be left out.
    #[error("{}; remove it, or load the arm without strict", lines(findings))]
    Strict {
        /// What is left out, each kind once.
        findings: Vec<Finding>,
    },
    /// An arm that is not built in.
    #[error(
        "no arm named `{found}` is built in; the built-in arms are {expected}; another \
         arm is given by the path of its TOML"
    )]
    UnknownAsset {
        /// Name asked for.
        found: String,
        /// Names there are.
        expected: String,
    },
    /// The description and the caller disagree about the number of joints.
    #[error("{file}: arm `{arm}` has {found} moving joints, the caller expects {expected}")]
    JointCount {
        /// File of the description.
        file: String,
        /// Name of the arm.
        arm: String,
        /// Joints that the caller asked for.
        expected: usize,
        /// Joints that the arm has.
        found: usize,
    },
    /// A number of joints that no controller is compiled for.
    #[error(
        "an arm of {found} moving joints is not supported, 3 to 7 are; fix joints of the arm at an \
         angle under [fixed_joints_rad], or set tip_frame to another link"
    )]
    Dof {
        /// Joints that the arm has.
        found: usize,
    },
    /// The parts are sound one by one, but do not make an arm.
    #[error("{file}: {error}; correct the named element in the URDF or the TOML")]
    Arm {
        /// File of the description.
        file: String,
        /// What the constructor of the arm says; joints are counted from 0.
        error: ArmError,
    },
}

/// An element with a value that cannot be true.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {element}: {problem}, found {value}; {remedy}")]
pub struct Finding {
    /// File that holds the element.
    pub file: String,
    /// The element, as one would look for it in the file.
    pub element: String,
    /// What is wrong.
    pub problem: String,
    /// The value found.
    pub value: String,
    /// What to do about it.
    pub remedy: String,
}

fn lines(findings: &[Finding]) -> String {
    let lines: Vec<String> = findings.iter().map(ToString::to_string).collect();
    lines.join("; ")
}

/// Speaks about one file.
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
            value: value.to_string(),
            remedy: remedy.into(),
        }))
    }

    /// Refuses NaN and infinity.
    pub fn finite(&self, element: &str, value: f64) -> Result<(), ModelError> {
        self.check(element, value, value.is_finite(), "finite")
    }

    /// Refuses what is not above zero.
    pub fn positive(&self, element: &str, value: f64) -> Result<(), ModelError> {
        let sound = value.is_finite() && value > 0.0;
        self.check(element, value, sound, "finite and above zero")
    }

    /// Refuses what is below zero.
    pub fn not_negative(&self, element: &str, value: f64) -> Result<(), ModelError> {
        let sound = value.is_finite() && value >= 0.0;
        self.check(element, value, sound, "finite and not negative")
    }

    /// Refuses what is not within a range, ends included.
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
        let (least, greatest) = range.into_inner();
        Err(self.invalid(
            element,
            format!("must be from {least} to {greatest} {unit}"),
            value,
            "give a number in this range, in this unit",
        ))
    }

    fn check(&self, element: &str, value: f64, sound: bool, must: &str) -> Result<(), ModelError> {
        if sound {
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
