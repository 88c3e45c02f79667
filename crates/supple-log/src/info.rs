//! Overview of the content of a log.

use crate::error::LogError;
use crate::reader::{LogMetadata, Reader};
use crate::record::{CONTROLLER_STATE, ChannelDecoder};
use crate::scan::{Channel, LogItem, LogScanner};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use supple_core::controller::Mode;
use supple_model::with_dof;

/// Overview of the content of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// File.
    pub file: PathBuf,
    /// Length of the file.
    pub bytes: u64,
    /// Reason for which the file is not complete; `None` if it is complete.
    pub incomplete: Option<String>,
    /// Metadata of the log.
    pub about: LogMetadata,
    /// Times of the first and the last message \[ns\]; `None` without messages.
    pub span_ns: Option<(u64, u64)>,
    /// Number of chunks.
    pub chunks: u64,
    /// Channels, in the order in which they appear.
    pub channels: Vec<ChannelInfo>,
    /// Files inside.
    pub attachments: Vec<AttachmentInfo>,
    /// Number of controller steps missing in the log; a log with missing steps cannot be replayed.
    pub missing_steps: u64,
    /// Number of steps in the log.
    pub steps: u64,
    /// Changes of mode, the first one included.
    pub modes: Vec<ModeChange>,
    /// Faults, with the times at which they were latched.
    pub faults: Vec<FaultInfo>,
    /// For a log recovered from an incomplete file: length of that file, and of its complete part.
    pub recovered: Option<(u64, u64)>,
}

/// A channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChannelInfo {
    /// Name.
    pub topic: String,
    /// Type of its messages.
    pub schema: String,
    /// Number of messages.
    pub messages: u64,
}

/// A file attached to the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// Name.
    pub name: String,
    /// Length of the file.
    pub bytes: u64,
}

/// A change of mode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ModeChange {
    /// Time \[ns\].
    pub time_ns: u64,
    /// Name of the new mode.
    pub mode: String,
}

/// A fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FaultInfo {
    /// Time \[ns\].
    pub time_ns: u64,
    /// Message of the fault.
    pub fault: String,
}

/// Reads a whole log and returns an overview; of a truncated file, an overview of its complete part.
///
/// # Errors
/// [`LogError::Read`]; [`LogError::Format`] if the file is not a log of this crate; [`LogError::Incomplete`] if
/// the file ends before its first step.
pub fn info(path: &Path) -> Result<Info, LogError> {
    let about = Reader::open(path)?.metadata().clone();
    let metadata = std::fs::metadata(path).map_err(|source| LogError::Read {
        file: path.display().to_string(),
        source,
    })?;
    let mut builder = InfoBuilder {
        decode: with_dof!(about.joints.len(), N => summary::<N> as StepSummaryDecoder)?,
        decoder: ChannelDecoder::default(),
        last: None,
        channels: BTreeMap::new(),
        info: Info {
            file: path.to_owned(),
            bytes: metadata.len(),
            incomplete: None,
            about,
            span_ns: None,
            chunks: 0,
            channels: Vec::new(),
            attachments: Vec::new(),
            missing_steps: 0,
            steps: 0,
            modes: Vec::new(),
            faults: Vec::new(),
            recovered: None,
        },
    };
    match builder.items(&mut LogScanner::open(path)?) {
        Ok(()) => {}
        Err(LogError::Incomplete { cause, .. }) => builder.info.incomplete = Some(cause),
        Err(error) => return Err(error),
    }
    Ok(builder.info)
}

/// Fields of a step that an overview needs.
#[derive(Clone, Copy, PartialEq)]
struct StepSummary {
    step: u64,
    mode: &'static str,
    fault: u8,
}

/// Decodes a message to a summary and the message of the fault.
type StepSummaryDecoder =
    fn(&mut ChannelDecoder, &Channel, &[u8]) -> Result<(StepSummary, String), String>;

fn summary<const N: usize>(
    decoder: &mut ChannelDecoder,
    channel: &Channel,
    data: &[u8],
) -> Result<(StepSummary, String), String> {
    let record = decoder.decode::<N>(channel, data)?;
    let summary = StepSummary {
        step: record.step,
        mode: record.mode().map_or("unknown", Mode::name),
        fault: record.fault,
    };
    Ok((summary, record.fault_text.to_string()))
}

struct InfoBuilder {
    decode: StepSummaryDecoder,
    decoder: ChannelDecoder,
    last: Option<StepSummary>,
    /// Index in the list of channels, by name.
    channels: BTreeMap<String, usize>,
    info: Info,
}

impl InfoBuilder {
    fn items(&mut self, scanner: &mut LogScanner) -> Result<(), LogError> {
        while let Some(item) = scanner.next()? {
            match item {
                LogItem::Metadata(metadata) if metadata.name == "recovery" => {
                    let number = |key| metadata.metadata.get(key)?.parse().ok();
                    self.info.recovered = number("source_bytes").zip(number("kept_bytes"));
                }
                LogItem::Metadata(_) => {}
                LogItem::Attachment(header, data) => self.info.attachments.push(AttachmentInfo {
                    name: header.name,
                    bytes: data.len() as u64,
                }),
                LogItem::Chunk => self.info.chunks += 1,
                LogItem::Message(channel, header, data) => {
                    let time_ns = header.log_time;
                    let (first, last) = self.info.span_ns.unwrap_or((time_ns, time_ns));
                    self.info.span_ns = Some((first.min(time_ns), last.max(time_ns)));
                    self.count(&channel);
                    if channel.topic == CONTROLLER_STATE {
                        let decoded = (self.decode)(&mut self.decoder, &channel, &data);
                        let seen = decoded.map_err(|message| LogError::Format {
                            file: scanner.file().to_owned(),
                            message: format!("{CONTROLLER_STATE} at {time_ns} ns: {message}"),
                        })?;
                        self.step(time_ns, seen);
                    }
                }
            }
        }
        Ok(())
    }

    fn count(&mut self, channel: &Channel) {
        let list = &mut self.info.channels;
        let place = match self.channels.get(&channel.topic) {
            Some(place) => *place,
            None => {
                self.channels.insert(channel.topic.clone(), list.len());
                list.push(ChannelInfo {
                    topic: channel.topic.clone(),
                    schema: channel.schema.name.clone(),
                    messages: 0,
                });
                list.len() - 1
            }
        };
        list[place].messages += 1;
    }

    fn step(&mut self, time_ns: u64, (now, fault_text): (StepSummary, String)) {
        let info = &mut self.info;
        info.steps += 1;
        let expected = self.last.map_or(0, |last| last.step.saturating_add(1));
        let missing = now.step.saturating_sub(expected);
        info.missing_steps = info.missing_steps.saturating_add(missing);
        if self.last.is_none_or(|last| last.mode != now.mode) {
            let mode = now.mode.to_owned();
            info.modes.push(ModeChange { time_ns, mode });
        }
        if now.fault != 0 && self.last.is_none_or(|last| last.fault != now.fault) {
            let fault = fault_text;
            info.faults.push(FaultInfo { time_ns, fault });
        }
        self.last = Some(now);
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let about = &self.about;
        let (first_ns, last_ns) = self.span_ns.unwrap_or_default();
        let seconds = |time_ns: u64| time_ns.saturating_sub(first_ns) as f64 * 1e-9;
        writeln!(f, "{}", self.file.display())?;
        writeln!(
            f,
            "  arm         {} ({})",
            about.arm,
            about.joints.join(", ")
        )?;
        write!(f, "  experiment  {}", about.experiment)?;
        match about.seed {
            Some(seed) => writeln!(f, ", seed {seed}")?,
            None => writeln!(f)?,
        }
        for (name, note) in &about.notes {
            writeln!(f, "  note        {name} = {note}")?;
        }
        writeln!(f, "  written by  {}", about.software)?;
        writeln!(
            f,
            "  starts at   {first_ns} ns, lasts {:.3} s",
            seconds(last_ns)
        )?;
        writeln!(
            f,
            "  size        {} bytes in {} chunks",
            self.bytes, self.chunks
        )?;
        match &self.incomplete {
            None => writeln!(f, "  complete    yes")?,
            Some(cause) => writeln!(f, "  complete    no: {cause}; see `supple log recover`")?,
        }
        if let Some((source_bytes, kept_bytes)) = self.recovered {
            writeln!(f, "  recovered   {kept_bytes} of {source_bytes} bytes")?;
        }
        let missing = match self.missing_steps {
            0 => "none missing".to_owned(),
            missing => format!("{missing} missing: it cannot be replayed"),
        };
        writeln!(f, "  steps       {}, {missing}", self.steps)?;
        for ModeChange { time_ns, mode } in &self.modes {
            writeln!(f, "  mode        {:>9.3} s  {mode}", seconds(*time_ns))?;
        }
        for FaultInfo { time_ns, fault } in &self.faults {
            writeln!(f, "  fault       {:>9.3} s  {fault}", seconds(*time_ns))?;
        }
        for channel in &self.channels {
            let (topic, schema) = (&channel.topic, &channel.schema);
            writeln!(
                f,
                "  channel     {:>9}    {topic}  {schema}",
                channel.messages
            )?;
        }
        for file in &self.attachments {
            writeln!(f, "  file inside {:>9} B  {}", file.bytes, file.name)?;
        }
        Ok(())
    }
}
