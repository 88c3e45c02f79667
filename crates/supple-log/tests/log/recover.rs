//! A file that is truncated or damaged anywhere yields exactly its complete chunks.

use crate::common::{self, N};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::fs;
use std::path::Path;
use supple_log::{CycleRecord, LogError, Reader, info, recover};

const STEPS: u64 = 1_100;

struct Original {
    folder: tempfile::TempDir,
    bytes: Vec<u8>,
    records: Vec<CycleRecord<N>>,
}

fn original() -> Original {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    common::write(&path, STEPS).expect("written");
    let bytes = fs::read(&path).expect("read");
    let records = Reader::open(&path)
        .and_then(|reader| reader.records::<N>())
        .and_then(|records| records.map(|record| record.map(|r| r.value)).collect())
        .expect("whole");
    Original {
        folder,
        bytes,
        records,
    }
}

/// Counts the messages of a file with the strict reader of the mcap library, which requires the end of the file.
fn message_count(bytes: &[u8]) -> u64 {
    let summary = mcap::Summary::read(bytes).expect("valid").expect("indexed");
    let counted = summary.stats.expect("statistics").message_count;
    let messages = mcap::MessageStream::new(bytes).expect("valid");
    let read = messages.inspect(|message| assert!(message.is_ok())).count() as u64;
    assert_eq!(read, counted);
    read
}

#[test]
fn truncation_anywhere_keeps_all_complete_chunks() {
    let original = original();
    let from = original.folder.path().join("cut.mcap");
    let to = original.folder.path().join("recovered.mcap");
    let mut kept = Vec::new();
    let mut nothing = 0;
    for cut in (0..original.bytes.len()).step_by(997) {
        fs::write(&from, &original.bytes[..cut]).expect("cut");
        let recovery = match recover(&from, &to) {
            Ok(recovery) => recovery,
            Err(LogError::NoCompleteChunk { bytes, .. }) => {
                assert!(
                    kept.is_empty(),
                    "cut at {cut}: less than an earlier cut gave"
                );
                assert_eq!(bytes, cut as u64);
                nothing += 1;
                continue;
            }
            Err(LogError::Empty { .. }) if cut == 0 => {
                nothing += 1;
                continue;
            }
            Err(error) => panic!("cut at {cut}: {error}"),
        };
        assert!(recovery.stopped.is_some(), "cut at {cut}");
        assert!(recovery.kept_bytes <= cut as u64 && recovery.source_bytes == cut as u64);
        if kept.last() == Some(&recovery.messages) {
            continue;
        }
        assert!(kept.last() < Some(&recovery.messages), "cut at {cut}");
        kept.push(recovery.messages);

        assert_eq!(
            message_count(&fs::read(&to).expect("read")),
            recovery.messages
        );
        let reader = Reader::open(&to).expect("opened");
        assert!(reader.description().is_ok() && reader.config::<N>().is_ok());
        let records: Vec<_> = reader
            .records::<N>()
            .expect("four joints")
            .map(|record| record.expect("whole").value)
            .collect();
        assert_eq!(records, original.records[..records.len()]);
        let info = info(&to).expect("read");
        assert_eq!(info.recovered, Some((cut as u64, recovery.kept_bytes)));
        assert_eq!((info.incomplete, info.missing_steps), (None, 0));
    }
    // 1,100 steps of 1 ms in chunks of 250 ms: five chunks, which become complete one after the other.
    assert_eq!(kept.len(), 5, "{kept:?}");
    assert!(nothing > 0);
    assert!(
        !original
            .folder
            .path()
            .join("recovered.mcap.recovering")
            .exists()
    );
}

#[test]
fn a_truncated_file_is_read_up_to_its_last_complete_chunk() {
    let original = original();
    let path = original.folder.path().join("cut.mcap");
    let two_thirds = original.bytes.len() * 2 / 3;
    fs::write(&path, &original.bytes[..two_thirds]).expect("cut");

    let mut records: Vec<_> = Reader::open(&path)
        .and_then(|reader| reader.records::<N>())
        .expect("its beginning is complete")
        .collect();
    let error = records.pop().expect("something").expect_err("an end");
    assert!(matches!(error, LogError::Incomplete { .. }), "{error}");
    assert!(error.to_string().contains("cut.mcap") && error.to_string().contains("recover"));
    let records: Vec<_> = records
        .into_iter()
        .map(|r| r.expect("whole").value)
        .collect();
    assert_eq!(records, original.records[..records.len()]);
    assert!(records.len() >= 500);

    let info = info(&path).expect("its beginning is complete");
    assert!(info.incomplete.is_some());
    assert_eq!(info.steps, records.len() as u64);
    assert!(info.to_string().contains("supple log recover"));
}

#[test]
fn a_complete_file_is_copied_byte_for_byte() {
    let original = original();
    let to = original.folder.path().join("copy.mcap");
    let recovery = recover(&original.folder.path().join("run.mcap"), &to).expect("complete");
    assert_eq!(recovery.stopped, None);
    assert_eq!(recovery.kept_bytes, original.bytes.len() as u64);
    assert!(fs::read(to).expect("read") == original.bytes);
}

#[test]
fn recovery_stops_at_a_damaged_chunk() {
    let original = original();
    let (from, to) = names(original.folder.path());
    let whole = message_count(&original.bytes);
    let summary = mcap::Summary::read(&original.bytes).expect("valid");
    let chunks = summary.expect("indexed").chunk_indexes;
    let mut bytes = original.bytes.clone();
    bytes[(chunks[2].chunk_start_offset + chunks[2].chunk_length / 2) as usize] ^= 0x10;
    fs::write(&from, &bytes).expect("damaged");

    let recovery = recover(&from, &to).expect("two chunks are complete");
    assert_eq!(recovery.chunks, 2);
    assert!(recovery.messages < whole);
    assert!(recovery.stopped.is_some());
    assert!(
        recovery.to_string().contains("were incomplete"),
        "{recovery}"
    );
}

/// Random damage of lengths, checksums and record types, half of it near the beginning, where they are dense: memory
/// stays bounded, and only steps that were written are returned.
#[test]
fn reading_a_damaged_file_returns_only_written_steps() {
    let original = original();
    let (from, to) = names(original.folder.path());
    let length = original.bytes.len();
    let near_or_far = prop_oneof![0..600_usize, 0..length];
    let damage = (near_or_far, any::<u8>(), proptest::option::of(0..length));
    let mut runner = TestRunner::deterministic();
    let result = runner.run(&damage, |(at, value, cut)| {
        let mut bytes = original.bytes.clone();
        bytes[at] = value;
        bytes.truncate(cut.unwrap_or(length));
        fs::write(&from, &bytes).expect("damaged");
        let _ = info(&from);
        if recover(&from, &to).is_err() {
            return Ok(());
        }
        // The metadata of the log has no checksum.
        let Ok(records) = Reader::open(&to).and_then(|reader| reader.records::<N>()) else {
            return Ok(());
        };
        for record in records {
            let record = record.expect("whole").value;
            prop_assert_eq!(&record, &original.records[record.step as usize]);
        }
        Ok(())
    });
    result.expect("nothing invented");
}

/// A file system may leave zeros after a loss of power.
#[test]
fn zeros_after_the_last_chunk_are_not_data() {
    let original = original();
    let (from, to) = names(original.folder.path());
    let half = original.bytes.len() / 2;
    fs::write(&from, &original.bytes[..half]).expect("cut");
    let cut = recover(&from, &to).expect("recovered");
    let mut bytes = fs::read(&to).expect("read");
    let end = cut.kept_bytes as usize;
    bytes.clear();
    bytes.extend_from_slice(&original.bytes[..end]);
    bytes.resize(end + 5_000, 0);
    fs::write(&from, &bytes).expect("padded");

    let padded = recover(&from, &to).expect("recovered");
    assert_eq!(padded.messages, cut.messages);
    assert_eq!(padded.kept_bytes, cut.kept_bytes);
}

#[test]
fn a_part_file_can_be_recovered_to_the_name_of_its_log() {
    let original = original();
    let part = original.folder.path().join("lost.mcap.part");
    let to = original.folder.path().join("lost.mcap");
    let half = &original.bytes[..original.bytes.len() / 2];
    fs::write(&part, half).expect("cut");
    recover(&part, &to).expect("recovered");
    assert_eq!(fs::read(&part).expect("untouched"), half);
    message_count(&fs::read(&to).expect("read"));
}

#[test]
fn a_file_without_complete_chunks_is_rejected_and_no_output_is_left() {
    let original = original();
    let (from, to) = names(original.folder.path());
    let run = original.folder.path().join("run.mcap");
    let error = recover(&run, &run).expect_err("same file");
    assert!(matches!(error, LogError::SameFile { .. }), "{error}");
    assert!(fs::read(&run).expect("untouched") == original.bytes);

    fs::write(&from, "not an MCAP file, whatever its name").expect("written");
    let error = recover(&from, &to).expect_err("not an MCAP file");
    assert!(matches!(error, LogError::Format { .. }), "{error}");
    let error = recover(&original.folder.path().join("missing"), &to).expect_err("missing");
    assert!(matches!(error, LogError::Read { .. }), "{error}");
    let error = recover(original.folder.path(), &to).expect_err("a folder");
    assert!(matches!(error, LogError::Read { .. }), "{error}");

    fs::write(&from, &original.bytes[..500]).expect("cut");
    let error = recover(&from, &to).expect_err("no complete chunk");
    assert!(error.to_string().contains("cut.mcap") && error.to_string().contains("500"));
    assert!(!to.exists());
    assert!(!original.folder.path().join("to.mcap.recovering").exists());
}

fn names(folder: &Path) -> (std::path::PathBuf, std::path::PathBuf) {
    (folder.join("cut.mcap"), folder.join("to.mcap"))
}
