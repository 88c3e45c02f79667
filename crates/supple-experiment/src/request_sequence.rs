//! A sequence of requests without a tip trajectory, for identification.

use crate::error::ExperimentError;
use crate::record::Recorder;
use crate::rig::{Cycle, Rig};
use crate::run::in_words;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::path::Path;
use supple_core::controller::{Mode, Request};
use supple_core::{Config, Controller, Vector};
use supple_model::Description;
use supple_plant::PlantConfig;

/// A request and its duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<const N: usize> {
    /// The request.
    pub request: Request<N>,
    /// Maximum duration \[s\].
    pub duration_s: f64,
    /// Whether to continue with the next step as soon as the requested mode has ended by itself.
    pub until_done: bool,
    /// Whether its cycles are recorded.
    pub recorded: bool,
}

impl<const N: usize> Step<N> {
    /// Returns a step of fixed duration that is not recorded.
    pub fn wait(request: Request<N>, duration_s: f64) -> Step<N> {
        Step {
            request,
            duration_s,
            until_done: false,
            recorded: false,
        }
    }
}

/// A sequence of requests with its controller and plant.
#[derive(Clone, Debug)]
pub struct RequestSequence<const N: usize> {
    /// Name of the sequence and of its log.
    pub name: String,
    /// The controller's configuration.
    pub config: Config<N>,
    /// The plant.
    pub plant: PlantConfig<N>,
    /// Initial pose of the plant \[rad\].
    pub start_rad: Vector<N>,
    /// The steps, in order.
    pub steps: Vec<Step<N>>,
}

/// Recorded data of one step, as a real arm would log it.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Time since the start of the sequence \[s\].
    pub t_s: Vec<f64>,
    /// Encoder angles, (samples, joints) \[rad\].
    pub q_rad: DMatrix<f64>,
    /// Commanded joint torques without ripple compensation \[N m\].
    pub tau_nm: DMatrix<f64>,
}

/// Called after every cycle with the index of its step. An error ends the sequence.
pub type StepCallback<'a, const N: usize> =
    dyn FnMut(&Cycle<'_, N>, usize) -> Result<(), ExperimentError> + 'a;

impl<const N: usize> RequestSequence<N> {
    /// Returns the maximum simulated time \[s\].
    pub fn duration_s(&self) -> f64 {
        self.steps.iter().map(|step| step.duration_s).sum()
    }

    /// Runs the sequence and, if a folder is given, writes its log to `<folder>/<name>.mcap` with `description`
    /// attached.
    ///
    /// # Errors
    /// As [`RequestSequence::perform`]; if the log cannot be written.
    pub fn record(
        &self,
        folder: Option<&Path>,
        description: &Description,
        seed: u64,
    ) -> Result<Vec<Recording>, ExperimentError> {
        self.record_with_notes(folder, description, seed, BTreeMap::new())
    }

    /// Does the same as [`RequestSequence::record`], with notes in the log, such as [`PlantOptions::notes`].
    ///
    /// # Errors
    /// As [`RequestSequence::record`].
    ///
    /// [`PlantOptions::notes`]: supple_plant::PlantOptions::notes
    pub fn record_with_notes(
        &self,
        folder: Option<&Path>,
        description: &Description,
        seed: u64,
        notes: BTreeMap<String, String>,
    ) -> Result<Vec<Recording>, ExperimentError> {
        let Some(folder) = folder else {
            return self.perform(&mut |_, _| Ok(()));
        };
        let mut recorder =
            Recorder::named(folder, description, &self.name, &self.config, seed, notes)?;
        let recordings = self.perform(&mut |cycle, _| Ok(recorder.write_cycle(cycle)?))?;
        recorder.finish()?;
        Ok(recordings)
    }

    /// Runs the sequence; returns one recording for each recorded step.
    ///
    /// # Errors
    /// [`ExperimentError`]; a fault is an error.
    pub fn perform(
        &self,
        on_step: &mut StepCallback<'_, N>,
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
                        reason: in_words(&self.config, &refusal),
                    });
                }
                if let Some(fault) = output.fault {
                    return Err(ExperimentError::Fault {
                        experiment: self.name.clone(),
                        time_s: cycle.measurement.time_s,
                        fault: in_words(&self.config, &fault),
                    });
                }
                on_step(&cycle, number)?;
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
    /// Creates a recording of rows of time \[s\], angles \[rad\] and torques \[N m\].
    pub(crate) fn of<const N: usize>(rows: &[(f64, Vector<N>, Vector<N>)]) -> Recording {
        Recording {
            t_s: rows.iter().map(|row| row.0).collect(),
            q_rad: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].1[j]),
            tau_nm: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].2[j]),
        }
    }
}
