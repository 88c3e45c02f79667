//! A list of requests carried out one after the other, without a tip trajectory: what identification
//! needs of the arm.

use crate::error::ExperimentError;
use crate::record::Recorder;
use crate::rig::{Cycle, Rig};
use nalgebra::DMatrix;
use std::path::Path;
use supple_core::controller::{Mode, Request};
use supple_core::{Config, Controller, Vector};
use supple_model::Description;
use supple_plant::PlantConfig;

/// One request and how long it is left to work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<const N: usize> {
    /// What is asked for.
    pub request: Request<N>,
    /// For how long \[s\].
    pub duration_s: f64,
    /// Goes on to the next step as soon as the mode that was asked for has ended by itself.
    pub until_done: bool,
    /// Its cycles are recorded.
    pub recorded: bool,
}

impl<const N: usize> Step<N> {
    /// For a time, not recorded.
    pub fn wait(request: Request<N>, duration_s: f64) -> Step<N> {
        Step {
            request,
            duration_s,
            until_done: false,
            recorded: false,
        }
    }
}

/// What to carry out.
#[derive(Clone, Debug)]
pub struct Session<const N: usize> {
    /// Name, and that of its log.
    pub name: String,
    /// The controller's configuration.
    pub config: Config<N>,
    /// The plant.
    pub plant: PlantConfig<N>,
    /// Where the plant stands at first \[rad\].
    pub start_rad: Vector<N>,
    /// In order.
    pub steps: Vec<Step<N>>,
}

/// What the arm itself would have logged in one recorded step.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Time since the session began \[s\].
    pub t_s: Vec<f64>,
    /// Angles through the encoders, (samples, joints) \[rad\].
    pub q_rad: DMatrix<f64>,
    /// Joint torques commanded, without what was added against ripple \[N m\].
    pub tau_nm: DMatrix<f64>,
}

/// Sees every cycle, with the number of its step. An error ends the session.
pub type Onlooker<'a, const N: usize> =
    dyn FnMut(&Cycle<'_, N>, usize) -> Result<(), ExperimentError> + 'a;

impl<const N: usize> Session<N> {
    /// Simulated time at most \[s\].
    pub fn duration_s(&self) -> f64 {
        self.steps.iter().map(|step| step.duration_s).sum()
    }

    /// Carries it out, with its log as `<folder>/<name>.mcap` where a folder is given; `description` is
    /// what the log says of the arm.
    ///
    /// # Errors
    /// As [`Session::perform`]; where the log cannot be written.
    pub fn record(
        &self,
        folder: Option<&Path>,
        description: &Description,
        seed: u64,
    ) -> Result<Vec<Recording>, ExperimentError> {
        let Some(folder) = folder else {
            return self.perform(&mut |_, _| Ok(()));
        };
        let mut recorder = Recorder::named(folder, description, &self.name, &self.config, seed)?;
        let recordings = self.perform(&mut |cycle, _| Ok(recorder.cycle(cycle)?))?;
        recorder.finish()?;
        Ok(recordings)
    }

    /// Carries it out; one recording for each recorded step.
    ///
    /// # Errors
    /// [`ExperimentError`]; a fault ends it.
    pub fn perform(
        &self,
        onlooker: &mut Onlooker<'_, N>,
    ) -> Result<Vec<Recording>, ExperimentError> {
        let controller = Controller::new(self.config)?;
        let mut rig = Rig::new(controller, self.plant.clone(), self.start_rad)?;
        let mut recordings = Vec::new();
        for (number, step) in self.steps.iter().enumerate() {
            let cycles = (step.duration_s / self.config.period_s).round() as u64;
            let mut rows: Vec<(f64, Vector<N>, Vector<N>)> = Vec::new();
            let mut wanted: Option<Mode> = None;
            for k in 0..cycles {
                let cycle = rig.cycle((k == 0).then_some(step.request));
                let output = &cycle.output;
                if let Some(refusal) = output.refusal {
                    return Err(ExperimentError::Refused {
                        experiment: self.name.clone(),
                        refusal,
                    });
                }
                if let Some(fault) = output.fault {
                    return Err(ExperimentError::Fault {
                        experiment: self.name.clone(),
                        time_s: cycle.measurement.time_s,
                        fault,
                    });
                }
                onlooker(&cycle, number)?;
                if step.recorded {
                    rows.push((
                        cycle.measurement.time_s,
                        cycle.measurement.position_rad,
                        output.torque_nm - output.torques.ripple,
                    ));
                }
                if step.until_done && output.mode != *wanted.get_or_insert(output.mode) {
                    break;
                }
            }
            if step.recorded {
                recordings.push(Recording::of(&rows));
            }
        }
        Ok(recordings)
    }
}

impl Recording {
    fn of<const N: usize>(rows: &[(f64, Vector<N>, Vector<N>)]) -> Recording {
        Recording {
            t_s: rows.iter().map(|row| row.0).collect(),
            q_rad: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].1[j]),
            tau_nm: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].2[j]),
        }
    }
}
