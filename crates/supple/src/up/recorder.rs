//! Writes telemetry to a log as long as the log can be written: a full disk ends the log, but not the run.

use std::fs;
use std::path::Path;
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::Config;
use supple_ipc::message::Telemetry;
use supple_log::{CycleTiming, Extras, RunInfo, Writer};
use supple_model::Description;
use supple_plant::PlantOptions;

/// The log of a run, if any, and the reason if it ended before the run.
pub struct RunLog<const N: usize> {
    recorder: Option<Recorder<N>>,
    ended: Option<Failure>,
}

impl<const N: usize> RunLog<N> {
    /// Creates the log of a run, which may have none.
    pub fn new(recorder: Option<Recorder<N>>) -> Self {
        RunLog {
            recorder,
            ended: None,
        }
    }

    /// Adds a cycle.
    pub fn add(&mut self, telemetry: &Telemetry) {
        self.write(|recorder| recorder.add(telemetry));
    }

    /// Adds an event of the arm, with a time of the clock of its states.
    pub fn event(&mut self, stamp_ns: u64, text: &str) {
        self.write(|recorder| recorder.event(stamp_ns, text));
    }

    /// Completes the log, or reports the reason why it is incomplete.
    pub fn finish(&mut self) {
        let finished = self.recorder.take().map_or(Ok(()), Recorder::finish);
        self.end_with(finished);
    }

    /// Ends the log without its final name.
    pub fn leave_part(&mut self) {
        self.recorder = None;
    }

    /// Returns the reason why the log ended before the run.
    pub fn ended(&mut self) -> Option<Failure> {
        self.ended.take()
    }

    fn write(&mut self, write: impl FnOnce(&mut Recorder<N>) -> Result<(), Failure>) {
        if let Some(recorder) = &mut self.recorder {
            let written = write(recorder);
            self.end_with(written);
        }
    }

    fn end_with(&mut self, written: Result<(), Failure>) {
        if let Err(failure) = written {
            print_status(&format!(
                "warning: the log ends here, the run continues: {failure}"
            ));
            self.recorder = None;
            self.ended = Some(failure);
        }
    }
}

/// Writer of a log, which adds one record per cycle.
pub struct Recorder<const N: usize> {
    writer: Writer<N>,
    /// Offset from the stamps of the states to the time of the log \[ns\].
    offset_ns: u64,
    virtual_time: bool,
    /// Latest written time \[ns\]; the times of a log do not decrease.
    latest_ns: u64,
}

impl<const N: usize> Recorder<N> {
    /// Creates a log of an arm with these plant options. In virtual time, equal runs give equal logs, without wall-clock times.
    ///
    /// # Errors
    /// [`Failure::File`], [`Failure::Log`].
    pub fn create(
        file: &Path,
        description: &Description,
        config: &Config<N>,
        virtual_time: bool,
        plant: &PlantOptions,
    ) -> Result<Self, Failure> {
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder).map_err(|error| Failure::file("create", folder, error))?;
        }
        let (start_ns, offset_ns) = match virtual_time {
            true => (0, 0),
            false => {
                let now_ns = supple_realtime::since_epoch_ns();
                (
                    now_ns,
                    now_ns.saturating_sub(supple_realtime::monotonic_ns()),
                )
            }
        };
        let run = RunInfo {
            experiment: "supple up".to_owned(),
            start_ns,
            notes: plant.notes(),
            ..RunInfo::default()
        };
        Ok(Recorder {
            writer: Writer::create(file, description, config, &run)?,
            offset_ns,
            virtual_time,
            latest_ns: start_ns,
        })
    }

    /// Adds a cycle.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn add(&mut self, telemetry: &Telemetry) -> Result<(), Failure> {
        let time_ns = telemetry.state.stamp_ns.saturating_add(self.offset_ns);
        self.latest_ns = self.latest_ns.max(time_ns);
        let timing = &telemetry.timing;
        let extras = Extras {
            timing: (!self.virtual_time).then_some(CycleTiming {
                period_ns: timing.period_ns,
                latency_ns: timing.latency_ns,
                step_ns: timing.step_ns,
            }),
            ..Extras::default()
        };
        let record = telemetry.record_of::<N>();
        Ok(self.writer.write_record(self.latest_ns, &record, &extras)?)
    }

    /// Adds an event of the arm, with a time of the clock of its states.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn event(&mut self, stamp_ns: u64, text: &str) -> Result<(), Failure> {
        Ok(self
            .writer
            .event(stamp_ns.saturating_add(self.offset_ns), text)?)
    }

    /// Completes the log.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn finish(self) -> Result<(), Failure> {
        self.writer.finish()?;
        Ok(())
    }
}
