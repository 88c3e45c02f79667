//! The motions, and the space that they sweep.

use super::{FLOAT_S, GAINS_S, ModelStage, REST_S, Run, config};
use crate::excite::move_to;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::{
    DesignPlan, Motions, ViaPose, every_way, follow, gains_along, ramps_s,
};
use crate::procedure::progress::{StepName, write_whole};
use crate::procedure::sweep::Sweep;
use crate::procedure::{DRAWING, LEARNING_S};
use supple_core::Config;

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    /// Returns whether the arm falls without torque: its motors may give less torque than is commanded, and gravity may need
    /// much of their limits.
    pub(super) fn falls_without_torque(&self) -> bool {
        self.start.falls_without_torque()
    }

    /// Returns whether torque ripple is identified: if asked, or if the arm does not fall without torque.
    fn identifies_ripple(&self) -> bool {
        self.options.ripple_runs || !self.falls_without_torque()
    }

    /// Returns the via pose of moves that need much torque, if the arm falls without torque.
    pub(super) fn via_pose(&self, stage: ModelStage) -> Result<Option<ViaPose<N>>, ProcedureError> {
        let Some(light_rad) = self.light_rad else {
            return Ok(None);
        };
        let config = config::<N>(&self.model(stage)?)?;
        Ok(Some(ViaPose::new(config, &light_rad, self.home_rad)))
    }

    /// Designs the motions with the model of a stage.
    pub(super) fn design(&mut self, stage: ModelStage) -> Result<Motions<N>, A::Error> {
        self.report("design of the excitation");
        let home_rad = self.home_rad;
        let config = config::<N>(&self.model(stage)?)?;
        let unknown = match stage {
            ModelStage::Start => true,
            ModelStage::Given => false,
            ModelStage::First | ModelStage::Identified | ModelStage::Weighted => {
                self.progress.first_fit.is_none()
            }
        };
        let plan = DesignPlan {
            seed: self.options.seed,
            candidates: self.options.candidates,
            falls: self.falls_without_torque(),
            ripple: self.identifies_ripple(),
            careful: self.falls_without_torque() && unknown,
        };
        let work = move || Motions::design(&config, &home_rad, &plan);
        let designed = self.arm.meanwhile(work)?;
        let designed = designed.map_err(ProcedureError::from)?;
        self.light_rad = self.falls_without_torque().then_some(designed.light_rad);
        Ok(designed)
    }

    /// If the arm falls without torque, designs the remaining motions within the torque limits with the model of the first fit.
    /// If these motions leave the confirmed space, the operator must confirm the new space.
    pub(super) fn redesign(&mut self, motions: Motions<N>) -> Result<Motions<N>, A::Error> {
        if !self.falls_without_torque()
            || self.progress.finished(StepName::ValidationMotion).is_some()
        {
            return Ok(motions);
        }
        let motions = self.design(ModelStage::First)?;
        let config = config::<N>(&self.model(ModelStage::First)?)?;
        let sweep = self.sweep(&config, &motions);
        let confirmed = self.progress.sweep.as_ref();
        if confirmed.is_none_or(|confirmed| !confirmed.contains(&sweep)) {
            self.report("by the model of the first pass the arm sweeps another space");
            self.confirm_sweep(&sweep)?;
        }
        // The first pass contains little information about the inertias, so the loops must also be stable with the inertias of
        // the given model.
        let given = self
            .model(ModelStage::Start)?
            .config::<N>()
            .map_err(ProcedureError::from)?;
        let mut gains = gains_along(&given, &motions.all()).map_err(ProcedureError::from)?;
        let own = gains_along(&config, &motions.all()).map_err(ProcedureError::from)?;
        gains.stiffness_nm_per_rad = gains.stiffness_nm_per_rad.inf(&own.stiffness_nm_per_rad);
        gains.damping_nm_s_per_rad = gains.damping_nm_s_per_rad.inf(&own.damping_nm_s_per_rad);
        self.first_gains = Some(gains);
        Ok(motions)
    }

    /// Returns the space of the motions, and of the ways between them by a via pose.
    fn sweep(&self, config: &Config<N>, motions: &Motions<N>) -> Sweep {
        let all = motions.all();
        let sweep = Sweep::of(config, &self.home_rad, &all);
        let Some(light_rad) = self.light_rad else {
            return sweep;
        };
        let via_pose = ViaPose::new(*config, &light_rad, self.home_rad);
        let ends = all.iter().flat_map(|series| {
            [0.0, series.duration_s].map(|time_s| series.at(time_s).position_rad)
        });
        let ends: Vec<_> = ends.collect();
        let route = every_way(&self.home_rad, &ends, &self.home_rad, Some(&via_pose));
        sweep.with(Sweep::of_moves(
            config,
            &self.home_rad,
            &route,
            &self.home_rad,
        ))
    }

    /// Asks the operator whether the arm may sweep a space.
    pub(super) fn confirm_sweep(&mut self, sweep: &Sweep) -> Result<(), ProcedureError> {
        let drawing = self.options.out.join(DRAWING);
        write_whole(&drawing, sweep.svg().as_bytes())?;
        let text = format!("the arm sweeps {}: {}", sweep.text(), drawing.display());
        self.report(&text);
        let confirmed = self.operator.confirms(sweep, &drawing);
        self.progress.sweep = Some(sweep.clone());
        self.write_progress()?;
        match confirmed {
            true => Ok(()),
            false => Err(ProcedureError::NotConfirmed { drawing }),
        }
    }

    pub(super) fn confirm(
        &mut self,
        config: &Config<N>,
        motions: &Motions<N>,
    ) -> Result<(), A::Error> {
        let sweep = self.sweep(config, motions);
        if self.progress.finished(StepName::Confirmed).is_some() {
            // After the first fit the arm moves by another design, which is confirmed if it leaves this space.
            let moves_by_another = self.progress.finished(StepName::FirstFit).is_some();
            let confirmed = self.progress.sweep.as_ref();
            if moves_by_another || confirmed.is_some_and(|confirmed| confirmed.contains(&sweep)) {
                return Ok(());
            }
            self.report("this version designs another motion than the one that was confirmed");
            return Ok(self.confirm_sweep(&sweep)?);
        }
        let stated_s = self.stated_s(config, motions);
        self.progress.stated_s = stated_s;
        let text = format!("about {:.1} minutes of motion follow", stated_s / 60.0);
        self.report(&text);
        self.confirm_sweep(&sweep)?;
        Ok(self.finish(StepName::Confirmed, self.progress.moved_s, None)?)
    }

    /// Returns the approximate time of all motion \[s\].
    pub(super) fn stated_s(&self, config: &Config<N>, motions: &Motions<N>) -> f64 {
        let until_breakaway_s = self.options.warm_up_s + ramps_s(config) + REST_S;
        let before_the_passes = [StepName::Confirmed, StepName::WarmUp, StepName::Breakaway];
        if self
            .options
            .until
            .is_some_and(|step| before_the_passes.contains(&step))
        {
            return until_breakaway_s;
        }
        let all: f64 = follow(config, &self.home_rad, &motions.all(), None)
            .iter()
            .map(|step| step.duration_s)
            .sum();
        let (_, sinusoid_s) = self.start.paths().sinusoid(1.0);
        let first_rad = motions.first.at(0.0).position_rad;
        let returns_s = 9.0 * move_to(config, &first_rad, &self.home_rad).duration_s;
        all + until_breakaway_s
            + returns_s
            + FLOAT_S
            + 2.0 * (sinusoid_s + REST_S + GAINS_S)
            + LEARNING_S
    }
}
