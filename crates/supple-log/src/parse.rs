//! Decodes the bytes of an MCAP record. For arbitrary bytes it returns an error instead of panicking or allocating unbounded
//! memory.

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read};

/// Maximum size of a decompressed chunk; a larger one counts as damaged.
const CHUNK_LIMIT_BYTES: usize = 1 << 28;

/// Decodes a record, and the records in it if it is a chunk.
pub(crate) fn decode_record(
    opcode: u8,
    data: &[u8],
) -> Result<(Record<'static>, VecDeque<Record<'static>>), McapError> {
    match opcode {
        op::ATTACHMENT if !has_valid_lengths(data) => Err(McapError::UnexpectedEof),
        op::CHUNK => {
            let Record::Chunk {
                header,
                data: content,
            } = mcap::parse_record(opcode, data)?
            else {
                return Err(McapError::BadIndex);
            };
            let whole = header.compressed_size == content.len() as u64;
            if !whole || header.compression.is_empty() && !lengths_fill_chunk(&content) {
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

/// Decodes the records of a chunk after verifying its checksum, because lengths in a damaged chunk could cause any allocation.
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

/// Returns whether the records of an uncompressed chunk, with the lengths that they declare, fill the chunk exactly. The MCAP
/// reader does not check this.
fn lengths_fill_chunk(mut records: &[u8]) -> bool {
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

/// Returns whether name and media type of an attachment, with the lengths that it declares, leave room for
/// the length of its content and its checksum.
fn has_valid_lengths(attachment: &[u8]) -> bool {
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

/// Reads some bytes and returns their number; zero only at the end of the source.
pub(crate) fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}
