//! From the bytes of a record to its content, whatever the bytes: a damaged record gives an error, not
//! a panic and not a request for all memory.

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read};

/// A longer chunk, taken apart, is damage, not data.
const CHUNK_LIMIT_BYTES: usize = 1 << 28;

/// A record, and the records in it if it is a chunk.
pub(crate) fn decode_record(
    opcode: u8,
    data: &[u8],
) -> Result<(Record<'static>, VecDeque<Record<'static>>), McapError> {
    match opcode {
        op::ATTACHMENT if !fits(data) => Err(McapError::UnexpectedEof),
        op::CHUNK => {
            let Record::Chunk {
                header,
                data: content,
            } = mcap::parse_record(opcode, data)?
            else {
                return Err(McapError::BadIndex);
            };
            let whole = header.compressed_size == content.len() as u64;
            if !whole || header.compression.is_empty() && !are_framed(&content) {
                return Err(McapError::UnexpectedEof);
            }
            let inside = chunk_records(data)?;
            let data = Vec::new().into();
            Ok((Record::Chunk { header, data }, inside))
        }
        _ => {
            let record = mcap::parse_record(opcode, data)?;
            Ok((record.into_owned(), VecDeque::new()))
        }
    }
}

/// Records of a chunk whose checksum is right: lengths in a damaged one would ask for any memory.
fn chunk_records(data: &[u8]) -> Result<VecDeque<Record<'static>>, McapError> {
    let length = (data.len() as u64).to_le_bytes();
    let mut source = [op::CHUNK].as_slice().chain(length.as_slice()).chain(data);
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(CHUNK_LIMIT_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut records = VecDeque::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(bytes) => {
                let read = read_some(&mut source, reader.insert(bytes))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                records.push_back(mcap::parse_record(opcode, data)?.into_owned());
            }
        }
    }
    Ok(records)
}

/// Whether records of an uncompressed chunk, of the lengths that they state, fill it: the reader takes one that is longer
/// for granted.
fn are_framed(mut records: &[u8]) -> bool {
    while !records.is_empty() {
        let prefix = records
            .get(1..)
            .and_then(|rest| rest.split_first_chunk::<8>());
        let rest = prefix.and_then(|(length, rest)| {
            let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
            rest.get(length..)
        });
        let Some(rest) = rest else {
            return false;
        };
        records = rest;
    }
    true
}

/// Whether the name and the media type of an attachment, of the lengths that it states, leave room for
/// the length of its content and its checksum.
fn fits(attachment: &[u8]) -> bool {
    const TIMES_BYTES: usize = 16;
    const LENGTH_AND_CHECKSUM_BYTES: usize = 12;
    let after_text = |rest: &'_ [u8]| -> Option<usize> {
        let (length, _) = rest.split_first_chunk::<4>()?;
        usize::try_from(u32::from_le_bytes(*length))
            .ok()?
            .checked_add(4)
    };
    let rest = attachment.get(TIMES_BYTES..);
    let rest = rest.and_then(|rest| rest.get(after_text(rest)?..));
    let rest = rest.and_then(|rest| rest.get(after_text(rest)?..));
    rest.is_some_and(|rest| rest.len() >= LENGTH_AND_CHECKSUM_BYTES)
}

/// Bytes read, none only at the end.
pub(crate) fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}
