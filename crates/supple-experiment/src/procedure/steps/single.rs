//! Single motions of an arm, without the other steps of a calibration.

use super::{GAINS_S, ModelStage, REST_S, Run, config};
use crate::excite::move_to;
use crate::procedure::arm::MotionArm;
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::follow;
use crate::procedure::sweep::Sweep;
use crate::procedure::{LOGS, Operator, ProcedureOptions};
use crate::request_sequence::Step;
use crate::scenario;
use crate::start::start_pose;
use serde::Serialize;
use std::path::PathBuf;
use supple_core::Vector;
use supple_core::controller::Request;
use supple_core::trajectory::Fourier;
use supple_model::{Description, reach};

/// Name of the log of an excitation.
const EXCITATION: &str = "excitation";
/// Name of the log of a tracked sinusoid.
const SINUSOID: &str = "sinusoid";

/// Result of a motion.
#[derive(Clone, Debug, Serialize)]
pub struct SingleMotion {
    /// Name of the arm.
    pub arm: String,
    /// The log of the motion.
    pub log: PathBuf,
    /// Time in modes that move joints, of all motions \[s\].
    pub moved_s: f64,
    /// Faults by contact, after each of which the motion was repeated.
    pub contacts: Vec<String>,
}

/// Moves an arm, whose model `start` may be wrong, along each series and back to its home pose. The operator confirms the swept space
/// before. The log is `logs/excitation.mcap` in the folder of `options`.
///
/// # Errors
/// [`ProcedureError`] with the remedy, and the errors of the arm.
pub fn excite_arm<const N: usize, A: MotionArm<N>>(
    arm: &mut A,
    start: &Description,
    series: &[Fourier<N>],
    options: &ProcedureOptions,
    operator: &mut dyn Operator,
) -> Result<SingleMotion, A::Error> {
    let run = Run::without_progress(arm, start, options, operator)?;
    let limits = run.limits;
    let home_rad = run.home_rad;
    let steps = |from: &Vector<N>| follow(&limits, from, series, None);
    let sweep = |from: &Vector<N>| Sweep::of_motions(&limits, from, series, &home_rad);
    run.single(ModelStage::Start, EXCITATION, &sweep, &steps)
}

/// Tracks the sinusoid at 5 N/m with the model `start` for `duration_s` and moves back to the home pose. The operator confirms the
/// swept space before. The log is `logs/sinusoid.mcap` in the folder of `options`.
///
/// # Errors
/// As [`excite_arm`]; a sinusoid that the arm cannot reach.
pub fn track_arm<const N: usize, A: MotionArm<N>>(
    arm: &mut A,
    start: &Description,
    duration_s: f64,
    options: &ProcedureOptions,
    operator: &mut dyn Operator,
) -> Result<SingleMotion, A::Error> {
    let run = Run::without_progress(arm, start, options, operator)?;
    let limits = run.limits;
    let model = config::<N>(start)?;
    let (trajectory, period_s) = start.paths().sinusoid(1.0);
    let start_rad = start_pose(&model, SINUSOID, &trajectory, period_s);
    let start_rad = start_rad.map_err(ProcedureError::from)?;
    let gains = Request::Gains {
        gains: scenario::gains_like(&model.law.gains, scenario::STIFFNESS_N_PER_M),
        ramp_s: 0.5 * GAINS_S,
    };
    let steps = |from: &Vector<N>| {
        vec![
            move_to(&limits, &start_rad, from),
            Step::wait(gains, GAINS_S),
            Step {
                recorded: true,
                ..Step::wait(Request::Track(trajectory), duration_s)
            },
            Step::wait(Request::GravityHold, REST_S),
        ]
    };
    let poses = reach::follow(&model, &start_rad, &trajectory, period_s);
    // The start pose has been searched so that the arm can follow.
    let poses = poses.unwrap_or_else(|_| vec![start_rad]);
    let home_rad = run.home_rad;
    let sweep = |from: &Vector<N>| Sweep::of_poses(&model, from, &poses, &home_rad);
    run.single(ModelStage::Given, SINUSOID, &sweep, &steps)
}

impl<'a, const N: usize, A: MotionArm<N>> Run<'a, N, A> {
    pub(super) fn without_progress(
        arm: &'a mut A,
        start: &'a Description,
        options: &'a ProcedureOptions,
        operator: &'a mut dyn Operator,
    ) -> Result<Self, ProcedureError> {
        let run = Run::new(arm, start, options, operator)?;
        Ok(Run {
            keeps_progress: false,
            ..run
        })
    }

    fn single(
        mut self,
        stage: ModelStage,
        name: &str,
        sweep: &dyn Fn(&Vector<N>) -> Sweep,
        steps: &dyn Fn(&Vector<N>) -> Vec<Step<N>>,
    ) -> Result<SingleMotion, A::Error> {
        self.ensure_model(stage)?;
        let from_rad = self.arm.position_rad()?;
        let duration_s: f64 = steps(&from_rad).iter().map(|step| step.duration_s).sum();
        self.report(&format!("about {duration_s:.0} s of motion follow"));
        self.confirm_sweep(&sweep(&from_rad))?;
        self.report(name);
        let done = self.motion(name, steps)?;
        self.home("home")?;
        Ok(SingleMotion {
            arm: self.start.name().to_owned(),
            log: self
                .options
                .out
                .join(LOGS)
                .join(format!("{}.mcap", done.log)),
            moved_s: self.progress.moved_s,
            contacts: done.contacts,
        })
    }
}
