//! The steps that fit models.

use super::{ModelStage, Run};
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::fitting::FirstFit;
use crate::procedure::progress::{FitQuality, StepName};
use crate::procedure::{FIRST_MODEL, LOGS, fitting};
use std::path::PathBuf;
use supple_ident::Log;

/// Files of the motions to which a model is fitted.
pub(super) struct FittedFiles {
    excitations: [PathBuf; 3],
    /// Motion at constant speeds, to which the ripple is fitted.
    constant_speed: Option<PathBuf>,
}

impl FittedFiles {
    /// Reads the excitations, and the motions at constant speed.
    pub(super) fn read<const N: usize>(&self) -> Result<[Vec<Log>; 2], ProcedureError> {
        let read = |files: &[PathBuf]| {
            let mut logs = Vec::new();
            for file in files {
                logs.extend(fitting::read_excitations::<N>(file)?);
            }
            Ok::<_, ProcedureError>(logs)
        };
        Ok([
            read(&self.excitations)?,
            read(self.constant_speed.as_slice())?,
        ])
    }
}

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    /// Returns the path of the log of a finished step.
    pub(super) fn log_file(&self, step: StepName) -> PathBuf {
        let finished = self.progress.finished(step);
        let name = finished.and_then(|finished| finished.log.as_deref());
        let folder = self.options.out.join(LOGS);
        folder.join(format!("{}.mcap", name.unwrap_or_default()))
    }

    pub(super) fn first_fit(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::FirstFit, "first fit") {
            return Ok(());
        }
        let model = self.model(ModelStage::Start)?;
        let scaled = fitting::scale_dry_friction::<N>(&model, &self.progress.breakaway)?;
        let pass = self.log_file(StepName::FirstPass);
        // The moves from the home pose reach poses outside of the pass.
        let logs = self.options.out.join(LOGS);
        let moves =
            ["warm-up", "breakaway-0-positive"].map(|name| logs.join(format!("{name}.mcap")));
        let of = scaled.clone();
        let fit = self.arm.meanwhile(move || {
            let mut others = Vec::new();
            for file in moves.iter().filter(|file| file.exists()) {
                others.extend(fitting::read_position_controlled_motions::<N>(file)?);
            }
            let pass = single_log(&fitting::read_excitations::<N>(&pass)?, "first-pass")?.clone();
            fitting::fit_first::<N>(&of, &pass, &others)
        })??;
        let (found, quality) = match fit {
            FirstFit::Better(found, quality) => {
                self.report(&format!(
                    "end of the first pass, which was not fitted: {:.1} % of the torque unexplained, {:.1} % before",
                    100.0 * quality.validation_relative,
                    100.0 * quality.validation_relative_before
                ));
                (*found, Some(quality))
            }
            FirstFit::Rejected(reason) => {
                self.report(&format!(
                    "the first fit is not used, the model before it stays: {reason}"
                ));
                (scaled, None)
            }
        };
        let folder = self.options.out.join(FIRST_MODEL);
        found.save(&folder).map_err(ProcedureError::from)?;
        self.progress.first_fit = quality;
        Ok(self.finish(StepName::FirstFit, self.progress.moved_s, None)?)
    }

    /// Returns the files of the motions that are fitted.
    pub(super) fn fitted_files(&self) -> FittedFiles {
        let constant_speed = self.progress.finished(StepName::ConstantSpeed);
        let moved = constant_speed.is_some_and(|finished| finished.log.is_some());
        FittedFiles {
            excitations: [
                StepName::FullPass,
                StepName::SlowMotion,
                StepName::FirstPass,
            ]
            .map(|step| self.log_file(step)),
            constant_speed: moved.then(|| self.log_file(StepName::ConstantSpeed)),
        }
    }

    pub(super) fn identification(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Identification, "identification") {
            return Ok(());
        }
        let model = self.model(ModelStage::First)?;
        let file = |step| self.log_file(step);
        let [full, slow] = [StepName::FullPass, StepName::SlowMotion].map(file);
        let fitted = self.fitted_files();
        let validation = self.log_file(StepName::ValidationMotion);
        let start = self.start.clone();
        // Reading and fitting take long; the arm's telemetry must be read meanwhile.
        let (found, quality) = self.arm.meanwhile(move || {
            let [logs, constant] = fitted.read::<N>()?;
            let mut others = Vec::new();
            for file in [&full, &slow, &validation] {
                others.extend(fitting::read_position_controlled_motions::<N>(file)?);
            }
            let validation = single_log(
                &fitting::read_excitations::<N>(&validation)?,
                "validation-motion",
            )?
            .clone();
            fitting::fit_all::<N>(&model, &start, &logs, &constant, &validation, &others)
        })??;
        self.report(&summary(&quality));
        let found = found
            .with_held_joints_of(self.start)
            .and_then(|found| found.with_stable_damping::<N>())
            .map_err(ProcedureError::from)?;
        let (found, shares) = found;
        for (gains, share) in ["damping of gravity hold", "gains of held joints"]
            .iter()
            .zip(shares)
        {
            if share < 1.0 {
                self.report(&format!(
                    "{gains}: reduced to {:.0} %, since the identified inertias and the delay of the loop allow no more",
                    100.0 * share
                ));
            }
        }
        found
            .save(&self.options.out)
            .map_err(ProcedureError::from)?;
        self.progress.fit = Some(quality);
        Ok(self.finish(StepName::Identification, self.progress.moved_s, None)?)
    }
}

pub(super) fn single_log<'a>(logs: &'a [Log], name: &str) -> Result<&'a Log, ProcedureError> {
    logs.first().ok_or_else(|| ProcedureError::Stopped {
        motion: name.to_owned(),
        fault: "its log has no motion along a series".to_owned(),
        remedy: "repeat the calibration",
    })
}

fn summary(quality: &FitQuality) -> String {
    format!(
        "validation motion: {:.2} % of the torque unexplained, {:.2} % before; {}",
        100.0 * quality.validation_relative,
        100.0 * quality.validation_relative_before,
        quality.verdict
    )
}
