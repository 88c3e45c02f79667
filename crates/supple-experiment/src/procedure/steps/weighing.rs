//! The step that moves a weight of known mass: it fixes the torque scales, which motions without it leave open.

use super::fits::single_log;
use super::{ModelStage, Run, config};
use crate::error::ExperimentError;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::follow;
use crate::procedure::progress::StepName;
use crate::procedure::{LOGS, fitting};
use supple_core::dynamics::{gravity, rnea};
use supple_core::trajectory::Fourier;
use supple_core::{Arm, Body, Config, Vector};
use supple_model::{Description, IdentifiedModel};

/// Radius of the ball that the model supposes \[m\].
const RADIUS_M: f64 = 0.03;
/// Share of a torque limit that the motion may need.
const TORQUE_SHARE: f64 = 0.9;
/// Time between the poses in which the torque is checked \[s\].
const CHECK_STEP_S: f64 = 0.02;

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    pub(super) fn weighing(&mut self) -> Result<(), A::Error> {
        let Some(weight_kg) = self.options.weight_kg else {
            return Ok(());
        };
        if self.is_done(StepName::Weighing, "motion with the weight") {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        // The validation motion as it was confirmed and performed, see `redesign`.
        let designed_with = match self.falls_without_torque() {
            true => ModelStage::First,
            false => ModelStage::Start,
        };
        let series = self.design(designed_with)?.validation;
        check_torques(
            &config::<N>(&self.weighted()?)?,
            &self.names,
            &series,
            weight_kg,
        )?;
        if self.loaded.is_some() {
            self.home("home-before-the-weight")?;
        }
        self.report("the arm is set down, for the weight");
        let (arm, operator) = (&mut *self.arm, &mut *self.operator);
        arm.take_weight(weight_kg, &mut || operator.attaches_weight(weight_kg))?;
        self.loaded = None;
        self.ensure_model(ModelStage::Weighted)?;
        let via_pose = self.via_pose(ModelStage::First)?;
        let limits = self.limits;
        let steps = |from: &Vector<N>| follow(&limits, from, &[series], via_pose.as_ref());
        let done = self.motion("weighing", &steps)?;
        let log = self.options.out.join(LOGS);
        let log = log.join(format!("{}.mcap", done.log));
        let (model, fitted) = (self.model(ModelStage::First)?, self.fitted_files());
        let found = self.arm.meanwhile(move || {
            let weighted = fitting::read_excitations::<N>(&log)?;
            let weighted = single_log(&weighted, "weighing")?;
            fitting::weigh_arm::<N>(&model, &fitted.read::<N>()?, weighted, weight_kg)
        })??;
        self.progress.weighing = Some(found);
        self.home("home-with-the-weight")?;
        self.report("the weight stays on the arm: take it off once the arm is without torque");
        Ok(self.finish(StepName::Weighing, before_s, Some(done))?)
    }

    /// Returns the identified model with the weight at its tip.
    pub(super) fn weighted(&self) -> Result<Description, ProcedureError> {
        let model = self
            .model(ModelStage::Identified)?
            .with_all_joints_active()?;
        let config = config::<N>(&model)?;
        let mass_kg = self.options.weight_kg.unwrap_or_default();
        let arm = &config.arm;
        let weight = Body::ball(mass_kg, RADIUS_M, arm.joint_from_tip().translation);
        let loaded = arm.body(N - 1).merged(&weight);
        let mut links = *arm.links();
        let last = &mut links[N - 1];
        last.mass = loaded.mass_kg;
        last.first_moment = loaded.com_m * loaded.mass_kg;
        last.inertia = loaded.inertia_about_origin();
        let (armature, tip) = (arm.armature(), arm.joint_from_tip());
        let arm =
            Arm::from_links(links, armature, tip, arm.gravity()).map_err(ExperimentError::from)?;
        Ok(model.with_model(&IdentifiedModel {
            arm: &arm,
            friction: &config.friction,
            ripple: Some(&config.ripple),
            source: "identified, with a weight at the tip",
        })?)
    }
}

/// Rejects a weight with which the motion needs more than [`TORQUE_SHARE`] of a torque limit.
fn check_torques<const N: usize>(
    config: &Config<N>,
    names: &[String],
    series: &Fourier<N>,
    weight_kg: f64,
) -> Result<(), ProcedureError> {
    let arm = &config.arm;
    let steps = (series.duration_s / CHECK_STEP_S) as usize;
    for step in 0..=steps {
        let at = series.at(CHECK_STEP_S * step as f64);
        let (q, qd) = (&at.position_rad, &at.velocity_rad_per_s);
        let torque_nm = rnea(arm, q, qd, &at.acceleration_rad_per_s2);
        let gravity_nm = gravity(arm, q);
        for joint in 0..N {
            let friction = config.friction[joint].at_load(gravity_nm[joint]);
            let needed_nm = (torque_nm[joint] + friction.torque_nm(qd[joint])).abs();
            let limit_nm = config.limits.joint_torque_nm[joint];
            if needed_nm > TORQUE_SHARE * limit_nm {
                return Err(ProcedureError::HeavyWeight {
                    weight_kg,
                    joint: names[joint].clone(),
                    torque_nm: needed_nm,
                    limit_nm,
                });
            }
        }
    }
    Ok(())
}
