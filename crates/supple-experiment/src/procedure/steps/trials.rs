//! Trials of the identified model: float and sinusoid.

use super::{FLOAT_S, GAINS_S, ModelStage, REST_S, Run, config};
use crate::error::ExperimentError;
use crate::excite::move_to;
use crate::metrics::Rms;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::progress::{SinusoidResult, StepName};
use crate::procedure::{LEARNED_MODEL, LEARNING_S};
use crate::request_sequence::Step;
use crate::scenario;
use crate::start::start_pose;
use supple_core::Vector;
use supple_core::controller::{LearningSwitch, Request};

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    pub(super) fn float(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Float, "float: the arm stays where it is put") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure_model(ModelStage::Identified)?;
        let float = Step {
            recorded: true,
            ..Step::wait(Request::Float, FLOAT_S)
        };
        let start_rad = self.sinusoid_start()?.unwrap_or(self.home_rad);
        let hold = move_to(&self.limits, &start_rad, &start_rad);
        let from_rad = self.arm.position_rad()?;
        let steps = [move_to(&self.limits, &start_rad, &from_rad), float, hold];
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
            // The identified model is kept if a trial fails.
            Some(stopped) => {
                self.report(&format!("float ended by a fault: {}", stopped.fault));
                self.progress.float_ended = Some(stopped.fault);
                self.write_progress()?;
                self.arm.recover()?;
            }
        }
        Ok(self.finish(StepName::Float, before_s, None)?)
    }

    /// Returns the start pose of the sinusoid; `None` if the arm cannot reach the sinusoid.
    pub(super) fn sinusoid_start(&self) -> Result<Option<Vector<N>>, ProcedureError> {
        let config = config::<N>(&self.model(ModelStage::Identified)?)?;
        let (trajectory, duration_s) = self.start.paths().sinusoid(1.0);
        match start_pose(&config, "sinusoid", &trajectory, duration_s) {
            Ok(start_rad) => Ok(Some(start_rad)),
            Err(ExperimentError::BeyondJointStop { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    pub(super) fn sinusoid(&mut self) -> Result<(), A::Error> {
        if self.is_done(StepName::Sinusoid, "sinusoid at 5 N/m, then with learning") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        let Some(start_rad) = self.sinusoid_start()? else {
            self.report("the arm cannot reach the sinusoid, which is left out");
            return Ok(self.finish(StepName::Sinusoid, before_s, None)?);
        };
        self.ensure_model(ModelStage::Identified)?;
        let config = config::<N>(&self.model(ModelStage::Identified)?)?;
        let (trajectory, duration_s) = self.start.paths().sinusoid(1.0);
        let track = |duration_s| Step {
            recorded: true,
            ..Step::wait(Request::Track(trajectory), duration_s)
        };
        let gains = Request::Gains {
            gains: scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M),
            ramp_s: 0.5 * GAINS_S,
        };
        let period_s = config.period_s;
        let mut result = SinusoidResult::default();
        for learning in [false, true] {
            let (name, lead_s) = match learning {
                false => ("sinusoid", 0.0),
                true => ("sinusoid-learning", LEARNING_S),
            };
            let from_rad = self.arm.position_rad()?;
            let mut steps = vec![
                move_to(&self.limits, &start_rad, &from_rad),
                Step::wait(gains, GAINS_S),
            ];
            if learning {
                let on = Request::Learning(LearningSwitch::On);
                steps.push(Step::wait(on, GAINS_S));
            }
            steps.push(track(lead_s + duration_s));
            // The sinusoid continues until the next request. The arm may be far from it.
            steps.push(Step::wait(Request::GravityHold, REST_S));
            let performed = self.arm.perform(name, &steps)?;
            self.progress.moved_s += performed.moved_s;
            let motion = performed.motions.first();
            result.false_contacts += motion.map_or(0, |motion| motion.contacts);
            if let Some(stopped) = performed.stopped {
                result.ended = Some(stopped.fault);
                // Also kept if the arm cannot be held after the fault.
                self.progress.sinusoid = Some(result.clone());
                self.write_progress()?;
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
        if result.learning_rms_m.is_some()
            && let Some(learned) = self.arm.learned()?
        {
            let folder = self.options.out.join(LEARNED_MODEL);
            learned.save(&folder).map_err(ProcedureError::from)?;
            result.learned_model = Some(LEARNED_MODEL.to_owned());
        }
        self.progress.sinusoid = Some(result);
        let done = self.home("home")?;
        Ok(self.finish(StepName::Sinusoid, before_s, Some(done))?)
    }
}
