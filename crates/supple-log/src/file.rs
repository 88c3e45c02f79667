//! Log file writer: writes under a temporary name and renames the file when it is complete.

use crate::error::LogError;
use crate::scan::Channel;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use supple_files::{check_output, open_output, with_suffix};

/// Duration of one chunk, the maximum that a crash can lose \[ns\].
const CHUNK_NS: u64 = 250_000_000;

/// Name and version of the software, stored in the files.
pub(crate) const SOFTWARE: &str = concat!("supple-log ", env!("CARGO_PKG_VERSION"));

/// Summary of a finished file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogSummary {
    /// File.
    pub path: PathBuf,
    /// Length of the file.
    pub bytes: u64,
    /// Number of messages on all channels.
    pub messages: u64,
    /// Number of chunks.
    pub chunks: u64,
}

pub(crate) struct LogFile {
    target: PathBuf,
    part: PathBuf,
    mcap: mcap::Writer<NoSeek<BufWriter<File>>>,
    /// Time of the first message of the open chunk.
    chunk_start_ns: Option<u64>,
}

impl LogFile {
    /// Creates `<target><suffix>`, replacing an abandoned one. A device, FIFO, socket or folder at either name is
    /// rejected before anything is written.
    pub fn create(target: &Path, suffix: &str) -> Result<Self, LogError> {
        let part = with_suffix(target, suffix);
        let cannot_create = |path: &Path, source| LogError::Create {
            file: path.display().to_string(),
            source,
        };
        let failed = |source| cannot_create(&part, source);
        check_output(target).map_err(|source| cannot_create(target, source))?;
        let file = open_output(&part).map_err(failed)?;
        // Continue if the file system does not support locks.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(LogError::Busy {
                file: part.display().to_string(),
            });
        }
        if file.metadata().map_err(failed)?.len() > 0 {
            file.set_len(0).map_err(failed)?;
        }
        let mcap = WriteOptions::new()
            .profile("ros2")
            .library(SOFTWARE)
            .compression(Some(Compression::Lz4))
            .chunk_size(None)
            // A chunk is built in memory and written to the file at once.
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(file)))
            .map_err(|error| write_error(&part, error))?;
        Ok(LogFile {
            target: target.to_owned(),
            part,
            mcap,
            chunk_start_ns: None,
        })
    }

    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        time_ns: u64,
        data: &[u8],
    ) -> Result<(), LogError> {
        let attachment = Attachment {
            log_time: time_ns,
            create_time: time_ns,
            name: name.into(),
            media_type: media_type.into(),
            data: Cow::Borrowed(data),
        };
        let attached = self.mcap.attach(&attachment);
        attached.map_err(|error| write_error(&self.part, error))
    }

    pub fn metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<(), LogError> {
        let metadata = Metadata {
            name: name.into(),
            metadata,
        };
        let written = self.mcap.write_metadata(&metadata);
        written.map_err(|error| write_error(&self.part, error))
    }

    /// Returns the number of a channel; the channel is written before its first message.
    pub fn channel(&mut self, channel: &Channel) -> Result<u16, LogError> {
        let schema = &channel.schema;
        let added = if schema.name.is_empty() {
            Ok(0)
        } else {
            self.mcap
                .add_schema(&schema.name, &schema.encoding, &schema.text)
        };
        let added = added.and_then(|schema| {
            let (topic, encoding) = (&channel.topic, &channel.message_encoding);
            self.mcap
                .add_channel(schema, topic, encoding, &BTreeMap::new())
        });
        added.map_err(|error| write_error(&self.part, error))
    }

    /// Closes the chunk if it has covered its duration by `time_ns`.
    pub fn close_chunk_if_due(&mut self, time_ns: u64) -> Result<(), LogError> {
        let due = |start: u64| time_ns < start || time_ns - start >= CHUNK_NS;
        if self.chunk_start_ns.is_some_and(due) {
            self.close_chunk()?;
        }
        Ok(())
    }

    /// Closes the chunk. Everything written before survives a crash of the process.
    pub fn close_chunk(&mut self) -> Result<(), LogError> {
        self.chunk_start_ns = None;
        let flushed = self.mcap.flush();
        flushed.map_err(|error| write_error(&self.part, error))
    }

    /// Returns the error for a value that cannot be encoded.
    pub fn unwritable(
        &self,
        error: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> LogError {
        LogError::Write {
            file: self.part.display().to_string(),
            source: std::io::Error::other(error),
        }
    }

    pub fn message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), LogError> {
        self.chunk_start_ns.get_or_insert(header.log_time);
        let written = self.mcap.write_to_known_channel(header, data);
        written.map_err(|error| write_error(&self.part, error))
    }

    /// Discards the log: removes the written part.
    pub fn discard(self) {
        drop(self.mcap);
        // An error of the removal is ignored; the earlier error is the one to report.
        let _ = std::fs::remove_file(&self.part);
    }

    /// Writes the index, syncs the file to disk and renames it to its final name, replacing an existing file.
    pub fn finish(self) -> Result<LogSummary, LogError> {
        let LogFile {
            target,
            part,
            mut mcap,
            ..
        } = self;
        let summary = mcap.finish().map_err(|error| write_error(&part, error))?;
        let statistics = summary.stats.unwrap_or_default();
        let named = flush(mcap.into_inner().into_inner()).and_then(|file| {
            file.sync_all()?;
            let bytes = file.metadata()?.len();
            // Another file may have been created under the final name while the log was written.
            check_output(&target)?;
            std::fs::rename(&part, &target)?;
            Ok(bytes)
        });
        let bytes = named.map_err(|source| LogError::Write {
            file: part.display().to_string(),
            source,
        })?;
        Ok(LogSummary {
            path: target,
            bytes,
            messages: statistics.message_count,
            chunks: u64::from(statistics.chunk_count),
        })
    }
}

fn flush(mut file: BufWriter<File>) -> std::io::Result<File> {
    file.flush()?;
    file.into_inner().map_err(|error| error.into_error())
}

fn write_error(part: &Path, error: McapError) -> LogError {
    let source = match error {
        McapError::Io(source) => source,
        other => std::io::Error::other(other),
    };
    LogError::Write {
        file: part.display().to_string(),
        source,
    }
}
