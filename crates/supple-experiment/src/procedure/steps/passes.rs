//! The steps that move the arm with the given model and the model of the first pass.

use super::{ModelStage, Run};
use crate::breakaway::{JointBreakaway, sliding_torque_nm};
use crate::calibrate::upright;
use crate::error::ExperimentError;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::{BREAKAWAY_RAMP, Motions, follow, ramp};
use crate::procedure::progress::StepName;
use crate::run::joint_label;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Vector};

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    pub(super) fn warm_up(&mut self, motions: &Motions<N>) -> Result<(), A::Error> {
        let text = format!("warm-up for {} s", self.options.warm_up_s);
        if self.is_done(StepName::WarmUp, &text) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        let mut done = None;
        if self.options.warm_up_s > 2.0 * motions.first.ramp_s {
            self.ensure_model(ModelStage::Start)?;
            let series = Fourier {
                duration_s: self.options.warm_up_s,
                ..motions.first
            };
            let limits = self.limits;
            let steps = |from: &Vector<N>| follow(&limits, from, &[series], None);
            done = Some(self.motion("warm-up", &steps)?);
        }
        Ok(self.finish(StepName::WarmUp, before_s, done)?)
    }

    pub(super) fn breakaway(
        &mut self,
        config: &Config<N>,
        motions: &Motions<N>,
    ) -> Result<(), A::Error> {
        if self.is_done(StepName::Breakaway, "breakaway torque of each joint") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure_model(ModelStage::Start)?;
        let pose_rad = match self.falls_without_torque() {
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

    /// Performs the step that follows `series`, and records its log; without series the step is finished without motion.
    pub(super) fn series(
        &mut self,
        step: StepName,
        name: &str,
        stage: ModelStage,
        series: &[Fourier<N>],
    ) -> Result<(), A::Error> {
        if series.is_empty() && self.progress.finished(step).is_none() {
            return Ok(self.finish(step, self.progress.moved_s, None)?);
        }
        let duration_s: f64 = series.iter().map(|series| series.duration_s).sum();
        if self.is_done(
            step,
            &format!("{}, {duration_s:.0} s", name.replace('-', " ")),
        ) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure_model(stage)?;
        let via_pose = self.via_pose(stage)?;
        let limits = self.limits;
        let steps = |from: &Vector<N>| follow(&limits, from, series, via_pose.as_ref());
        let done = self.motion(name, &steps)?;
        Ok(self.finish(step, before_s, Some(done))?)
    }
}
