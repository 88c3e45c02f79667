//! Writing a log, a step at a time.

use crate::cdr;
use crate::emit::{Extras, Put, TF_EVERY, Topic, base_frame, emit};
use crate::error::LogError;
use crate::file::{LogFile, SOFTWARE, Written};
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
    /// Seed of everything random in it.
    pub seed: Option<u64>,
    /// When it began \[ns\]: since the epoch, or 0 in virtual time.
    pub start_ns: u64,
    /// Whatever else belongs to it, by name.
    pub notes: BTreeMap<String, String>,
}

/// Writes a log. Dropped without [`Writer::finish`] it leaves `<name>.part`, never a file of the name.
///
/// A write allocates nothing once buffers have grown, except on `/tf` and where a request, a fault or a
/// refusal is there; it may wait for the disk.
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
    /// [`LogError::Create`], [`LogError::Busy`] or [`LogError::Write`]; [`LogError::Model`] where the
    /// description has not `N` joints.
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
        file.metadata("supple", about(description, run))?;
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

    /// One step. `time_ns` is the time of the measurement: since the epoch, or since the start in
    /// virtual time.
    ///
    /// # Errors
    /// [`LogError::Write`]; everything after it fails too.
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

    /// One step that is a record already, such as another process has sent; `extras.step` is not used.
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

    /// What happened to the arm besides, such as a button of its pendant, with its time as in
    /// [`Writer::write`]. It may be written late: the file has it at this place, with its own time.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn event(&mut self, time_ns: u64, text: &str) -> Result<(), LogError> {
        self.channels.file.close_chunk_if_due(time_ns)?;
        self.events += 1;
        let number = self.events - 1;
        self.channels.put(Topic::ArmEvents, number, time_ns, &text)
    }

    /// Writes the index, waits for the disk and gives the file its name; an older file of that name is
    /// replaced.
    ///
    /// # Errors
    /// [`LogError::Write`]; the file then keeps its `.part`.
    pub fn finish(self) -> Result<Written, LogError> {
        self.channels.file.finish()
    }
}

struct Channels {
    file: LogFile,
    ids: [Option<u16>; Topic::COUNT],
    dof: usize,
    buffer: Vec<u8>,
    /// Words of a record, while it is written.
    words: Vec<u64>,
}

impl Put for Channels {
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

fn about(description: &Description, run: &RunInfo) -> BTreeMap<String, String> {
    let mut about = BTreeMap::from([
        ("software".to_owned(), SOFTWARE.to_owned()),
        ("arm".to_owned(), description.name().to_owned()),
        ("joints".to_owned(), description.joint_names().join(" ")),
        ("experiment".to_owned(), run.experiment.clone()),
        ("start_ns".to_owned(), run.start_ns.to_string()),
    ]);
    if let Some(seed) = run.seed {
        about.insert("seed".to_owned(), seed.to_string());
    }
    about
}
