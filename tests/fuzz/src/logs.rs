//! Fuzz targets of logs: a file with any content is read, exported, recovered and replayed, or rejected.

use crate::bytes::with_file;
use core::num::NonZeroU64;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use supple_core::controller::Request;
use supple_core::{Controller, State, step};
use supple_log::{Extras, LogError, Reader, RunInfo, Writer, export_csv, info, recover, replay};
use supple_model::Description;

/// Reads the bytes as a log file.
pub fn log(data: &[u8]) {
    with_file("input.mcap", data, |path| {
        let _ = info(path).map(|info| format!("{info:?}"));
        let _ = replay(path);
        for channel in ["/controller_state", "/tf", "/arm_events"] {
            let _ = export_csv(path, channel, NonZeroU64::MIN, &mut std::io::sink());
        }
        read(path);
        let to = path.with_extension("recovered");
        if recover(path, &to).is_ok() {
            // A recovered log is complete.
            let again = path.with_extension("again");
            let recovery = recover(&to, &again).expect("a complete log");
            assert_eq!(recovery.stopped, None);
        }
    });
}

fn read(path: &Path) {
    let Ok(reader) = Reader::open(path) else {
        return;
    };
    let _ = reader.description();
    let _ = reader.config::<3>();
    let _ = reader.timings().map(Iterator::count);
    if let Ok(records) = reader.records::<3>() {
        for record in records.flatten() {
            let _ = record.value.input();
        }
    }
    let _ = reader.plant_truths::<3>().map(Iterator::count);
}

/// Opcode and length before every record of a file.
const RECORD_PREFIX_BYTES: usize = 9;

/// Reads the bytes as a message definition, a zero byte and a message, in an otherwise valid log.
pub fn log_schema(data: &[u8]) {
    if let Ok(table) = exported(data) {
        let lines = table.split(|byte| *byte == b'\n').count();
        // One line of column names and one message, without further text.
        assert_eq!(lines, 3, "{}", String::from_utf8_lossy(&table));
    }
}

/// Exports a log with this definition and message as a table.
///
/// # Errors
/// The reason why the log cannot be exported.
pub fn exported(data: &[u8]) -> Result<Vec<u8>, LogError> {
    let end = data.iter().position(|byte| *byte == 0);
    let end = end.unwrap_or(data.len());
    let message = data.get(end + 1..).unwrap_or_default();
    with_file("input.mcap", &file_with(&data[..end], message), |path| {
        let _ = info(path);
        let mut table = Vec::new();
        export_csv(path, "/x", NonZeroU64::MIN, &mut table).map(|_| table)
    })
}

/// Creates a log with one channel and one message, without compression and checksums.
fn file_with(schema: &[u8], message: &[u8]) -> Vec<u8> {
    let written = || -> Result<Vec<u8>, mcap::McapError> {
        let options = mcap::WriteOptions::new()
            .compression(None)
            .calculate_chunk_crcs(false);
        let mut writer = options.create(Cursor::new(Vec::new()))?;
        writer.write_metadata(&mcap::records::Metadata {
            name: "supple".to_owned(),
            metadata: about(),
        })?;
        let schema = writer.add_schema("pkg/msg/X", "ros2msg", schema)?;
        let channel = writer.add_channel(schema, "/x", "cdr", &BTreeMap::new())?;
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, message)?;
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    };
    let file = written().expect("writing does not depend on the input");
    assert!(file.len() > RECORD_PREFIX_BYTES);
    file
}

/// Metadata that a log must contain.
fn about() -> BTreeMap<String, String> {
    let entries = [
        ("software", "supple"),
        ("arm", "x"),
        ("joints", "a b c"),
        ("experiment", "x"),
        ("start_ns", "0"),
    ];
    let entries = entries.map(|(key, value)| (key.to_owned(), value.to_owned()));
    BTreeMap::from(entries)
}

/// Returns a log of the built-in arm with three joints: complete, truncated, and without compression.
pub fn seeds() -> Vec<crate::seed::Seed> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("seed.mcap");
    write(&path);
    let whole = std::fs::read(&path).expect("written");
    let cut = whole[..whole.len() / 2].to_vec();
    let plain = uncompressed(&whole);
    vec![
        ("whole".to_owned(), whole),
        ("cut".to_owned(), cut),
        ("uncompressed".to_owned(), plain),
    ]
}

/// Writes a log of some steps of an arm at rest, with a request and a fault.
fn write(path: &Path) {
    let description = Description::asset("wam3").expect("built in");
    let config = description.config::<3>().expect("three joints");
    let home = description.home::<3>().expect("three joints");
    let controller = Controller::new(config).expect("valid");
    let mut state = State::new(&controller);
    let run = RunInfo::default();
    let mut writer = Writer::create(path, &description, &config, &run).expect("a new file");
    for cycle in 0..6 {
        let arm = crate::seed::state_at_rest(if cycle < 5 { cycle } else { 99 }, &home);
        let request = (cycle == 1).then_some(Request::GravityHold);
        let input = arm.input::<3>(request).expect("three joints");
        let output = step(&controller, &mut state, &input);
        let time_ns = cycle * 1_000_000;
        writer
            .write(time_ns, &input, &output, &Extras::default())
            .expect("room");
    }
    writer.event(6_000_000, "a button").expect("room");
    writer.finish().expect("complete");
}

/// Rewrites a log with the same metadata, attachments, channels and messages, without compression and checksums.
fn uncompressed(file: &[u8]) -> Vec<u8> {
    let rewritten = || -> Result<Vec<u8>, mcap::McapError> {
        let options = mcap::WriteOptions::new()
            .compression(None)
            .calculate_chunk_crcs(false)
            .calculate_data_section_crc(false)
            .calculate_summary_section_crc(false);
        let mut writer = options.create(Cursor::new(Vec::new()))?;
        for record in mcap::read::LinearReader::new(file)? {
            match record? {
                mcap::records::Record::Metadata(metadata) => writer.write_metadata(&metadata)?,
                mcap::records::Record::Attachment { header, data, .. } => {
                    writer.attach(&mcap::Attachment {
                        log_time: header.log_time,
                        create_time: header.create_time,
                        name: header.name,
                        media_type: header.media_type,
                        data,
                    })?;
                }
                _ => {}
            }
        }
        for message in mcap::MessageStream::new(file)? {
            writer.write(&message?)?;
        }
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    };
    rewritten().expect("the log is valid")
}
