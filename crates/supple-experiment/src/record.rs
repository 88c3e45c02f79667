//! Log writer for runs in virtual time.

use crate::error::ExperimentError;
use crate::rig::Cycle;
use crate::run::Plan;
use crate::trace::xyz;
use std::collections::BTreeMap;
use std::path::Path;
use supple_core::Config;
use supple_log::{Extras, LogError, PlantTruth, RunInfo, Writer};
use supple_model::Description;

/// Writes every cycle of a run to `<folder>/<name of the plan>.mcap`. Virtual time starts at zero.
pub struct Recorder<const N: usize> {
    writer: Writer<N>,
    period_ns: u64,
}

impl<const N: usize> Recorder<N> {
    /// Creates the log of a plan; `notes` contain other conditions of the run, such as the options of the plant.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn create(
        folder: &Path,
        description: &Description,
        plan: &Plan<N>,
        seed: u64,
        notes: BTreeMap<String, String>,
    ) -> Result<Recorder<N>, ExperimentError> {
        Self::named(folder, description, &plan.name, &plan.config, seed, notes)
    }

    /// Creates a log with a given name and notes.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn named(
        folder: &Path,
        description: &Description,
        name: &str,
        config: &Config<N>,
        seed: u64,
        notes: BTreeMap<String, String>,
    ) -> Result<Recorder<N>, ExperimentError> {
        let path = folder.join(format!("{name}.mcap"));
        let run = RunInfo {
            experiment: name.to_owned(),
            seed: Some(seed),
            notes,
            ..RunInfo::default()
        };
        Ok(Recorder {
            writer: Writer::create(&path, description, config, &run)?,
            period_ns: (config.period_s * 1e9).round() as u64,
        })
    }

    /// Writes one cycle.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn write_cycle(&mut self, cycle: &Cycle<'_, N>) -> Result<(), LogError> {
        let truth = &cycle.truth;
        let extras = Extras {
            truth: Some(PlantTruth {
                position_rad: truth.position_rad.into(),
                velocity_rad_per_s: truth.velocity_rad_per_s.into(),
                tip_position_m: xyz(&truth.tip_position_m),
                tip_velocity_m_per_s: xyz(&truth.tip_velocity_m_per_s),
                contact_force_n: xyz(&truth.contact_force_n),
                friction_torque_nm: truth.friction_torque_nm.into(),
                motor_torque_nm: truth.motor_torque_nm.into(),
            }),
            ..Extras::default()
        };
        let time_ns = cycle.input.cycle * self.period_ns;
        self.writer
            .write(time_ns, &cycle.input, &cycle.output, &extras)
    }

    /// Completes the log.
    ///
    /// # Errors
    /// If the log cannot be written.
    pub fn finish(self) -> Result<(), LogError> {
        self.writer.finish().map(|_| ())
    }
}
