//! Reading a log back as what was written.

use crate::cdr;
use crate::config;
use crate::error::LogError;
use crate::messages::{CycleTiming, OwnedHeader, PlantTruth};
use crate::record::{CONTROLLER_STATE, ChannelDecoder, Present};
use crate::scan::{Channel, Item, Scan};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use supple_core::Config;
use supple_core::controller::CycleRecord;
use supple_model::Description;

/// Metadata of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct About {
    /// Name and version of the software that wrote it.
    pub software: String,
    /// Name of the arm.
    pub arm: String,
    /// Names of the moving joints, from the base to the tip.
    pub joints: Vec<String>,
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of everything random in it.
    pub seed: Option<u64>,
    /// When it began \[ns\]: since the epoch, or 0 in virtual time.
    pub start_ns: u64,
    /// Whatever else belongs to it, by name.
    pub notes: BTreeMap<String, String>,
}

/// A log to read. Opening it reads its metadata and the arm; the steps are read as they
/// are asked for.
#[derive(Clone, Debug)]
pub struct Reader {
    path: PathBuf,
    about: About,
    attachments: BTreeMap<String, Vec<u8>>,
}

/// A message and its time \[ns\].
#[derive(Clone, Debug, PartialEq)]
pub struct Timed<T> {
    /// Time of the measurement \[ns\].
    pub time_ns: u64,
    /// The message.
    pub value: T,
}

impl Reader {
    /// # Errors
    /// [`LogError::Read`]; [`LogError::Format`] where it is no log of ours; [`LogError::Incomplete`]
    /// where it stops before its first step.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let path = path.to_owned();
        let mut scan = Scan::open(&path)?;
        let mut about = None;
        let mut notes = BTreeMap::new();
        let mut attachments = BTreeMap::new();
        loop {
            match scan.next()? {
                Some(Item::Metadata(metadata)) if metadata.name == "supple" => {
                    about = Some(metadata.metadata);
                }
                Some(Item::Metadata(metadata)) if metadata.name == "notes" => {
                    notes = metadata.metadata;
                }
                Some(Item::Metadata(_)) => {}
                Some(Item::Attachment(header, data)) => {
                    attachments.insert(header.name, data);
                }
                Some(Item::Chunk | Item::Message(..)) | None => break,
            }
        }
        let about = about
            .ok_or("no metadata named \"supple\"")
            .map_err(|message| format(&path, message))?;
        let about = About::read(about, notes).map_err(|message| format(&path, &message))?;
        Ok(Reader {
            path,
            about,
            attachments,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its metadata.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Files inside, by name: `arm.urdf`, `arm.toml`, `controller.toml`.
    pub fn attachments(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.attachments
    }

    /// The arm, from the URDF and the TOML inside.
    ///
    /// # Errors
    /// [`LogError::Format`] if one is missing, [`LogError::Model`] if one is invalid.
    pub fn description(&self) -> Result<Description, LogError> {
        let (toml, urdf) = (self.text("arm.toml")?, self.text("arm.urdf")?);
        Ok(Description::from_text(toml, urdf)?)
    }

    /// The configuration that was in force, to the last bit.
    ///
    /// # Errors
    /// [`LogError::JointCount`]; [`LogError::Format`] if it is missing or invalid.
    pub fn config<const N: usize>(&self) -> Result<Config<N>, LogError> {
        self.expect_joints(N)?;
        let config = config::from_toml(self.text("controller.toml")?);
        config.map_err(|message| format(&self.path, &format!("controller.toml: {message}")))
    }

    /// Every step, in order. In a file that is cut, the steps that are whole and then one
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

    /// The words of a record that the log's definition has, of the first channel of records; `None` without records.
    pub(crate) fn present(&self) -> Result<Option<Present>, LogError> {
        let mut scan = Scan::open(&self.path)?;
        while let Some(item) = scan.next()? {
            if let Item::Message(channel, ..) = item
                && channel.topic == CONTROLLER_STATE
            {
                let present = ChannelDecoder::present(&channel, self.about.joints.len());
                return present
                    .map(Some)
                    .map_err(|message| format(&self.path, &message));
            }
        }
        Ok(None)
    }

    /// Timing of the cycles that were timed, as [`Reader::records`].
    ///
    /// # Errors
    /// [`LogError::Read`].
    pub fn timings(&self) -> Result<Messages<CycleTiming>, LogError> {
        Messages::open(&self.path, "/cycle_timing", |_, data| {
            let (_, _, timing): (OwnedHeader, u64, CycleTiming) = cdr::decode(data)?;
            Ok(timing)
        })
    }

    /// What was really so in a simulated plant, as [`Reader::records`].
    ///
    /// # Errors
    /// [`LogError::JointCount`]; [`LogError::Read`].
    pub fn truths<const N: usize>(&self) -> Result<Messages<PlantTruth<N>>, LogError> {
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
        let found = self.about.joints.len();
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

impl About {
    fn read(
        mut map: BTreeMap<String, String>,
        notes: BTreeMap<String, String>,
    ) -> Result<About, String> {
        let seed = map.remove("seed");
        let mut entry = |key: &str| {
            map.remove(key)
                .ok_or_else(|| format!("metadata \"supple\" has no entry {key}"))
        };
        let number = |text: String| {
            let number = text.parse::<u64>();
            number.map_err(|_| format!("metadata \"supple\": {text:?} is not a whole number"))
        };
        Ok(About {
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

/// From the bytes of a message of a channel to its value.
type Decode<T> = Box<dyn FnMut(&Channel, &[u8]) -> Result<T, String>>;

/// Messages of one channel, in order.
pub struct Messages<T> {
    scan: Scan,
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
            scan: Scan::open(path)?,
            topic,
            decode: Box::new(decode),
            ended: false,
            value: PhantomData,
        })
    }

    fn advance(&mut self) -> Result<Option<Timed<T>>, LogError> {
        while let Some(item) = self.scan.next()? {
            let Item::Message(channel, header, data) = item else {
                continue;
            };
            if channel.topic != self.topic {
                continue;
            }
            let value = (self.decode)(&channel, &data).map_err(|message| LogError::Format {
                file: self.scan.file().to_owned(),
                message: format!("{} at {} ns: {message}", self.topic, header.log_time),
            })?;
            let time_ns = header.log_time;
            return Ok(Some(Timed { time_ns, value }));
        }
        Ok(None)
    }
}

impl<T> Iterator for Messages<T> {
    type Item = Result<Timed<T>, LogError>;

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
