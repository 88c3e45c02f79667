//! Conversion of a fit to a description that the controller loads: TOML and URDF.

use crate::error::IdentError;
use crate::fit::Fit;
use crate::validate::Validation;
use std::path::Path;
use supple_core::learned::LearnedTerms;
use supple_core::{Config, RippleTable};
use supple_model::{Description, IdentifiedModel, ModelError};

/// Ratio of the collision threshold to the maximum residual of free motion. Motions that the logs do not contain, faster or with
/// the arm stretched out, have larger residuals.
pub const RESIDUAL_MARGIN: f64 = 3.0;
/// Part of the collision threshold, as a multiple of the breakaway torque: when a joint reverses, modelled and true dry friction
/// may have opposite signs.
const REVERSAL_MARGIN: f64 = 2.0;
/// Part of the collision threshold, as a fraction of the joint's torque limit: for motions beyond the logs and the resolution of
/// the drive.
const LIMIT_SHARE: f64 = 0.005;

/// Error of saving a fit.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The fit is physically inconsistent.
    #[error(transparent)]
    Fit(#[from] IdentError),
    /// The resulting description is invalid or cannot be written.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl<const N: usize> Fit<N> {
    /// Returns `of` with the identified model: inertias of all links, rotors and friction of the identified joints, and, if they
    /// were identified, springs, tilt and torque scales as `[learned]` and the compliance of the joints. The fit explains the
    /// whole torque of the identified joints; therefore their learned terms and compliance in `of` are removed, and so are its
    /// payload and tilt, which act on several joints. Terms of the other joints and all other text are unchanged. `ripple`, if
    /// given, replaces the motors' tables.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn description(
        &self,
        of: &Description,
        ripple: Option<&[RippleTable; N]>,
    ) -> Result<Description, SaveError> {
        let error = 100.0 * self.training_relative;
        let source = format!("identified from logs; {error:.2} % of the torque left unexplained");
        let (effects, given) = (self.columns.effects(), of.config::<N>()?);
        // The controller scales friction with the rest of its model.
        let mut friction = self.friction_with(of.friction());
        let scale = self.learned(&given).parameters.torque_scale;
        for (friction, scale) in friction.iter_mut().zip(&scale) {
            *friction = friction.scaled(1.0 / (1.0 + scale));
        }
        let described = of.with_model(&IdentifiedModel {
            arm: &self.arm()?,
            friction: &friction,
            ripple,
            source: &source,
        })?;
        let moves = |joint: usize| self.columns.identified_joints().contains(&joint);
        let found = self.compliance_rad_per_nm();
        let compliance = core::array::from_fn::<f64, N, _>(|joint| match moves(joint) {
            true => found[joint].max(0.0),
            false => given.compliance_rad_per_nm[joint],
        });
        let described = match compliance == *given.compliance_rad_per_nm.as_slice() {
            true => described,
            false => described.with_compliance(&compliance)?,
        };
        let learns = effects.springs || effects.tilt || effects.torque_scale;
        if of.settings().learned.is_none() && !learns {
            return Ok(described);
        }
        let mut learned = self.learned(&described.config::<N>()?);
        for joint in (0..N).filter(|joint| !moves(*joint)) {
            let (to, from) = (&mut learned.parameters, &given.learned.parameters);
            to.viscous_nm_s_per_rad[joint] = from.viscous_nm_s_per_rad[joint];
            to.coulomb_nm[joint] = from.coulomb_nm[joint];
            to.offset_nm[joint] = from.offset_nm[joint];
            to.torque_scale[joint] = from.torque_scale[joint];
            learned.map[joint] = given.learned.map[joint];
        }
        if learned == LearnedTerms::zero() {
            return Ok(described);
        }
        Ok(described.with_learned(&learned, "identified with the model")?)
    }

    /// Returns the collision thresholds for the modes with stiff joint loops: those of [`Fit::collision_nm`], at most the joint's
    /// present threshold \[N m\].
    pub fn move_collision_nm(&self, held_out: &[Validation], of: &Config<N>) -> [Option<f64>; N] {
        let mut thresholds = self.collision_nm(held_out, of);
        for (joint, threshold_nm) in thresholds.iter_mut().enumerate() {
            let present_nm = of.collision.move_joint_torque_nm[joint];
            *threshold_nm = threshold_nm.map(|nm| nm.min(present_nm));
        }
        thresholds
    }

    /// Returns the minimum collision thresholds that errors of the model do not exceed, from its residual on held-out motions
    /// \[N m\]: three times the maximum residual of the joint, plus twice its breakaway torque at half of its torque limit, plus
    /// 0.5 % of that limit. `None` for a joint that was not identified.
    pub fn collision_nm(&self, held_out: &[Validation], of: &Config<N>) -> [Option<f64>; N] {
        let friction = self.friction_with(&of.friction);
        let mut thresholds = [None; N];
        for (row, joint) in self.columns.identified_joints().iter().enumerate() {
            let peaks = held_out.iter().map(|log| log.peak_nm[row]);
            let peak_nm = peaks.fold(0.0, f64::max);
            let limit_nm = of.limits.joint_torque_nm[*joint];
            let loaded = friction[*joint].at_load(0.5 * limit_nm);
            let reversal_nm = REVERSAL_MARGIN * loaded.breakaway_nm;
            thresholds[*joint] =
                Some(RESIDUAL_MARGIN * peak_nm + reversal_nm + LIMIT_SHARE * limit_nm);
        }
        thresholds
    }

    /// Writes [`Fit::description`] as `arm.toml` and `arm.urdf` into `folder`.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn save(&self, of: &Description, folder: &Path) -> Result<(), SaveError> {
        Ok(self.description(of, None)?.save(folder)?)
    }
}
