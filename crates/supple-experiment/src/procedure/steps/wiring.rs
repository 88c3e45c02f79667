//! The step that checks signs, order and torque units of the joints.

use super::{ModelStage, REST_S, Run, config};
use crate::procedure::HOLD_REMEDY;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::{WIRING_RAMP, ramp, wiring_slope_nm_per_s};
use crate::procedure::progress::StepName;
use crate::procedure::wiring::{
    check_direction, check_gravity, check_ramp, difference_rad, ramp_result,
};
use crate::request_sequence::{Recording, Step};
use supple_core::controller::Request;
use supple_core::dynamics::{crba, gravity};
use supple_core::{Config, Vector};

/// Time in which an arm without brakes comes to rest in its position loops \[s\].
const SETTLE_S: f64 = 2.0;

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    pub(super) fn wiring(&mut self) -> Result<(), A::Error> {
        if self.is_done(
            StepName::Wiring,
            "signs, order and torque of the joints, by small motions",
        ) {
            return Ok(());
        }
        let before_s = self.progress.moved_s;
        self.ensure_model(ModelStage::Start)?;
        let config = config::<N>(&self.model(ModelStage::Start)?)?;
        if self.falls_without_torque() {
            // Gravity that the model lacks lets the arm sink in its position loops; a ramp must not count this motion.
            self.motion("settle", &|_| {
                vec![Step::wait(Request::GravityHold, SETTLE_S)]
            })?;
        }
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
    pub(super) fn wiring_ramp(
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
            // The first ramp begins in the present pose, because no move has been tried yet.
            let moves = |step: &Step<N>| matches!(step.request, Request::Move { .. });
            steps.retain(|step| !moves(step));
        }
        let performed = self.arm.perform(&name, &steps)?;
        self.progress.moved_s += performed.moved_s;
        let motion = performed.motions.into_iter().next();
        let recording = motion.map(|motion| motion.recording);
        if let Some(recording) = recording.as_ref().filter(|found| !found.t_s.is_empty()) {
            let mass_matrix = crba(&config.arm, pose_rad);
            let found = ramp_result(recording, joint, rate_nm_per_s, |other| {
                (mass_matrix[(other, joint)] / mass_matrix[(other, other)]).abs()
            });
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
                remedy: stopped
                    .as_ref()
                    .map_or(HOLD_REMEDY, |stopped| stopped.cause.remedy()),
                fault: stopped.map_or("no data".to_owned(), |stopped| stopped.fault),
            }
            .into()),
        }
    }
}
