//! The motions, and the space that they sweep.

use super::{FLOAT_S, GAINS_S, REST_S, RETURN_S, Run, Stage, config};
use crate::excite::move_to;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::{DesignPlan, Detour, Motions, follow, gains_along, ramps_s};
use crate::procedure::progress::{StepName, write_whole};
use crate::procedure::sweep::Sweep;
use crate::procedure::{DRAWING, LEARNING_S};
use supple_core::Config;

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    /// Whether the arm falls without torque: its motors may give less torque than is commanded, and gravity may need
    /// much of their limits.
    pub(super) fn falls(&self) -> bool {
        self.start.falls_without_torque()
    }

    /// The pose through which heavy moves go, if the arm falls without torque.
    pub(super) fn detour(&self, stage: Stage) -> Result<Option<Detour<N>>, ProcedureError> {
        let Some(light_rad) = self.light_rad else {
            return Ok(None);
        };
        let config = config::<N>(&self.model(stage)?)?;
        Ok(Some(Detour { config, light_rad }))
    }

    /// Designs the motions with the model of a stage.
    pub(super) fn design(&mut self, stage: Stage) -> Result<Motions<N>, A::Error> {
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
        let designed = designed.map_err(ProcedureError::from)?;
        self.light_rad = self.falls().then_some(designed.light_rad);
        Ok(designed)
    }

    /// The remaining motions within the torque limits by the model of the first fit, if the arm falls without torque. A
    /// space that they sweep beyond what was confirmed is confirmed anew.
    pub(super) fn redesign(&mut self, motions: Motions<N>) -> Result<Motions<N>, A::Error> {
        if !self.falls() || self.progress.finished(StepName::ValidationMotion).is_some() {
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
        // A first pass has little information on the inertias: the loops must be stable with those of the given model, too.
        let given = self
            .model(Stage::Start)?
            .config::<N>()
            .map_err(ProcedureError::from)?;
        self.first_gains = Some(gains_along(&given, &motions.all()).map_err(ProcedureError::from)?);
        Ok(motions)
    }

    /// Asks whether the arm may sweep a space.
    pub(super) fn ask(&mut self, sweep: &Sweep) -> Result<(), ProcedureError> {
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

    pub(super) fn confirm(
        &mut self,
        config: &Config<N>,
        motions: &Motions<N>,
    ) -> Result<(), A::Error> {
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
    pub(super) fn stated_s(&self, config: &Config<N>, motions: &Motions<N>) -> f64 {
        let all: f64 = follow(config, &self.home_rad, &motions.all(), None)
            .iter()
            .map(|step| step.duration_s)
            .sum();
        let (_, sinusoid_s) = self.start.paths().sinusoid(1.0);
        let first_rad = motions.first.at(0.0).position_rad;
        let returns_s = 9.0 * move_to(config, &first_rad, &self.home_rad).duration_s;
        all + self.options.warm_up_s
            + ramps_s(config)
            + REST_S
            + returns_s
            + FLOAT_S
            + 2.0 * (sinusoid_s + RETURN_S + GAINS_S)
            + LEARNING_S
    }
}
