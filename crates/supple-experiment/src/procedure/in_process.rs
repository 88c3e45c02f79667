//! The simulated arm in this process, in virtual time: time advances only in simulated cycles.

use super::arm::{Motion, MotionArm, PerformedMotion, StopCause, Stopped};
use super::error::ProcedureError;
use crate::error::ExperimentError;
use crate::record::Recorder;
use crate::request_sequence::Step;
use crate::rig::Rig;
use crate::run::in_words;
use crate::wiring::Wiring;
use std::collections::BTreeMap;
use std::path::PathBuf;
use supple_core::controller::{Fault, Mode, Request};
use supple_core::{Controller, Vector};
use supple_model::Description;
use supple_plant::PlantConfig;

/// Time for which the drives are idle while another model is loaded \[s\].
const IDLE_S: f64 = 0.3;
/// Gravity hold before the first motion \[s\].
const SETTLE_S: f64 = 0.2;
/// Time in which a stopped arm comes to rest \[s\].
const REST_S: f64 = 1.0;

/// A simulated arm with its controller.
pub struct InProcessArm<const N: usize> {
    rig: Option<Rig<N>>,
    model: Option<Description>,
    plant: PlantConfig<N>,
    start_rad: Vector<N>,
    /// Connections of encoders and motors, which may differ from the description.
    wiring: Wiring<N>,
    folder: PathBuf,
    notes: BTreeMap<String, String>,
}

impl<const N: usize> InProcessArm<N> {
    /// Creates an arm at rest at `start_rad`; writes logs to the existing `folder`, with `notes`.
    pub fn new(
        plant: PlantConfig<N>,
        start_rad: Vector<N>,
        folder: PathBuf,
        notes: BTreeMap<String, String>,
    ) -> Self {
        InProcessArm {
            rig: None,
            model: None,
            plant,
            start_rad,
            wiring: Wiring::AS_DESCRIBED,
            folder,
            notes,
        }
    }

    /// Returns the same arm with these connections of encoders and motors.
    #[must_use]
    pub fn with_wiring(self, wiring: Wiring<N>) -> Self {
        InProcessArm { wiring, ..self }
    }

    fn rig(&mut self) -> Result<&mut Rig<N>, ProcedureError> {
        self.rig.as_mut().ok_or_else(|| ProcedureError::Wiring {
            problem: "no model is loaded".to_owned(),
            remedy: "load one first".to_owned(),
        })
    }

    /// Runs a mode for a time; returns the fault that is latched at the end, in words.
    fn hold(
        &mut self,
        request: Request<N>,
        duration_s: f64,
    ) -> Result<Option<String>, ProcedureError> {
        let rig = self.rig()?;
        let cycles = cycles(duration_s, rig.controller().config().period_s);
        let mut fault = None;
        for k in 0..cycles {
            fault = rig.cycle((k == 0).then_some(request)).output.fault;
        }
        let config = rig.controller().config();
        Ok(fault.map(|fault| in_words(config, &fault)))
    }

    /// Leaves the drives idle for a time, from the cycle of this request if there is one. An arm without brakes would fall: it is
    /// supported in its pose.
    fn idle(&mut self, request: Option<Request<N>>, duration_s: f64) -> Result<(), ProcedureError> {
        let supported = self.is_without_brakes();
        let rig = self.rig()?;
        let pose_rad = rig.plant().truth().position_rad;
        for k in 0..cycles(duration_s, rig.controller().config().period_s) {
            let _ = rig.cycle(request.filter(|_| k == 0));
            if supported {
                rig.place(pose_rad)?;
            }
        }
        Ok(())
    }

    fn is_without_brakes(&self) -> bool {
        self.model
            .as_ref()
            .is_some_and(Description::falls_without_torque)
    }

    /// Holds the arm at rest: in gravity hold, or by position loops if it has no brakes.
    fn settle(&mut self, motion: &str, remedy: &'static str) -> Result<(), ProcedureError> {
        let fault = if self.is_without_brakes() {
            let period_s = self.rig()?.controller().config().period_s;
            self.hold(Request::GravityHold, period_s)?;
            let target_rad = self.position_rad()?;
            self.hold(
                Request::Move {
                    target_rad,
                    duration_s: SETTLE_S,
                },
                SETTLE_S,
            )?
        } else {
            self.hold(Request::GravityHold, SETTLE_S)?
        };
        match fault {
            None => Ok(()),
            Some(fault) => Err(ProcedureError::Stopped {
                motion: motion.to_owned(),
                fault,
                remedy,
            }),
        }
    }

    fn performed(
        &mut self,
        name: &str,
        steps: &[Step<N>],
    ) -> Result<PerformedMotion, ProcedureError> {
        let model = self.model.clone();
        let (folder, notes) = (self.folder.clone(), self.notes.clone());
        let seed = self.plant.seed;
        let rig = self.rig()?;
        let config = *rig.controller().config();
        let mut recorder = match &model {
            Some(model) => Some(Recorder::named(&folder, model, name, &config, seed, notes)?),
            None => None,
        };
        let mut performed = PerformedMotion::default();
        'steps: for (number, step) in steps.iter().enumerate() {
            let mut collector = Motion::collector::<N>();
            let mut wanted: Option<Mode> = None;
            for k in 0..cycles(step.duration_s, config.period_s) {
                let cycle = rig.cycle((k == 0).then_some(step.request));
                let output = &cycle.output;
                if let Some(recorder) = &mut recorder {
                    recorder.write_cycle(&cycle)?;
                }
                // Later refusals are of requests of the learner, which a change of mode may overtake.
                if let (Some(refusal), 0) = (output.refusal, k) {
                    return Err(ProcedureError::from(ExperimentError::Refused {
                        experiment: name.to_owned(),
                        reason: in_words(&config, &refusal),
                    }));
                }
                if let Some(fault) = output.fault {
                    performed.stopped = Some(Stopped {
                        step: number,
                        fault: in_words(&config, &fault),
                        cause: StopCause::of_fault(is_contact(&fault)),
                    });
                }
                if moves_joints(output.mode) {
                    performed.moved_s += config.period_s;
                }
                let wanted = *wanted.get_or_insert(output.mode);
                if performed.stopped.is_some() || step.until_done && output.mode != wanted {
                    break;
                }
                if step.recorded {
                    let truth_m = cycle.truth.tip_position_m;
                    let error_m = output.reference.map(|r| (r.position - truth_m).norm());
                    collector.add(
                        cycle.measurement.time_s,
                        cycle.measurement.position_rad,
                        output.torque_nm - output.torques.ripple,
                        error_m,
                        output.in_contact,
                    );
                }
            }
            if step.recorded {
                performed.motions.push(collector.finish());
            }
            if performed.stopped.is_some() {
                break 'steps;
            }
        }
        if let Some(recorder) = recorder {
            recorder.finish()?;
        }
        Ok(performed)
    }
}

/// Returns whether the arm moves in this mode.
pub fn moves_joints(mode: Mode) -> bool {
    matches!(
        mode,
        Mode::Move | Mode::Excite | Mode::Breakaway | Mode::Track | Mode::Probe
    )
}

fn is_contact(fault: &Fault) -> bool {
    matches!(
        fault,
        Fault::JointCollision { .. }
            | Fault::TipCollision { .. }
            | Fault::JointTrackingError { .. }
    )
}

fn cycles(duration_s: f64, period_s: f64) -> u64 {
    (duration_s / period_s).round() as u64
}

impl<const N: usize> MotionArm<N> for InProcessArm<N> {
    type Error = ProcedureError;

    fn load(&mut self, model: &Description) -> Result<(), ProcedureError> {
        let controller = Controller::new(model.config::<N>()?)?;
        match &mut self.rig {
            Some(rig) => rig.replace_controller(controller),
            None => {
                let rig = Rig::new(controller, self.plant.clone(), self.start_rad)?;
                self.rig = Some(rig.with_wiring(self.wiring).with_learner());
            }
        }
        self.model = Some(model.clone());
        self.idle(Some(Request::Idle), IDLE_S)?;
        self.settle("holding still", super::HOLD_REMEDY)
    }

    fn refusal(error: &ProcedureError) -> Option<&str> {
        match error {
            ProcedureError::Experiment(ExperimentError::Refused { reason, .. }) => Some(reason),
            _ => None,
        }
    }

    fn position_rad(&mut self) -> Result<Vector<N>, ProcedureError> {
        let wiring = self.wiring;
        let rig = self.rig()?;
        Ok(wiring.read(&rig.plant().measurement().position_rad))
    }

    fn perform(
        &mut self,
        name: &str,
        steps: &[Step<N>],
    ) -> Result<PerformedMotion, ProcedureError> {
        self.performed(name, steps)
    }

    fn recover(&mut self) -> Result<(), ProcedureError> {
        self.idle(None, REST_S)?;
        self.idle(Some(Request::Reset), IDLE_S)?;
        self.settle(
            "holding still after a fault",
            "free the arm and clear the fault",
        )
    }

    fn learned(&mut self) -> Result<Option<Description>, ProcedureError> {
        let report = self.rig()?.report();
        let (Some(report), Some(model)) = (report, &self.model) else {
            return Ok(None);
        };
        if report.learned_s.iter().all(|s| *s == 0.0) {
            return Ok(None);
        }
        Ok(Some(model.with_learned(&report.terms, &report.source())?))
    }

    fn take_weight(
        &mut self,
        weight_kg: f64,
        _: &mut dyn FnMut() -> bool,
    ) -> Result<(), ProcedureError> {
        self.idle(Some(Request::Idle), IDLE_S)?;
        Ok(self.rig()?.add_payload(weight_kg)?)
    }

    fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, ProcedureError> {
        Ok(work())
    }
}
