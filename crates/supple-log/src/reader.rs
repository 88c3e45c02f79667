//! Reads a log: metadata, arm, configuration and messages.

use crate::cdr;
use crate::config;
use crate::error::LogError;
use crate::messages::{CycleTiming, OwnedHeader, PlantTruth};
use crate::record::{CONTROLLER_STATE, ChannelDecoder, PresentWords};
use crate::scan::{Channel, LogItem, LogScanner};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use supple_core::Config;
use supple_core::controller::CycleRecord;
use supple_model::Description;

/// Metadata of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct LogMetadata {
    /// Name and version of the software that wrote the log.
    pub software: String,
    /// Name of the arm.
    pub arm: String,
    /// Names of the moving joints, from the base to the tip.
    pub joints: Vec<String>,
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of all random numbers of the run.
    pub seed: Option<u64>,
    /// Start time \[ns\]: since the epoch, or 0 in virtual time.
    pub start_ns: u64,
    /// Further notes, by name.
    pub notes: BTreeMap<String, String>,
}

/// A reader of a log. Opening a log reads its metadata and the arm; the iterators read the steps one by one.
#[derive(Clone, Debug)]
pub struct Reader {
    path: PathBuf,
    metadata: LogMetadata,
    attachments: BTreeMap<String, Vec<u8>>,
}

/// A message and its time \[ns\].
#[derive(Clone, Debug, PartialEq)]
pub struct TimedMessage<T> {
    /// Time of the measurement \[ns\].
    pub time_ns: u64,
    /// The message.
    pub value: T,
}

impl Reader {
    /// Opens a log.
    ///
    /// # Errors
    /// [`LogError::Read`]; [`LogError::Format`] if the file is not a log of this crate; [`LogError::Incomplete`]
    /// if it ends before its first step.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let path = path.to_owned();
        let mut scanner = LogScanner::open(&path)?;
        let mut metadata = None;
        let mut notes = BTreeMap::new();
        let mut attachments = BTreeMap::new();
        loop {
            match scanner.next()? {
                Some(LogItem::Metadata(record)) if record.name == "supple" => {
                    metadata = Some(record.metadata);
                }
                Some(LogItem::Metadata(record)) if record.name == "notes" => {
                    notes = record.metadata;
                }
                Some(LogItem::Metadata(_)) => {}
                Some(LogItem::Attachment(header, data)) => {
                    attachments.insert(header.name, data);
                }
                Some(LogItem::Chunk | LogItem::Message(..)) | None => break,
            }
        }
        let metadata = metadata
            .ok_or("no metadata named \"supple\"")
            .map_err(|message| format(&path, message))?;
        let metadata =
            LogMetadata::read(metadata, notes).map_err(|message| format(&path, &message))?;
        Ok(Reader {
            path,
            metadata,
            attachments,
        })
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the metadata of the log.
    pub fn metadata(&self) -> &LogMetadata {
        &self.metadata
    }

    /// Files inside, by name: `arm.urdf`, `arm.toml`, `controller.toml`.
    pub fn attachments(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.attachments
    }

    /// Returns the arm, from the URDF and the TOML inside.
    ///
    /// # Errors
    /// [`LogError::Format`] if one is missing, [`LogError::Model`] if one is invalid.
    pub fn description(&self) -> Result<Description, LogError> {
        let (toml, urdf) = (self.text("arm.toml")?, self.text("arm.urdf")?);
        Ok(Description::from_text(toml, urdf)?)
    }

    /// Returns the configuration that was in force, bit for bit.
    ///
    /// # Errors
    /// [`LogError::JointCount`]; [`LogError::Format`] if it is missing or invalid.
    pub fn config<const N: usize>(&self) -> Result<Config<N>, LogError> {
        self.expect_joints(N)?;
        let config = config::from_toml(self.text("controller.toml")?);
        config.map_err(|message| format(&self.path, &format!("controller.toml: {message}")))
    }

    /// Iterates over all steps in order. In a truncated file the iterator returns the complete steps and then one
    /// [`LogError::Incomplete`].
    ///
    /// # Errors
    /// [`LogError::JointCount`]; [`LogError::Read`].
    pub fn records<const N: usize>(&self) -> Result<Messages<CycleRecord<N>>, LogError> {
        self.expect_joints(N)?;
        let mut decoder = ChannelDecoder::default();
        Messages::open(&self.path, CONTROLLER_STATE, move |channel, data| {
            decoder.decode(channel, data)
        })
    }

    /// Returns which words of a record the definition of the first channel of records contains; `None` without records.
    pub(crate) fn present(&self) -> Result<Option<PresentWords>, LogError> {
        let mut scanner = LogScanner::open(&self.path)?;
        while let Some(item) = scanner.next()? {
            if let LogItem::Message(channel, ..) = item
                && channel.topic == CONTROLLER_STATE
            {
                let present = ChannelDecoder::present(&channel, self.metadata.joints.len());
                return present
                    .map(Some)
                    .map_err(|message| format(&self.path, &message));
            }
        }
        Ok(None)
    }

    /// Iterates over the timing of all cycles that were timed, as [`Reader::records`].
    ///
    /// # Errors
    /// [`LogError::Read`].
    pub fn timings(&self) -> Result<Messages<CycleTiming>, LogError> {
        Messages::open(&self.path, "/cycle_timing", |_, data| {
            let (_, _, timing): (OwnedHeader, u64, CycleTiming) = cdr::decode(data)?;
            Ok(timing)
        })
    }

    /// Iterates over the true states of a simulated plant, as [`Reader::records`].
    ///
    /// # Errors
    /// [`LogError::JointCount`]; [`LogError::Read`].
    pub fn plant_truths<const N: usize>(&self) -> Result<Messages<PlantTruth<N>>, LogError> {
        self.messages::<N, _>("/plant_truth", without_header)
    }

    fn messages<const N: usize, T: 'static>(
        &self,
        topic: &'static str,
        decode: fn(&[u8]) -> Result<T, String>,
    ) -> Result<Messages<T>, LogError> {
        self.expect_joints(N)?;
        Messages::open(&self.path, topic, move |_, data| decode(data))
    }

    fn expect_joints(&self, expected: usize) -> Result<(), LogError> {
        let found = self.metadata.joints.len();
        if expected == found {
            return Ok(());
        }
        Err(LogError::JointCount {
            file: self.path.display().to_string(),
            expected,
            found,
        })
    }

    fn text(&self, name: &str) -> Result<&str, LogError> {
        let data = self.attachments.get(name);
        let data = data.ok_or_else(|| format(&self.path, &format!("no attachment {name}")))?;
        let text = std::str::from_utf8(data);
        text.map_err(|error| format(&self.path, &format!("attachment {name}: {error}")))
    }
}

impl LogMetadata {
    fn read(
        mut map: BTreeMap<String, String>,
        notes: BTreeMap<String, String>,
    ) -> Result<LogMetadata, String> {
        let seed = map.remove("seed");
        let mut entry = |key: &str| {
            map.remove(key)
                .ok_or_else(|| format!("metadata \"supple\" has no entry {key}"))
        };
        let number = |text: String| {
            let number = text.parse::<u64>();
            number.map_err(|_| format!("metadata \"supple\": {text:?} is not a whole number"))
        };
        Ok(LogMetadata {
            software: entry("software")?,
            arm: entry("arm")?,
            joints: entry("joints")?.split(' ').map(str::to_owned).collect(),
            experiment: entry("experiment")?,
            seed: seed.map(number).transpose()?,
            start_ns: number(entry("start_ns")?)?,
            notes,
        })
    }
}

/// Decodes the bytes of a message of a channel to a value.
type Decode<T> = Box<dyn FnMut(&Channel, &[u8]) -> Result<T, String>>;

/// Messages of one channel, in order.
pub struct Messages<T> {
    scanner: LogScanner,
    topic: &'static str,
    decode: Decode<T>,
    ended: bool,
    value: PhantomData<T>,
}

impl<T> Messages<T> {
    fn open(
        path: &Path,
        topic: &'static str,
        decode: impl FnMut(&Channel, &[u8]) -> Result<T, String> + 'static,
    ) -> Result<Self, LogError> {
        Ok(Messages {
            scanner: LogScanner::open(path)?,
            topic,
            decode: Box::new(decode),
            ended: false,
            value: PhantomData,
        })
    }

    fn advance(&mut self) -> Result<Option<TimedMessage<T>>, LogError> {
        while let Some(item) = self.scanner.next()? {
            let LogItem::Message(channel, header, data) = item else {
                continue;
            };
            if channel.topic != self.topic {
                continue;
            }
            let value = (self.decode)(&channel, &data).map_err(|message| LogError::Format {
                file: self.scanner.file().to_owned(),
                message: format!("{} at {} ns: {message}", self.topic, header.log_time),
            })?;
            let time_ns = header.log_time;
            return Ok(Some(TimedMessage { time_ns, value }));
        }
        Ok(None)
    }
}

impl<T> Iterator for Messages<T> {
    type Item = Result<TimedMessage<T>, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let next = self.advance();
        self.ended = !matches!(next, Ok(Some(_)));
        next.transpose()
    }
}

fn without_header<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    let (_, value): (OwnedHeader, T) = cdr::decode(data)?;
    Ok(value)
}

fn format(path: &Path, message: &str) -> LogError {
    LogError::Format {
        file: path.display().to_string(),
        message: message.to_owned(),
    }
}
