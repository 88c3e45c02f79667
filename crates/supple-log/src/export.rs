//! Exports a channel of a log as comma-separated values.
//!
//! Columns follow the message definition inside the log, so that any channel can be exported:
//! `torques.gravity.joint2`, `tip_position_m.x`. Elements per joint have the name of the joint. Numbers are
//! printed with enough digits to read back the same number, `true` and `false` as 1 and 0. The first column is
//! the time in nanoseconds; the header of the message is omitted.

use crate::definition;
use crate::error::LogError;
use crate::reader::Reader;
use crate::scan::{LogItem, LogScanner};
use crate::table::Table;
use std::collections::BTreeSet;
use std::io::Write;
use std::num::NonZeroU64;
use std::path::Path;

/// Writes every `every`-th message of `channel` to `out` and returns the number of rows.
///
/// Of a truncated file it writes the complete part and then returns [`LogError::Incomplete`].
///
/// # Errors
/// [`LogError::UnknownChannel`] with the existing channels; [`LogError::Format`] if its messages cannot be written
/// as a table; [`LogError::Output`]; errors of reading.
pub fn export_csv(
    path: &Path,
    channel: &str,
    every: NonZeroU64,
    out: &mut dyn Write,
) -> Result<u64, LogError> {
    let joints = &Reader::open(path)?.metadata().joints.clone();
    let mut scanner = LogScanner::open(path)?;
    let mut known = BTreeSet::new();
    let mut table: Option<Table> = None;
    let (mut seen, mut rows) = (0_u64, 0);
    while let Some(item) = scanner.next()? {
        let LogItem::Message(of, header, data) = item else {
            continue;
        };
        if of.topic != channel {
            if table.is_none() {
                known.insert(of.topic.clone());
            }
            continue;
        }
        let broken = |message: String| LogError::Format {
            file: path.display().to_string(),
            message: format!("{channel} at {} ns: {message}", header.log_time),
        };
        let table = match &mut table {
            Some(table) => table,
            none => {
                let text = String::from_utf8_lossy(&of.schema.text);
                let definitions = definition::parse(&of.schema.name, &text).map_err(broken)?;
                let table = Table::new(&definitions, &data, joints).map_err(broken)?;
                let header_row = table.header_row();
                out.write_all(header_row.as_bytes())
                    .map_err(LogError::Output)?;
                none.insert(table)
            }
        };
        if seen.is_multiple_of(every.get()) {
            let row = table.row(header.log_time, &data).map_err(broken)?;
            out.write_all(row.as_bytes()).map_err(LogError::Output)?;
            rows += 1;
        }
        seen += 1;
    }
    if table.is_none() {
        return Err(LogError::UnknownChannel {
            file: path.display().to_string(),
            channel: channel.to_owned(),
            known: Vec::from_iter(known).join(", "),
        });
    }
    out.flush().map_err(LogError::Output)?;
    Ok(rows)
}
