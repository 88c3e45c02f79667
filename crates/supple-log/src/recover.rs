//! Recovers a truncated log: copies every complete chunk into a new file with an index.

use crate::error::LogError;
use crate::file::LogFile;
use crate::scan::{Channel, LogItem, LogScanner};
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supple_files::with_suffix;

/// Suffix of the output file until it is complete. It differs from the suffix of a log that is being written, which may
/// be the file to recover.
const PARTIAL_SUFFIX: &str = ".recovering";

/// Result of a recovery.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Recovery {
    /// File that was read.
    pub from: PathBuf,
    /// File that was written.
    pub to: PathBuf,
    /// Length of the file that was read.
    pub source_bytes: u64,
    /// Number of its bytes that were complete.
    pub kept_bytes: u64,
    /// Number of messages kept, on all channels.
    pub messages: u64,
    /// Number of chunks kept.
    pub chunks: u64,
    /// Times of the first and the last message kept \[ns\].
    pub span_ns: (u64, u64),
    /// Reason for which reading stopped; `None` if the file was complete.
    pub stopped: Option<String>,
}

impl fmt::Display for Recovery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = self.span_ns;
        let (to, messages, chunks) = (self.to.display(), self.messages, self.chunks);
        let seconds = last.saturating_sub(first) as f64 * 1e-9;
        write!(
            f,
            "{to}: {messages} messages over {seconds:.3} s in {chunks} chunks; "
        )?;
        match &self.stopped {
            None => write!(f, "the file was complete"),
            Some(cause) => write!(
                f,
                "of {} bytes the last {} were incomplete ({cause})",
                self.source_bytes,
                self.source_bytes.saturating_sub(self.kept_bytes)
            ),
        }
    }
}

/// Writes the complete part of `from` to `to`. The copy of a complete file is identical, byte for byte.
///
/// # Errors
/// [`LogError::NoCompleteChunk`], [`LogError::SameFile`]; [`LogError::Format`] if `from` is not an MCAP file;
/// errors of reading and writing.
pub fn recover(from: &Path, to: &Path) -> Result<Recovery, LogError> {
    let mut scanner = LogScanner::open(from)?;
    let read_error = |source| LogError::Read {
        file: from.display().to_string(),
        source,
    };
    let source_bytes = std::fs::metadata(from).map_err(read_error)?.len();
    refuse_overwriting(from, to, PARTIAL_SUFFIX)?;
    let mut writer = RecoveryWriter {
        file: LogFile::create(to, PARTIAL_SUFFIX)?,
        channel_ids: BTreeMap::new(),
        messages: 0,
        span_ns: None,
    };
    let stopped = match writer.copy_all(&mut scanner, source_bytes) {
        Ok(stopped) => stopped,
        Err(error) => {
            writer.file.discard();
            return Err(error);
        }
    };
    let span_ns = writer.span_ns.unwrap_or_default();
    let written = writer.file.finish()?;
    Ok(Recovery {
        from: from.to_owned(),
        to: to.to_owned(),
        source_bytes,
        kept_bytes: if stopped.is_none() {
            source_bytes
        } else {
            scanner.complete_bytes()
        },
        messages: writer.messages,
        chunks: written.chunks,
        span_ns,
        stopped,
    })
}

/// Checks that writing `to`, under a temporary name with `partial_suffix` first, leaves the log `from` as it is.
///
/// # Errors
/// [`LogError::SameFile`]; [`LogError::Read`] if `from` does not exist.
pub fn refuse_overwriting(from: &Path, to: &Path, partial_suffix: &str) -> Result<(), LogError> {
    let read_error = |source| LogError::Read {
        file: from.display().to_string(),
        source,
    };
    let source = from.canonicalize().map_err(read_error)?;
    let is_source = |path: &Path| path.canonicalize().is_ok_and(|path| path == source);
    if is_source(to) || is_source(&with_suffix(to, partial_suffix)) {
        return Err(LogError::SameFile {
            file: from.display().to_string(),
        });
    }
    Ok(())
}

/// Writes the recovered log.
struct RecoveryWriter {
    file: LogFile,
    /// Maps channels of the old file to channels of the new one.
    channel_ids: BTreeMap<u16, u16>,
    messages: u64,
    span_ns: Option<(u64, u64)>,
}

impl RecoveryWriter {
    /// Copies all complete chunks. Returns the reason if copying stopped before the end of the file.
    fn copy_all(
        &mut self,
        scanner: &mut LogScanner,
        source_bytes: u64,
    ) -> Result<Option<String>, LogError> {
        let stopped = match self.copy_items(scanner) {
            Ok(()) => None,
            Err(LogError::Incomplete { cause, .. }) => Some(cause),
            Err(error) => return Err(error),
        };
        if self.messages == 0 {
            return Err(LogError::NoCompleteChunk {
                file: scanner.file().to_owned(),
                bytes: source_bytes,
            });
        }
        if stopped.is_some() {
            let kept = BTreeMap::from([
                ("source_bytes".to_owned(), source_bytes.to_string()),
                (
                    "kept_bytes".to_owned(),
                    scanner.complete_bytes().to_string(),
                ),
            ]);
            self.file.metadata("recovery", kept)?;
        }
        Ok(stopped)
    }

    fn copy_items(&mut self, scanner: &mut LogScanner) -> Result<(), LogError> {
        while let Some(item) = scanner.next()? {
            match item {
                LogItem::Metadata(metadata) => {
                    self.file.metadata(&metadata.name, metadata.metadata)?;
                }
                LogItem::Attachment(header, data) => {
                    self.file
                        .attach(&header.name, &header.media_type, header.log_time, &data)?
                }
                LogItem::Chunk => self.file.close_chunk()?,
                LogItem::Message(channel, header, data) => {
                    self.copy_message(&channel, header, &data)?
                }
            }
        }
        Ok(())
    }

    fn copy_message(
        &mut self,
        channel: &Arc<Channel>,
        header: MessageHeader,
        data: &[u8],
    ) -> Result<(), LogError> {
        let channel_id = match self.channel_ids.get(&header.channel_id) {
            Some(id) => *id,
            None => {
                let id = self.file.channel(channel)?;
                self.channel_ids.insert(header.channel_id, id);
                id
            }
        };
        let time_ns = header.log_time;
        let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        self.messages += 1;
        let header = MessageHeader {
            channel_id,
            ..header
        };
        self.file.message(&header, data)
    }
}
