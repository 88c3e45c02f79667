//! Telemetry into a log, for as long as it can be written: a full disk ends the log, not the arm.

use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::Config;
use supple_ipc::message::Telemetry;
use supple_log::{CycleTiming, Extras, RunInfo, Writer};
use supple_model::Description;
use supple_plant::PlantOptions;

/// The log of a run, if there is one, and why it ended before the run, if it did.
pub struct RunLog<const N: usize> {
    recorder: Option<Recorder<N>>,
    ended: Option<Failure>,
}

impl<const N: usize> RunLog<N> {
    /// Of a run with a log or without.
    pub fn new(recorder: Option<Recorder<N>>) -> Self {
        RunLog {
            recorder,
            ended: None,
        }
    }

    /// A cycle.
    pub fn add(&mut self, telemetry: &Telemetry) {
        self.write(|recorder| recorder.add(telemetry));
    }

    /// Something that happened to the arm, by the clock of its states.
    pub fn event(&mut self, stamp_ns: u64, text: &str) {
        self.write(|recorder| recorder.event(stamp_ns, text));
    }

    /// The log is whole, or the reason is reported.
    pub fn finish(&mut self) {
        let finished = self.recorder.take().map_or(Ok(()), Recorder::finish);
        self.end_with(finished);
    }

    /// Why it ended before the run.
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
                "warning: the log ends here, the arm goes on: {failure}"
            ));
            self.recorder = None;
            self.ended = Some(failure);
        }
    }
}

/// A log that grows by a record a cycle.
pub struct Recorder<const N: usize> {
    writer: Writer<N>,
    /// From the stamps of the states to the time of the log \[ns\].
    offset_ns: u64,
    virtual_time: bool,
    /// Latest time written \[ns\]: a log does not go back.
    latest_ns: u64,
}

impl<const N: usize> Recorder<N> {
    /// Begins a log of an arm with these plant options. In virtual time it is the same for the same run: no clock, no timing.
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
                let now_ns = since_epoch_ns();
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

    /// A cycle.
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

    /// Something that happened to the arm, by the clock of its states.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn event(&mut self, stamp_ns: u64, text: &str) -> Result<(), Failure> {
        Ok(self
            .writer
            .event(stamp_ns.saturating_add(self.offset_ns), text)?)
    }

    /// The log is whole.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn finish(self) -> Result<(), Failure> {
        self.writer.finish()?;
        Ok(())
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "a log of the wall clock has the time of its start; in virtual time this is not called"
)]
fn since_epoch_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    })
}
