//! Reads an MCAP file chunk by chunk until the first damaged chunk.
//!
//! A chunk is decoded and its checksum verified before any of it is returned; a truncated file therefore yields
//! only intact data.

use crate::error::LogError;
use crate::parse::{decode_record, read_some};
use mcap::McapError;
use mcap::records::{AttachmentHeader, MessageHeader, Metadata, Record};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

/// Size of opcode and length before every record.
const RECORD_PREFIX_BYTES: u64 = 9;
/// Maximum size of a record; a larger one is treated as damage, so that it does not allocate that much memory.
const RECORD_LIMIT_BYTES: u64 = 1 << 28;

/// A channel with its message definition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub topic: String,
    pub message_encoding: String,
    /// Name, encoding, text; empty if there is none.
    pub schema: Arc<Schema>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Schema {
    pub name: String,
    pub encoding: String,
    pub text: Vec<u8>,
}

/// Item of a log file.
pub(crate) enum LogItem {
    Metadata(Metadata),
    Attachment(AttachmentHeader, Vec<u8>),
    /// Start of a complete chunk.
    Chunk,
    Message(Arc<Channel>, MessageHeader, Vec<u8>),
}

pub(crate) struct LogScanner {
    file: String,
    source: BufReader<File>,
    reader: LinearReader,
    /// Length of the intact beginning of the file: magic and complete MCAP records \[bytes\].
    complete_bytes: u64,
    /// Records of the current chunk that are still to be returned.
    chunk: VecDeque<Record<'static>>,
    schemas: BTreeMap<u16, Arc<Schema>>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// Whether the record `DataEnd` has been read; the summary after it is checked, but not returned.
    past_data: bool,
    ended: bool,
}

impl LogScanner {
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let file = path.display().to_string();
        let (source, bytes) = match supple_files::open_input(path) {
            Ok((source, bytes)) => (BufReader::new(source), bytes),
            Err(source) => return Err(LogError::Read { file, source }),
        };
        if bytes == 0 {
            return Err(LogError::Empty { file });
        }
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(usize::try_from(bytes.min(RECORD_LIMIT_BYTES)).unwrap_or(0));
        Ok(LogScanner {
            file,
            source,
            reader: LinearReader::new_with_options(options),
            complete_bytes: bytes.min(mcap::MAGIC.len() as u64),
            chunk: VecDeque::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            past_data: false,
            ended: false,
        })
    }

    /// Returns the path of the file, for the texts of errors.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Length of the intact beginning of the file: magic and complete MCAP records \[bytes\].
    pub fn complete_bytes(&self) -> u64 {
        self.complete_bytes
    }

    /// Returns the next item; `None` at the end of a complete file.
    ///
    /// # Errors
    /// [`LogError::Incomplete`] if the file is truncated or damaged (later calls return `None`); [`LogError::Format`] if it is
    /// not an MCAP file; [`LogError::Read`].
    pub fn next(&mut self) -> Result<Option<LogItem>, LogError> {
        loop {
            while let Some(record) = self.chunk.pop_front() {
                if let Some(item) = self.data_item(record)? {
                    return Ok(Some(item));
                }
            }
            if self.ended {
                return Ok(None);
            }
            let Some(record) = self.record()? else {
                self.ended = true;
                return Ok(None);
            };
            match record {
                _ if self.past_data => {}
                Record::DataEnd(_) => self.past_data = true,
                Record::Metadata(metadata) => return Ok(Some(LogItem::Metadata(metadata))),
                Record::Attachment { header, data, .. } => {
                    return Ok(Some(LogItem::Attachment(header, data.into_owned())));
                }
                Record::Chunk { .. } => return Ok(Some(LogItem::Chunk)),
                record => {
                    if let Some(item) = self.data_item(record)? {
                        return Ok(Some(item));
                    }
                }
            }
        }
    }

    /// Returns the next record at the top level of the file; if it is a chunk, `self.chunk` receives its records.
    fn record(&mut self) -> Result<Option<Record<'static>>, LogError> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let read = read_some(&mut self.source, self.reader.insert(bytes));
                    let read = read.map_err(|source| LogError::Read {
                        file: self.file.clone(),
                        source,
                    })?;
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { opcode: 0, .. })) => {
                    return Err(self.incomplete("a record with an invalid opcode"));
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    let bytes = RECORD_PREFIX_BYTES + data.len() as u64;
                    match decode_record(opcode, data) {
                        Ok((record, chunk)) => {
                            self.complete_bytes += bytes;
                            self.chunk = chunk;
                            return Ok(Some(record));
                        }
                        Err(error) => return Err(self.incomplete(&error.to_string())),
                    }
                }
                Some(Err(McapError::BadMagic)) if !self.past_data => {
                    return Err(LogError::Format {
                        file: self.file.clone(),
                        message: "the file does not start like an MCAP file".into(),
                    });
                }
                Some(Err(error)) => return Err(self.incomplete(&error.to_string())),
            }
        }
    }

    /// Stores a schema or a channel; returns a message as an item; ignores other records.
    fn data_item(&mut self, record: Record<'static>) -> Result<Option<LogItem>, LogError> {
        match record {
            Record::Schema { header, data } => {
                let schema = Schema {
                    name: header.name,
                    encoding: header.encoding,
                    text: data.into_owned(),
                };
                self.schemas.insert(header.id, Arc::new(schema));
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned();
                let known = Channel {
                    topic: channel.topic,
                    message_encoding: channel.message_encoding,
                    schema: schema.unwrap_or_default(),
                };
                self.channels.insert(channel.id, Arc::new(known));
            }
            Record::Message { header, data } => {
                let channel = self.channels.get(&header.channel_id).cloned();
                let channel = channel.ok_or_else(|| {
                    self.incomplete(&format!("channel {} is not defined", header.channel_id))
                })?;
                return Ok(Some(LogItem::Message(channel, header, data.into_owned())));
            }
            _ => {}
        }
        Ok(None)
    }

    fn incomplete(&mut self, cause: &str) -> LogError {
        self.ended = true;
        self.chunk.clear();
        LogError::Incomplete {
            file: self.file.clone(),
            cause: cause.to_owned(),
            kept_bytes: self.complete_bytes,
        }
    }
}
