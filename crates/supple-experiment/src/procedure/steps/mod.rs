//! The steps of a calibration, in order.

mod design;
mod fits;
pub mod hold_check;
mod passes;
pub mod single;
mod trials;
mod weighing;
mod wiring;

use crate::excite::move_to;
use crate::procedure::arm::{Motion, MotionArm, StopCause};
use crate::procedure::error::ProcedureError;
use crate::procedure::progress::{FinishedStep, Progress, StepName};
use crate::procedure::thresholds::{friction_error_rad, minimum_thresholds};
use crate::procedure::{FIRST_MODEL, Operator, ProcedureOptions};
use crate::request_sequence::Step;
use std::path::PathBuf;
use supple_core::config::JointGains;
use supple_core::{Config, Vector};
use supple_model::Description;

/// Duration of the rest in which the holding torque is measured, and of the rest after a sinusoid \[s\].
const REST_S: f64 = 1.0;
/// Duration of float \[s\].
const FLOAT_S: f64 = 2.0;
/// Duration of a change of gains \[s\].
const GAINS_S: f64 = 0.2;
/// Maximum number of attempts at a motion that contact stops.
const ATTEMPTS: usize = 3;

/// Result of a calibration.
#[derive(Clone, Debug)]
pub struct CalibratedArm {
    /// The identified arm, with the held joints of the description.
    pub description: Description,
    /// All measured values.
    pub progress: Progress,
}

/// Calibrates an arm whose description is `start`. The result is in `options.out`: arm.toml, arm.urdf, calibration.json,
/// the drawing of the swept space, the model of the first pass and one log for each motion.
///
/// # Errors
/// [`ProcedureError`] with the remedy, and the errors of the arm. Finished steps stay recorded.
pub fn calibrate_arm<const N: usize, A: MotionArm<N>>(
    arm: &mut A,
    start: &Description,
    options: &ProcedureOptions,
    operator: &mut dyn Operator,
) -> Result<CalibratedArm, A::Error> {
    let run = Run::new(arm, start, options, operator)?;
    run.all()
}

/// Stage of the calibration that determines the model in the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ModelStage {
    /// The given model as it is.
    Given,
    /// The given model, with which all joints move.
    Start,
    First,
    Identified,
    /// The identified model with the weight, with which all joints move.
    Weighted,
}

struct Run<'a, const N: usize, A> {
    arm: &'a mut A,
    start: &'a Description,
    options: &'a ProcedureOptions,
    operator: &'a mut dyn Operator,
    progress: Progress,
    names: Vec<String>,
    home_rad: Vector<N>,
    /// Configuration of the given arm, whose limits determine the durations of moves in all stages.
    limits: Config<N>,
    loaded: Option<ModelStage>,
    /// For an arm that falls without torque: a pose in which gravity needs little torque.
    light_rad: Option<Vector<N>>,
    /// Gains of the move mode with the model of the first pass; `None`: the gains of the description.
    first_gains: Option<JointGains<N>>,
    /// Whether the progress is written to the folder of the results.
    keeps_progress: bool,
}

/// A motion that was completed.
struct CompletedMotion {
    motions: Vec<Motion>,
    log: String,
    contacts: Vec<String>,
}

impl<'a, const N: usize, A: MotionArm<N>> Run<'a, N, A> {
    fn new(
        arm: &'a mut A,
        start: &'a Description,
        options: &'a ProcedureOptions,
        operator: &'a mut dyn Operator,
    ) -> Result<Self, ProcedureError> {
        let progress = match options.resume {
            true => Progress::read(&options.out, start.name(), options.seed)?,
            false => Progress {
                arm: start.name().to_owned(),
                seed: options.seed,
                ..Progress::default()
            },
        };
        Ok(Run {
            home_rad: start.home::<N>()?,
            limits: config::<N>(start)?,
            names: start.joint_names().to_vec(),
            arm,
            start,
            options,
            operator,
            progress,
            loaded: None,
            light_rad: None,
            first_gains: None,
            keeps_progress: true,
        })
    }

    /// Writes the progress to the folder of the results.
    fn write_progress(&self) -> Result<(), ProcedureError> {
        match self.keeps_progress {
            true => self.progress.write(&self.options.out),
            false => Ok(()),
        }
    }

    fn all(mut self) -> Result<CalibratedArm, A::Error> {
        self.perform()?;
        let description = match self.progress.finished(StepName::Identification) {
            Some(_) => self.model(ModelStage::Identified)?,
            None => self.start.clone(),
        };
        Ok(CalibratedArm {
            description,
            progress: self.progress,
        })
    }

    /// Returns whether the last requested step is finished.
    fn is_over(&self) -> bool {
        let until = self.options.until;
        until.is_some_and(|step| self.progress.finished(step).is_some())
    }

    fn perform(&mut self) -> Result<(), A::Error> {
        self.wiring()?;
        if self.is_over() {
            return Ok(());
        }
        let config = config::<N>(&self.model(ModelStage::Start)?)?;
        let motions = self.design(ModelStage::Start)?;
        self.confirm(&config, &motions)?;
        if self.is_over() {
            return Ok(());
        }
        self.warm_up(&motions)?;
        if self.is_over() {
            return Ok(());
        }
        self.breakaway(&config, &motions)?;
        if self.is_over() {
            return Ok(());
        }
        let first = [motions.first];
        self.series(StepName::FirstPass, "first-pass", ModelStage::Start, &first)?;
        if self.is_over() {
            return Ok(());
        }
        self.first_fit()?;
        if self.is_over() {
            return Ok(());
        }
        let motions = self.redesign(motions)?;
        for (step, name, series) in [
            (StepName::FullPass, "full-pass", &motions.full[..]),
            (StepName::SlowMotion, "slow-motion", &[motions.slow]),
            (StepName::ConstantSpeed, "constant-speed", &motions.constant),
            (
                StepName::ValidationMotion,
                "validation-motion",
                &[motions.validation],
            ),
        ] {
            self.series(step, name, ModelStage::First, series)?;
            if self.is_over() {
                return Ok(());
            }
        }
        for step in [
            Self::identification,
            Self::float,
            Self::sinusoid,
            Self::weighing,
        ] {
            if self.is_over() {
                return Ok(());
            }
            step(self)?;
        }
        Ok(())
    }

    fn report(&mut self, text: &str) {
        self.operator.progress(text);
    }

    /// Returns the description that the controller uses in a stage. In the last stage the held joints of the description are
    /// held; in the other stages all joints move.
    fn model(&self, stage: ModelStage) -> Result<Description, ProcedureError> {
        let load = |folder: PathBuf| Description::load(folder.join("arm.toml"));
        Ok(match stage {
            ModelStage::Given => self.start.clone(),
            ModelStage::Start => self.start.with_all_joints_active()?,
            ModelStage::First => load(self.options.out.join(FIRST_MODEL))?,
            ModelStage::Identified => load(self.options.out.clone())?,
            ModelStage::Weighted => self.weighted()?,
        })
    }

    /// Loads the model of a stage unless it is loaded. An arm that has moved moves to the home pose first.
    fn ensure_model(&mut self, stage: ModelStage) -> Result<(), A::Error> {
        if self.loaded == Some(stage) {
            return Ok(());
        }
        if self.loaded.is_some() {
            self.home(&format!("home-before-{}", name_of(stage)))?;
        }
        self.report(&format!(
            "the controller starts with the {}",
            text_of(stage)
        ));
        let mut model = self.model(stage)?;
        if matches!(
            stage,
            ModelStage::Start | ModelStage::First | ModelStage::Weighted
        ) {
            // In command units the weight is heavier by the ratio of commanded to true torque, which is unknown.
            let unknown = matches!(stage, ModelStage::Start | ModelStage::Weighted)
                || self.progress.first_fit.is_none();
            let mut minimum = minimum_thresholds::<N>(&model, unknown)?;
            if let (ModelStage::First, Some(gains)) = (stage, &self.first_gains) {
                minimum.joint_tracking_error_rad =
                    friction_error_rad(gains, &self.progress.breakaway);
            }
            model = model
                .with_minimum_thresholds(&minimum)
                .map_err(ProcedureError::from)?;
        }
        if let Some(gains) = self.first_gains.filter(|_| stage == ModelStage::First) {
            model = model
                .with_move_gains(&gains)
                .map_err(ProcedureError::from)?;
        }
        self.arm.load(&model)?;
        self.loaded = Some(stage);
        if self.progress.motors.is_empty() {
            self.progress.motors = self.arm.motors();
        }
        Ok(())
    }

    /// Moves to the home pose.
    fn home(&mut self, name: &str) -> Result<CompletedMotion, A::Error> {
        let (home_rad, limits) = (self.home_rad, self.limits);
        self.motion(name, &|from| vec![move_to(&limits, &home_rad, from)])
    }

    /// Performs a motion that begins in the present pose, and repeats it after a contact.
    fn motion(
        &mut self,
        name: &str,
        steps: &dyn Fn(&Vector<N>) -> Vec<Step<N>>,
    ) -> Result<CompletedMotion, A::Error> {
        let mut contacts = Vec::new();
        loop {
            let log = match contacts.len() {
                0 => name.to_owned(),
                repeated => format!("{name}-{}", repeated + 1),
            };
            let from_rad = self.arm.position_rad()?;
            let performed = self.arm.perform(&log, &steps(&from_rad))?;
            self.progress.moved_s += performed.moved_s;
            let Some(stopped) = performed.stopped else {
                return Ok(CompletedMotion {
                    motions: performed.motions,
                    log,
                    contacts,
                });
            };
            let fault = stopped.fault;
            contacts.push(fault.clone());
            let remedy = match (stopped.cause, contacts.len() < ATTEMPTS) {
                (StopCause::Contact, true) => {
                    self.report(&format!(
                        "{name}: {fault}; the arm rests, then repeats the motion"
                    ));
                    self.arm.recover()?;
                    continue;
                }
                (StopCause::Contact, false) => "clear the space that the arm sweeps",
                (cause, _) => cause.remedy(),
            };
            self.write_progress()?;
            return Err(ProcedureError::Stopped {
                motion: name.to_owned(),
                fault,
                remedy,
            }
            .into());
        }
    }

    /// Records that a step is finished.
    fn finish(
        &mut self,
        step: StepName,
        before_s: f64,
        done: Option<CompletedMotion>,
    ) -> Result<(), ProcedureError> {
        let (log, contacts) = match done {
            Some(done) => (Some(done.log), done.contacts),
            None => (None, Vec::new()),
        };
        self.progress.finished.push(FinishedStep {
            step,
            moved_s: self.progress.moved_s - before_s,
            log,
            contacts,
        });
        self.write_progress()
    }

    /// Returns whether a step is finished; if not, reports its beginning to the operator.
    fn is_done(&mut self, step: StepName, text: &str) -> bool {
        let done = self.progress.finished(step).is_some();
        if !done {
            self.report(text);
        }
        done
    }
}

fn config<const N: usize>(model: &Description) -> Result<Config<N>, ProcedureError> {
    Ok(model.config::<N>()?)
}

fn name_of(stage: ModelStage) -> &'static str {
    match stage {
        ModelStage::Given => "given",
        ModelStage::Start => "start",
        ModelStage::First => "full-pass",
        ModelStage::Identified => "float",
        ModelStage::Weighted => "weighing",
    }
}

fn text_of(stage: ModelStage) -> &'static str {
    match stage {
        ModelStage::Given | ModelStage::Start => "given model",
        ModelStage::First => "model of the first pass",
        ModelStage::Identified => "identified model",
        ModelStage::Weighted => "identified model and the weight",
    }
}
