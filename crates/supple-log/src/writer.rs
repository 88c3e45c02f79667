//! Writes a log, step by step.

use crate::cdr;
use crate::emit::{Extras, MessageSink, TF_EVERY, Topic, base_frame, emit};
use crate::error::LogError;
use crate::file::{LogFile, LogSummary, SOFTWARE};
use mcap::records::MessageHeader;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use supple_core::config::JointNames;
use supple_core::controller::CycleRecord;
use supple_core::{Config, Input, Output};
use supple_model::Description;

/// Metadata of a run besides the arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunInfo {
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of all random numbers of the run.
    pub seed: Option<u64>,
    /// Start time \[ns\]: since the epoch, or 0 in virtual time.
    pub start_ns: u64,
    /// Further notes, by name.
    pub notes: BTreeMap<String, String>,
}

/// Writer of a log. If it is dropped without [`Writer::finish`], only `<name>.part` exists, never a file with the final name.
///
/// Once its buffers have grown, a write allocates only for messages on `/tf` and for steps with a request, a fault or a
/// refusal; it may wait for the disk.
pub struct Writer<const N: usize> {
    channels: Channels,
    description: Description,
    base: String,
    joint_names: JointNames<N>,
    next_step: u64,
    written: u64,
    events: u64,
}

impl<const N: usize> Writer<N> {
    /// Begins the log `path`, written as `<path>.part` until it is finished.
    ///
    /// `config` is the configuration in force, which may differ from that of `description`.
    ///
    /// # Errors
    /// [`LogError::Create`], [`LogError::Busy`] or [`LogError::Write`]; [`LogError::Model`] if the
    /// description does not have `N` joints.
    pub fn create(
        path: &Path,
        description: &Description,
        config: &Config<N>,
        run: &RunInfo,
    ) -> Result<Self, LogError> {
        let home = description.home::<N>()?;
        let base = base_frame(description, home.as_slice())?;
        let mut file = LogFile::create(path, ".part")?;
        let controller =
            crate::config::to_toml(config).map_err(|error| file.unwritable(error.to_string()))?;
        file.metadata("supple", run_metadata(description, run))?;
        if !run.notes.is_empty() {
            file.metadata("notes", run.notes.clone())?;
        }
        let start_ns = run.start_ns;
        let mut attach =
            |name, media_type, text: &str| file.attach(name, media_type, start_ns, text.as_bytes());
        attach("arm.urdf", "application/xml", description.urdf())?;
        attach("arm.toml", "application/toml", description.toml())?;
        attach("controller.toml", "application/toml", &controller)?;
        let mut channels = Channels {
            file,
            ids: [None; Topic::COUNT],
            dof: N,
            buffer: Vec::new(),
            words: Vec::new(),
        };
        channels.put(Topic::RobotDescription, 0, start_ns, &description.urdf())?;
        Ok(Writer {
            channels,
            description: description.clone(),
            base,
            joint_names: config.joint_names,
            next_step: 0,
            written: 0,
            events: 0,
        })
    }

    /// Writes one step. `time_ns` is the time of the measurement: since the epoch, or since the start in
    /// virtual time.
    ///
    /// # Errors
    /// [`LogError::Write`]; all later writes then fail too.
    pub fn write(
        &mut self,
        time_ns: u64,
        input: &Input<N>,
        output: &Output<N>,
        extras: &Extras<N>,
    ) -> Result<(), LogError> {
        let step = extras.step.unwrap_or(self.next_step);
        let record =
            CycleRecord::new(step, input, output).with_joint_names(output, &self.joint_names);
        self.write_record(time_ns, &record, extras)
    }

    /// Writes one step from its record, for example a record that another process has sent; `extras.step` is not used.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn write_record(
        &mut self,
        time_ns: u64,
        record: &CycleRecord<N>,
        extras: &Extras<N>,
    ) -> Result<(), LogError> {
        let step = record.step;
        self.next_step = step.saturating_add(1);
        self.channels.file.close_chunk_if_due(time_ns)?;
        let with_tf = self.written.is_multiple_of(TF_EVERY);
        let arm = (&self.description, self.base.as_str());
        emit(&mut self.channels, arm, time_ns, record, extras, with_tf)?;
        self.written += 1;
        Ok(())
    }

    /// Writes another event of the arm, such as a button of its pendant, with its time as in
    /// [`Writer::write`]. An event may be written late: it keeps its own time.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn event(&mut self, time_ns: u64, text: &str) -> Result<(), LogError> {
        self.channels.file.close_chunk_if_due(time_ns)?;
        self.events += 1;
        let number = self.events - 1;
        self.channels.put(Topic::ArmEvents, number, time_ns, &text)
    }

    /// Writes the index, syncs the file to disk and renames it to its final name; this replaces an older file of that
    /// name.
    ///
    /// # Errors
    /// [`LogError::Write`]; the file then keeps the suffix `.part`.
    pub fn finish(self) -> Result<LogSummary, LogError> {
        self.channels.file.finish()
    }
}

struct Channels {
    file: LogFile,
    ids: [Option<u16>; Topic::COUNT],
    dof: usize,
    buffer: Vec<u8>,
    /// Buffer for the words of a record.
    words: Vec<u64>,
}

impl MessageSink for Channels {
    fn words(&mut self) -> &mut Vec<u64> {
        &mut self.words
    }

    fn put<T: Serialize>(
        &mut self,
        channel: Topic,
        step: u64,
        time_ns: u64,
        value: &T,
    ) -> Result<(), LogError> {
        let channel_id = match self.ids[channel as usize] {
            Some(id) => id,
            None => self.open(channel)?,
        };
        cdr::encode(value, &mut self.buffer).map_err(|error| self.file.unwritable(error))?;
        let header = MessageHeader {
            channel_id,
            sequence: step as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.file.message(&header, &self.buffer)
    }
}

impl Channels {
    fn open(&mut self, channel: Topic) -> Result<u16, LogError> {
        let opened = channel.channel(self.dof);
        let opened = opened.map_err(|message| self.file.unwritable(message))?;
        let id = self.file.channel(&opened)?;
        self.ids[channel as usize] = Some(id);
        Ok(id)
    }
}

fn run_metadata(description: &Description, run: &RunInfo) -> BTreeMap<String, String> {
    let mut metadata = BTreeMap::from([
        ("software".to_owned(), SOFTWARE.to_owned()),
        ("arm".to_owned(), description.name().to_owned()),
        ("joints".to_owned(), description.joint_names().join(" ")),
        ("experiment".to_owned(), run.experiment.clone()),
        ("start_ns".to_owned(), run.start_ns.to_string()),
    ]);
    if let Some(seed) = run.seed {
        metadata.insert("seed".to_owned(), seed.to_string());
    }
    metadata
}
