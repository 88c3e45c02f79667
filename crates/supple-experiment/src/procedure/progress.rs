//! File with the finished steps of a procedure, from which the procedure can be resumed.

use super::error::ProcedureError;
use super::sweep::Sweep;
use super::wiring::JointWiring;
use crate::breakaway::JointBreakaway;
use crate::residual_error::ErrorInterval;
use crate::weighing_result::WeighingResult;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::str::FromStr;
use supple_model::MotorConstants;

/// Name of the file in the folder of the results.
pub const FILE: &str = "calibration.json";
/// Maximum size of the file \[bytes\].
const MAX_BYTES: u64 = 1 << 20;

/// Step of the procedure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepName {
    /// Signs, order and torque units, by small motions.
    Wiring,
    /// Confirmation of the swept space.
    Confirmed,
    /// Motion that warms up the joints.
    WarmUp,
    /// Breakaway torque of each joint.
    Breakaway,
    /// Excitation at a quarter of the amplitude.
    FirstPass,
    /// Fit of the first pass.
    FirstFit,
    /// Excitation at full amplitude.
    FullPass,
    /// Slow motion.
    SlowMotion,
    /// Motion at constant speeds.
    ConstantSpeed,
    /// Motion for validation.
    ValidationMotion,
    /// Fit, validation and saving of the model.
    Identification,
    /// Float.
    Float,
    /// Sinusoid at 5 N/m.
    Sinusoid,
    /// Motion with a weight of known mass, which fixes the torque scales.
    Weighing,
}

/// All steps in order, with their names in files and on the command line.
pub const STEPS: [(&str, StepName); 14] = [
    ("wiring", StepName::Wiring),
    ("confirmed", StepName::Confirmed),
    ("warm_up", StepName::WarmUp),
    ("breakaway", StepName::Breakaway),
    ("first_pass", StepName::FirstPass),
    ("first_fit", StepName::FirstFit),
    ("full_pass", StepName::FullPass),
    ("slow_motion", StepName::SlowMotion),
    ("constant_speed", StepName::ConstantSpeed),
    ("validation_motion", StepName::ValidationMotion),
    ("identification", StepName::Identification),
    ("float", StepName::Float),
    ("sinusoid", StepName::Sinusoid),
    ("weighing", StepName::Weighing),
];

impl FromStr for StepName {
    type Err = String;

    fn from_str(text: &str) -> Result<StepName, String> {
        let wanted = text.replace('-', "_");
        let found = STEPS.iter().find(|(name, _)| *name == wanted);
        found.map(|(_, step)| *step).ok_or_else(|| {
            let names: Vec<&str> = STEPS.iter().map(|(name, _)| *name).collect();
            format!("no step `{text}`; give one of {}", names.join(", "))
        })
    }
}

/// A finished step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FinishedStep {
    /// The step.
    pub step: StepName,
    /// Time of motion, including repetitions after a contact \[s\].
    pub moved_s: f64,
    /// Name of the complete log of the step, without file extension.
    pub log: Option<String>,
    /// Faults by contact, after which the motion of the step was repeated.
    pub contacts: Vec<String>,
}

/// Quality of a fit on a motion that was not fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitQuality {
    /// Torque left unexplained in the fitted motion, relative.
    pub training_relative: f64,
    /// Torque left unexplained in the validation motion, relative, over all joints.
    pub validation_relative: f64,
    /// The same value for the initial model of the fit.
    pub validation_relative_before: f64,
    /// Unexplained torque of each joint in the validation motion, RMS \[N m\].
    pub validation_rms_nm: Vec<f64>,
    /// Verdict of the identification.
    pub verdict: String,
    /// Interval of the tracking error at 5 N/m of the model of all motions, according to the validation motion; `None` for other
    /// models, without sufficient data, if the sinusoid is out of reach, and in files of older versions.
    #[serde(default)]
    pub interval_at_5_n_per_m: Option<ErrorInterval>,
}

/// Tracking of the sinusoid at 5 N/m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SinusoidResult {
    /// RMS error of the tip with the calibrated model alone \[m\]; `None` if a fault ended the motion.
    pub calibrated_rms_m: Option<f64>,
    /// RMS error after [`super::LEARNING_S`] of learning \[m\]; `None` if a fault ended the motion.
    pub learning_rms_m: Option<f64>,
    /// Folder of the model with the learned parameters, within the folder of the results; `None` if none were learned.
    #[serde(default)]
    pub learned_model: Option<String>,
    /// Contacts reported in free motion.
    pub false_contacts: usize,
    /// The fault that ended the motion.
    pub ended: Option<String>,
}

/// State and results of a procedure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Name of the arm.
    pub arm: String,
    /// Seed of the designs.
    pub seed: u64,
    /// Finished steps, in order.
    pub finished: Vec<FinishedStep>,
    /// Time of all motion, including unfinished steps \[s\].
    pub moved_s: f64,
    /// Time of motion that was predicted to the operator \[s\].
    pub stated_s: f64,
    /// What the registers of the motors state; empty for motors without such registers, and in files of older versions.
    #[serde(default)]
    pub motors: Vec<MotorConstants>,
    /// Result of the wiring check of each joint.
    pub wiring: Vec<JointWiring>,
    /// Swept space.
    pub sweep: Option<Sweep>,
    /// Breakaway torque of each joint.
    pub breakaway: Vec<JointBreakaway>,
    /// The fit of the first pass; `None` if the initial model predicted the validation motion better.
    pub first_fit: Option<FitQuality>,
    /// The fit of all motions.
    pub fit: Option<FitQuality>,
    /// Greatest motion of a joint in float \[rad\].
    pub float_drift_rad: Option<f64>,
    /// The fault that ended float.
    pub float_ended: Option<String>,
    /// Sinusoid at 5 N/m; `None` if the arm cannot reach it.
    pub sinusoid: Option<SinusoidResult>,
    /// Torque scales by a weight; `None` without one, and in files of older versions.
    #[serde(default)]
    pub weighing: Option<WeighingResult>,
}

impl Progress {
    /// Returns the finished step of this name.
    pub fn finished(&self, step: StepName) -> Option<&FinishedStep> {
        self.finished.iter().find(|finished| finished.step == step)
    }

    /// Reads the file in `folder`.
    ///
    /// # Errors
    /// [`ProcedureError::Resume`] if the file does not exist, or is of another arm or seed.
    pub fn read(folder: &Path, arm: &str, seed: u64) -> Result<Progress, ProcedureError> {
        let file = folder.join(FILE);
        let failed = |problem: String| ProcedureError::Resume {
            file: file.clone(),
            problem,
        };
        let text =
            supple_files::read_text(&file, MAX_BYTES).map_err(|error| failed(error.to_string()))?;
        let progress: Progress = serde_json::from_str(&text)
            .map_err(|error| failed(format!("not a calibration: {error}")))?;
        if progress.arm != arm || progress.seed != seed {
            return Err(failed(format!(
                "it is of the arm {} with seed {}, not of {arm} with seed {seed}",
                progress.arm, progress.seed
            )));
        }
        Ok(progress)
    }

    /// Writes the file completely or not at all.
    ///
    /// # Errors
    /// [`ProcedureError::Write`].
    pub fn write(&self, folder: &Path) -> Result<(), ProcedureError> {
        let file = folder.join(FILE);
        match serde_json::to_string_pretty(self) {
            Ok(text) => write_whole(&file, text.as_bytes()),
            Err(error) => Err(ProcedureError::Write {
                file,
                error: error.into(),
            }),
        }
    }
}

/// Writes a file completely or not at all.
///
/// # Errors
/// [`ProcedureError::Write`].
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), ProcedureError> {
    let failed = |error| ProcedureError::Write {
        file: file.to_owned(),
        error,
    };
    supple_files::write_atomic(file, bytes).map_err(failed)
}
