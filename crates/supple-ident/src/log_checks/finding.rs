//! Findings of the checks of a log.

use std::fmt;

/// Kind of error of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Problem {
    /// Time in another unit than seconds.
    TimeUnit,
    /// Clock too fast or too slow by a factor.
    TimeScale,
    /// Samples are missing although the times are regular.
    LostSamples,
    /// Angles in degrees.
    Degrees,
    /// Angles of the motors instead of the joints.
    MotorAngles,
    /// Angle multiplied by a wrong factor: gear ratio or scale.
    AngleScale,
    /// Angle with the wrong sign.
    AngleSign,
    /// Angle with another zero than the arm's.
    ZeroOffset,
    /// Torque with the wrong sign.
    TorqueSign,
    /// Torque multiplied by a wrong factor.
    TorqueScale,
    /// Currents, or torques of the motors, instead of torques of the joints.
    NotJointTorques,
    /// Torque with an offset.
    TorqueOffset,
    /// Two joints are exchanged in angle, torque or both.
    Swapped,
    /// Angles that do not change while the joint moves.
    FrozenAngle,
    /// Torques that do not change while the joint moves.
    FrozenTorque,
    /// A column that is updated at a lower rate than the rate of the log.
    Held,
    /// Torque at its limit.
    Saturated,
    /// Torque that is for some time not explained by the arm alone.
    Contact,
    /// A payload at the tip that the given arm does not have.
    Payload,
}

/// Consequence of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Consequence {
    /// The log is not fitted.
    Reject,
    /// The log is fitted without the samples concerned.
    Mask,
    /// The log is fitted; the report names the finding.
    Warn,
}

/// One finding.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Kind of error.
    pub problem: Problem,
    /// Consequence.
    pub consequence: Consequence,
    /// Joints concerned, counted from 0; empty if it concerns the whole log.
    pub joints: Vec<usize>,
    /// Column, such as `q[2]`, or `t`.
    pub column: String,
    /// Evidence for the finding, with numbers.
    pub evidence: String,
    /// Correction.
    pub remedy: String,
    /// Intervals to leave out, from and to (s of the log's own time).
    pub intervals_s: Vec<(f64, f64)>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.column, self.evidence, self.remedy)
    }
}

impl Finding {
    pub(super) fn reject(
        problem: Problem,
        joints: &[usize],
        column: &str,
        evidence: String,
        remedy: impl Into<String>,
    ) -> Finding {
        let indices: Vec<String> = joints.iter().map(usize::to_string).collect();
        let column = match joints {
            [] => column.to_owned(),
            _ => format!("{column}[{}]", indices.join(", ")),
        };
        Finding {
            problem,
            consequence: Consequence::Reject,
            joints: joints.to_vec(),
            column,
            evidence,
            remedy: remedy.into(),
            intervals_s: Vec::new(),
        }
    }

    pub(super) fn with(self, consequence: Consequence) -> Finding {
        Finding {
            consequence,
            ..self
        }
    }
}
