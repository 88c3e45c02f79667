//! The steps, one after the other.

use super::arm::{Motion, MotionArm};
use super::error::ProcedureError;
use super::motions::{
    BREAKAWAY_RAMP, DesignPlan, Motions, WIRING_RAMP, follow, gains_along, ramp, ramps_s,
    wiring_slope_nm_per_s,
};
use super::progress::{FinishedStep, FitQuality, Progress, SinusoidResult, StepName, write_whole};
use super::sweep::Sweep;
use super::thresholds::wide_thresholds;
use super::wiring::{check_direction, check_gravity, check_ramp, difference_rad, ramp_result};
use super::{
    DRAWING, FIRST_MODEL, HOLD_REMEDY, LEARNING_S, LOGS, Operator, ProcedureOptions, fitting,
};
use crate::breakaway::{JointBreakaway, sliding_torque_nm};
use crate::calibrate::upright;
use crate::error::ExperimentError;
use crate::excite::move_to;
use crate::metrics::Rms;
use crate::request_sequence::{Recording, Step};
use crate::run::joint_label;
use crate::scenario;
use crate::start::start_pose;
use std::path::PathBuf;
use supple_core::config::JointGains;
use supple_core::controller::{LearningSwitch, Request};
use supple_core::dynamics::gravity;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Vector};
use supple_ident::Log;
use supple_model::Description;

/// Rest in which the torque at a standstill is measured \[s\].
const REST_S: f64 = 1.0;
/// Duration of float \[s\].
const FLOAT_S: f64 = 2.0;
/// Duration of a change of gains \[s\].
const GAINS_S: f64 = 0.2;
/// Duration of the move back to the start of the sinusoid \[s\].
const RETURN_S: f64 = 1.5;
/// Attempts at a motion that contact stops.
const ATTEMPTS: usize = 3;

/// What the calibration found.
#[derive(Clone, Debug)]
pub struct CalibratedArm {
    /// The identified arm, with the held joints of the description.
    pub description: Description,
    /// All that was measured on the way.
    pub progress: Progress,
}

/// Calibrates an arm whose description is `start`. The result is in `options.out`: arm.toml, arm.urdf, calibration.json,
/// the drawing of the swept space, the model of the first pass and one log for each motion.
///
/// # Errors
/// [`ProcedureError`] with the remedy, and the errors of the arm. What is finished stays finished.
pub fn calibrate_arm<const N: usize, A: MotionArm<N>>(
    arm: &mut A,
    start: &Description,
    options: &ProcedureOptions,
    operator: &mut dyn Operator,
) -> Result<CalibratedArm, A::Error> {
    let run = Run::new(arm, start, options, operator)?;
    run.all()
}

/// Model in the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Start,
    First,
    Identified,
}

struct Run<'a, const N: usize, A> {
    arm: &'a mut A,
    start: &'a Description,
    options: &'a ProcedureOptions,
    operator: &'a mut dyn Operator,
    progress: Progress,
    names: Vec<String>,
    home_rad: Vector<N>,
    loaded: Option<Stage>,
    /// Gains of the move mode with the model of the first pass; `None`: those of the description.
    first_gains: Option<JointGains<N>>,
}

/// A motion that was completed.
struct Done {
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
            names: start.joint_names().to_vec(),
            arm,
            start,
            options,
            operator,
            progress,
            loaded: None,
            first_gains: None,
        })
    }

    fn all(mut self) -> Result<CalibratedArm, A::Error> {
        self.perform()?;
        let description = match self.progress.finished(StepName::Identification) {
            Some(_) => self.model(Stage::Identified)?,
            None => self.start.clone(),
        };
        Ok(CalibratedArm {
            description,
            progress: self.progress,
        })
    }

    /// Whether the last wanted step is finished.
    fn is_over(&self) -> bool {
        let until = self.options.until;
        until.is_some_and(|step| self.progress.finished(step).is_some())
    }

    fn perform(&mut self) -> Result<(), A::Error> {
        self.wiring()?;
        if self.is_over() {
            return Ok(());
        }
        let config = config::<N>(&self.model(Stage::Start)?)?;
        let motions = self.design(Stage::Start)?;
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
        self.series(StepName::FirstPass, "first-pass", Stage::Start, &first)?;
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
            (StepName::UnseenMotion, "unseen-motion", &[motions.unseen]),
        ] {
            self.series(step, name, Stage::First, series)?;
            if self.is_over() {
                return Ok(());
            }
        }
        for step in [Self::identification, Self::float, Self::sinusoid] {
            if self.is_over() {
                return Ok(());
            }
            step(self)?;
        }
        Ok(())
    }

    fn say(&mut self, text: &str) {
        self.operator.progress(text);
    }

    /// The description that the controller uses in a stage. All joints move except for the last one, in which the held
    /// joints of the description are held.
    fn model(&self, stage: Stage) -> Result<Description, ProcedureError> {
        let load = |folder: PathBuf| Description::load(folder.join("arm.toml"));
        Ok(match stage {
            Stage::Start => self.start.with_all_joints_active()?,
            Stage::First => load(self.options.out.join(FIRST_MODEL))?,
            Stage::Identified => load(self.options.out.clone())?,
        })
    }

    /// Loads the model of a stage, in the home pose if the arm has moved.
    fn ensure(&mut self, stage: Stage) -> Result<(), A::Error> {
        if self.loaded == Some(stage) {
            return Ok(());
        }
        if self.loaded.is_some() {
            let home_rad = self.home_rad;
            let name = format!("home-before-{}", name_of(stage));
            self.motion(&name, &|from| vec![move_to(&home_rad, from)])?;
        }
        self.say(&format!(
            "the controller starts with the {}",
            text_of(stage)
        ));
        let mut model = self.model(stage)?;
        if stage != Stage::Identified {
            let unknown = stage == Stage::Start || self.progress.first_fit.is_none();
            let wide = wide_thresholds::<N>(&model, unknown)?;
            model = model
                .with_wide_thresholds(&wide)
                .map_err(ProcedureError::from)?;
        }
        if let Some(gains) = self.first_gains.filter(|_| stage == Stage::First) {
            model = model
                .with_move_gains(&gains)
                .map_err(ProcedureError::from)?;
        }
        self.arm.load(&model)?;
        self.loaded = Some(stage);
        Ok(())
    }

    /// Performs a motion that begins where the arm is. After a contact it is repeated.
    fn motion(
        &mut self,
        name: &str,
        steps: &dyn Fn(&Vector<N>) -> Vec<Step<N>>,
    ) -> Result<Done, A::Error> {
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
                return Ok(Done {
                    motions: performed.motions,
                    log,
                    contacts,
                });
            };
            let fault = stopped.fault;
            contacts.push(fault.clone());
            let remedy = match (stopped.by_contact, contacts.len() < ATTEMPTS) {
                (true, true) => {
                    self.say(&format!(
                        "{name}: {fault}; the arm rests, then repeats the motion"
                    ));
                    self.arm.recover()?;
                    continue;
                }
                (true, false) => "clear the space that the arm sweeps",
                (false, _) => HOLD_REMEDY,
            };
            self.progress.write(&self.options.out)?;
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
        done: Option<Done>,
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
        self.progress.write(&self.options.out)
    }

    /// Whether a step is finished; otherwise it is announced.
    fn is_done(&mut self, step: StepName, text: &str) -> bool {
        let done = self.progress.finished(step).is_some();
        if !done {
            self.say(text);
        }
        done
    }

    fn wiring(&mut self) -> Result<(), A::Error> {
        if self.is_done(
            StepName::Wiring,
            "signs, order and torque of the joints, by small motions",
        ) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure(Stage::Start)?;
        let config = config::<N>(&self.model(Stage::Start)?)?;
        let pose_rad = self.arm.position_rad()?;
        self.progress.wiring.clear();
        for joint in 0..N {
            let up = self.wiring_ramp(&config, &pose_rad, joint, 1.0)?;
            let down = self.wiring_ramp(&config, &pose_rad, joint, -1.0)?;
            let turned_rad = difference_rad(&up, &down, joint);
            check_direction(&self.names, joint, turned_rad)?;
            if let Some(found) = self.progress.wiring.last_mut() {
                found.difference_rad = turned_rad;
            }
        }
        let rest = Step {
            recorded: true,
            ..Step::wait(
                Request::Move {
                    target_rad: pose_rad,
                    duration_s: REST_S,
                },
                REST_S,
            )
        };
        let done = self.motion("rest", &|_| vec![rest])?;
        if let Some(rest) = done.motions.first() {
            let friction_nm = Vector::from_fn(|j, _| config.friction[j].breakaway_nm);
            let model_nm = gravity(&config.arm, &pose_rad);
            check_gravity(&self.names, &rest.recording, &model_nm, &friction_nm)?;
        }
        Ok(self.finish(StepName::Wiring, before_s, None)?)
    }

    /// Ramps the torque of a joint and checks which encoders moved. The arm returns to the pose before the ramp down.
    fn wiring_ramp(
        &mut self,
        config: &Config<N>,
        pose_rad: &Vector<N>,
        joint: usize,
        direction: f64,
    ) -> Result<Recording, A::Error> {
        let up = direction > 0.0;
        let name = format!("wiring-{joint}-{}", if up { "up" } else { "down" });
        let (_, stop_rad) = WIRING_RAMP;
        let rate_nm_per_s = wiring_slope_nm_per_s(config, pose_rad, joint);
        let slope = (direction * rate_nm_per_s, stop_rad);
        let from_rad = self.arm.position_rad()?;
        let mut steps = ramp(config, &from_rad, pose_rad, joint, slope);
        if joint == 0 && up {
            // The first ramp begins where the arm is held: no move has been tried yet.
            let moves = |step: &Step<N>| matches!(step.request, Request::Move { .. });
            steps.retain(|step| !moves(step));
        }
        let performed = self.arm.perform(&name, &steps)?;
        self.progress.moved_s += performed.moved_s;
        let motion = performed.motions.into_iter().next();
        let recording = motion.map(|motion| motion.recording);
        if let Some(recording) = recording.as_ref().filter(|found| !found.t_s.is_empty()) {
            let found = ramp_result(recording, joint, rate_nm_per_s);
            if performed.stopped.is_none() || !found.others.is_empty() {
                check_ramp(&self.names, joint, &found)?;
            }
            if up {
                self.progress.wiring.push(found);
            }
        }
        match (performed.stopped, recording) {
            (None, Some(recording)) => Ok(recording),
            (stopped, _) => Err(ProcedureError::Stopped {
                motion: format!("torque ramp on joint {joint} ({})", self.names[joint]),
                fault: stopped.map_or("no data".to_owned(), |stopped| stopped.fault),
                remedy: HOLD_REMEDY,
            }
            .into()),
        }
    }

    /// Whether the arm falls without torque: its motors may give less torque than is commanded, and gravity may need
    /// much of their limits.
    fn falls(&self) -> bool {
        self.start.bus().is_some()
    }

    /// Designs the motions with the model of a stage.
    fn design(&mut self, stage: Stage) -> Result<Motions<N>, A::Error> {
        self.say("design of the excitation");
        let home_rad = self.home_rad;
        let config = config::<N>(&self.model(stage)?)?;
        let unknown = stage == Stage::Start || self.progress.first_fit.is_none();
        let plan = DesignPlan {
            seed: self.options.seed,
            candidates: self.options.candidates,
            about_light_pose: self.falls(),
            careful: self.falls() && unknown,
        };
        let work = move || Motions::design(&config, &home_rad, &plan);
        let designed = self.arm.meanwhile(work)?;
        Ok(designed.map_err(ProcedureError::from)?)
    }

    /// The remaining motions within the torque limits by the model of the first fit, if the arm falls without torque. A
    /// space that they sweep beyond what was confirmed is confirmed anew.
    fn redesign(&mut self, motions: Motions<N>) -> Result<Motions<N>, A::Error> {
        if !self.falls() || self.progress.finished(StepName::UnseenMotion).is_some() {
            return Ok(motions);
        }
        let motions = self.design(Stage::First)?;
        let config = config::<N>(&self.model(Stage::First)?)?;
        let sweep = Sweep::of(&config, &self.home_rad, &motions.all());
        let confirmed = self.progress.sweep.as_ref();
        if confirmed.is_none_or(|confirmed| !confirmed.contains(&sweep)) {
            self.say("by the model of the first pass the arm sweeps another space");
            self.ask(&sweep)?;
        }
        // A first pass tells little of the inertias: the loops must be stable with those of the given model, too.
        let given = self
            .model(Stage::Start)?
            .config::<N>()
            .map_err(ProcedureError::from)?;
        self.first_gains = Some(gains_along(&given, &motions.all()).map_err(ProcedureError::from)?);
        Ok(motions)
    }

    /// Asks whether the arm may sweep a space.
    fn ask(&mut self, sweep: &Sweep) -> Result<(), ProcedureError> {
        let drawing = self.options.out.join(DRAWING);
        write_whole(&drawing, sweep.svg().as_bytes())?;
        let text = format!("the arm sweeps {}: {}", sweep.text(), drawing.display());
        self.say(&text);
        let confirmed = self.operator.confirms(sweep, &drawing);
        self.progress.sweep = Some(sweep.clone());
        self.progress.write(&self.options.out)?;
        match confirmed {
            true => Ok(()),
            false => Err(ProcedureError::NotConfirmed { drawing }),
        }
    }

    fn confirm(&mut self, config: &Config<N>, motions: &Motions<N>) -> Result<(), A::Error> {
        if self.progress.finished(StepName::Confirmed).is_some() {
            return Ok(());
        }
        let stated_s = self.stated_s(config, motions);
        self.progress.stated_s = stated_s;
        let text = format!("about {:.1} minutes of motion follow", stated_s / 60.0);
        self.say(&text);
        self.ask(&Sweep::of(config, &self.home_rad, &motions.all()))?;
        Ok(self.finish(StepName::Confirmed, self.progress.moved_s, None)?)
    }

    /// Time of all motion, about \[s\].
    fn stated_s(&self, config: &Config<N>, motions: &Motions<N>) -> f64 {
        let all: f64 = follow(&self.home_rad, &motions.all())
            .iter()
            .map(|step| step.duration_s)
            .sum();
        let (_, sinusoid_s) = self.start.paths().sinusoid(1.0);
        let returns_s =
            9.0 * move_to(&motions.first.at(0.0).position_rad, &self.home_rad).duration_s;
        all + self.options.warm_up_s
            + ramps_s(config)
            + REST_S
            + returns_s
            + FLOAT_S
            + 2.0 * (sinusoid_s + RETURN_S + GAINS_S)
            + LEARNING_S
    }

    fn warm_up(&mut self, motions: &Motions<N>) -> Result<(), A::Error> {
        let text = format!("warm-up for {} s", self.options.warm_up_s);
        if self.is_done(StepName::WarmUp, &text) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        let mut done = None;
        if self.options.warm_up_s > 2.0 * motions.first.ramp_s {
            self.ensure(Stage::Start)?;
            let series = Fourier {
                duration_s: self.options.warm_up_s,
                ..motions.first
            };
            done = Some(self.motion("warm-up", &|from| follow(from, &[series]))?);
        }
        Ok(self.finish(StepName::WarmUp, before_s, done)?)
    }

    fn breakaway(&mut self, config: &Config<N>, motions: &Motions<N>) -> Result<(), A::Error> {
        if self.is_done(StepName::Breakaway, "breakaway torque of each joint") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure(Stage::Start)?;
        let pose_rad = match self.falls() {
            true => motions.light_rad,
            false => upright(config),
        };
        self.progress.breakaway.clear();
        for joint in 0..N {
            let mut torque_nm = [0.0; 2];
            for (direction, torque_nm) in [1.0, -1.0].into_iter().zip(&mut torque_nm) {
                let sign = if direction > 0.0 {
                    "positive"
                } else {
                    "negative"
                };
                let name = format!("breakaway-{joint}-{sign}");
                let (rate_nm_per_s, stop_rad) = BREAKAWAY_RAMP;
                let slope = (direction * rate_nm_per_s, stop_rad);
                let done =
                    self.motion(&name, &|from| ramp(config, from, &pose_rad, joint, slope))?;
                let found = done.motions.first().and_then(|motion| {
                    sliding_torque_nm(config, &motion.recording, joint, direction)
                });
                *torque_nm = found.ok_or(ProcedureError::from(ExperimentError::Stuck {
                    joint: joint_label(config, joint),
                    torque_nm: config.limits.joint_torque_nm[joint],
                }))?;
            }
            self.progress.breakaway.push(JointBreakaway {
                positive_nm: torque_nm[0],
                negative_nm: torque_nm[1],
            });
        }
        Ok(self.finish(StepName::Breakaway, before_s, None)?)
    }

    /// Follows series and keeps the log.
    fn series(
        &mut self,
        step: StepName,
        name: &str,
        stage: Stage,
        series: &[Fourier<N>],
    ) -> Result<(), A::Error> {
        let duration_s: f64 = series.iter().map(|series| series.duration_s).sum();
        if self.is_done(
            step,
            &format!("{}, {duration_s:.0} s", name.replace('-', " ")),
        ) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure(stage)?;
        let done = self.motion(name, &|from| follow(from, series))?;
        Ok(self.finish(step, before_s, Some(done))?)
    }

    /// The log of a finished step.
    fn log_file(&self, step: StepName) -> PathBuf {
        let finished = self.progress.finished(step);
        let name = finished.and_then(|finished| finished.log.as_deref());
        let folder = self.options.out.join(LOGS);
        folder.join(format!("{}.mcap", name.unwrap_or_default()))
    }

    fn first_fit(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::FirstFit, "first fit") {
            return Ok(());
        }
        let model = self.model(Stage::Start)?;
        let scaled = fitting::with_breakaway::<N>(&model, &self.progress.breakaway)?;
        let pass = self.log_file(StepName::FirstPass);
        // The moves from the home pose reach where the pass does not.
        let logs = self.options.out.join(LOGS);
        let moves =
            ["warm-up", "breakaway-0-positive"].map(|name| logs.join(format!("{name}.mcap")));
        let of = scaled.clone();
        let fit = self.arm.meanwhile(move || {
            let mut others = Vec::new();
            for file in moves.iter().filter(|file| file.exists()) {
                others.extend(fitting::all_motion::<N>(file)?);
            }
            let pass = only(&fitting::excitations::<N>(&pass)?, "first-pass")?.clone();
            fitting::fit_first::<N>(&of, &pass, &others)
        })??;
        let (found, quality) = match fit {
            Some((found, quality)) => (found, Some(quality)),
            None => (scaled, None),
        };
        match &quality {
            Some(quality) => self.say(&format!(
                "unseen part of the first pass: {:.1} % of the torque unexplained, {:.1} % before",
                100.0 * quality.unseen_relative,
                100.0 * quality.unseen_relative_before
            )),
            None => self.say("the first fit is no better than the model before it, which stays"),
        }
        let folder = self.options.out.join(FIRST_MODEL);
        found.save(&folder).map_err(ProcedureError::from)?;
        self.progress.first_fit = quality;
        Ok(self.finish(StepName::FirstFit, self.progress.moved_s, None)?)
    }

    fn identification(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Identification, "identification") {
            return Ok(());
        }
        let model = self.model(Stage::First)?;
        let file = |step| self.log_file(step);
        let [full, slow] = [StepName::FullPass, StepName::SlowMotion].map(file);
        let [first, constant] = [StepName::FirstPass, StepName::ConstantSpeed].map(file);
        let unseen = self.log_file(StepName::UnseenMotion);
        // Reading takes as long as fitting; the arm's telemetry must be read meanwhile.
        let (found, quality) = self.arm.meanwhile(move || {
            let (mut logs, mut others) = (Vec::new(), Vec::new());
            for file in [&full, &slow, &first] {
                logs.extend(fitting::excitations::<N>(file)?);
            }
            for file in [&full, &slow, &unseen] {
                others.extend(fitting::all_motion::<N>(file)?);
            }
            let constant = fitting::excitations::<N>(&constant)?;
            let unseen = only(&fitting::excitations::<N>(&unseen)?, "unseen-motion")?.clone();
            fitting::fit_all::<N>(&model, &logs, &constant, &unseen, &others)
        })??;
        self.say(&summary(&quality));
        let found = found
            .with_held_joints_of(self.start)
            .map_err(ProcedureError::from)?;
        found
            .save(&self.options.out)
            .map_err(ProcedureError::from)?;
        self.progress.fit = Some(quality);
        Ok(self.finish(StepName::Identification, self.progress.moved_s, None)?)
    }

    fn float(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Float, "float: the arm stays where it is put") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure(Stage::Identified)?;
        let float = Step {
            recorded: true,
            ..Step::wait(Request::Float, FLOAT_S)
        };
        let start_rad = self.sinusoid_start()?.unwrap_or(self.home_rad);
        let hold = move_to(&start_rad, &start_rad);
        let from_rad = self.arm.position_rad()?;
        let steps = [move_to(&start_rad, &from_rad), float, hold];
        let performed = self.arm.perform("float", &steps)?;
        self.progress.moved_s += performed.moved_s;
        match performed.stopped {
            None => {
                self.progress.float_drift_rad = performed.motions.first().map(|motion| {
                    let q = &motion.recording.q_rad;
                    let ranges = q.column_iter().map(|column| column.max() - column.min());
                    ranges.fold(0.0, f64::max)
                });
            }
            // A trial that fails does not cost the model.
            Some(stopped) => {
                self.say(&format!("float ended by a fault: {}", stopped.fault));
                self.progress.float_ended = Some(stopped.fault);
                self.arm.recover()?;
            }
        }
        Ok(self.finish(StepName::Float, before_s, None)?)
    }

    /// Start of the sinusoid; `None` if the arm cannot reach it.
    fn sinusoid_start(&self) -> Result<Option<Vector<N>>, ProcedureError> {
        let config = config::<N>(&self.model(Stage::Identified)?)?;
        let (trajectory, duration_s) = self.start.paths().sinusoid(1.0);
        match start_pose(&config, "sinusoid", &trajectory, duration_s) {
            Ok(start_rad) => Ok(Some(start_rad)),
            Err(ExperimentError::BeyondJointStop { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    fn sinusoid(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Sinusoid, "sinusoid at 5 N/m, then with learning") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        let Some(start_rad) = self.sinusoid_start()? else {
            self.say("the arm cannot reach the sinusoid, which is left out");
            return Ok(self.finish(StepName::Sinusoid, before_s, None)?);
        };
        self.ensure(Stage::Identified)?;
        let (trajectory, duration_s) = self.start.paths().sinusoid(1.0);
        let track = |duration_s| Step {
            recorded: true,
            ..Step::wait(Request::Track(trajectory), duration_s)
        };
        let gains = Request::Gains {
            gains: scenario::gains(scenario::STIFFNESS_N_PER_M),
            ramp_s: 0.5 * GAINS_S,
        };
        let period_s = self.model(Stage::Identified)?.settings().period_s;
        let mut result = SinusoidResult::default();
        for learning in [false, true] {
            let (name, lead_s) = match learning {
                false => ("sinusoid", 0.0),
                true => ("sinusoid-learning", LEARNING_S),
            };
            let from_rad = self.arm.position_rad()?;
            let mut steps = vec![move_to(&start_rad, &from_rad), Step::wait(gains, GAINS_S)];
            if learning {
                let on = Request::Learning(LearningSwitch::On);
                steps.push(Step::wait(on, GAINS_S));
            }
            steps.push(track(lead_s + duration_s));
            // The sinusoid goes on until something else is requested.
            steps.push(Step::wait(
                Request::Move {
                    target_rad: start_rad,
                    duration_s: RETURN_S,
                },
                RETURN_S + GAINS_S,
            ));
            let performed = self.arm.perform(name, &steps)?;
            self.progress.moved_s += performed.moved_s;
            let motion = performed.motions.first();
            result.false_contacts += motion.map_or(0, |motion| motion.contacts);
            if let Some(stopped) = performed.stopped {
                result.ended = Some(stopped.fault);
                self.arm.recover()?;
                continue;
            }
            let errors = motion.map_or(&[][..], |motion| &motion.tip_error_m);
            let mut rms = Rms::default();
            let first = (lead_s / period_s) as usize;
            errors.iter().skip(first).for_each(|error| rms.add(*error));
            match learning {
                false => result.calibrated_rms_m = Some(rms.rms()),
                true => result.learning_rms_m = Some(rms.rms()),
            }
        }
        self.progress.sinusoid = Some(result);
        let home_rad = self.home_rad;
        let done = self.motion("home", &|from| vec![move_to(&home_rad, from)])?;
        Ok(self.finish(StepName::Sinusoid, before_s, Some(done))?)
    }
}

fn config<const N: usize>(model: &Description) -> Result<Config<N>, ProcedureError> {
    Ok(model.config::<N>()?)
}

fn only<'a>(logs: &'a [Log], name: &str) -> Result<&'a Log, ProcedureError> {
    logs.first().ok_or_else(|| ProcedureError::Stopped {
        motion: name.to_owned(),
        fault: "its log has no motion along a series".to_owned(),
        remedy: "repeat the calibration",
    })
}

fn name_of(stage: Stage) -> &'static str {
    match stage {
        Stage::Start => "start",
        Stage::First => "full-pass",
        Stage::Identified => "float",
    }
}

fn text_of(stage: Stage) -> &'static str {
    match stage {
        Stage::Start => "given model",
        Stage::First => "model of the first pass",
        Stage::Identified => "identified model",
    }
}

fn summary(quality: &FitQuality) -> String {
    format!(
        "unseen motion: {:.2} % of the torque unexplained, {:.2} % before; {}",
        100.0 * quality.unseen_relative,
        100.0 * quality.unseen_relative_before,
        quality.verdict
    )
}
