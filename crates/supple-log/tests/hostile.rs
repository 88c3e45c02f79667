//! Files made to hurt: an error that names file and element, soon, with the memory that there is.

use mcap::records::{MessageHeader, Metadata};
use std::collections::BTreeMap;
use std::fs::File;
use std::num::NonZeroU64;
use std::path::Path;
use supple_log::{LogError, Reader, export_csv, info, recover};

/// A log with one message of `bytes` on the channel `/c`, of the type `p/A` that `definition` defines.
fn log(path: &Path, definition: &str, bytes: &[u8]) {
    let file = File::create(path).expect("created");
    let mut writer = mcap::Writer::new(file).expect("begun");
    let about = ["software", "arm", "experiment"].map(|key| (key.to_owned(), "x".to_owned()));
    let mut about = BTreeMap::from(about);
    about.insert("start_ns".to_owned(), "0".to_owned());
    about.insert("joints".to_owned(), "a b c".to_owned());
    let metadata = Metadata {
        name: "supple".to_owned(),
        metadata: about,
    };
    writer.write_metadata(&metadata).expect("written");
    let schema = writer.add_schema("p/msg/A", "ros2msg", definition.as_bytes());
    let schema = schema.expect("written");
    let channel = writer.add_channel(schema, "/c", "cdr", &BTreeMap::new());
    let header = MessageHeader {
        channel_id: channel.expect("written"),
        sequence: 0,
        log_time: 1,
        publish_time: 1,
    };
    let data = [&[0, 1, 0, 0], bytes].concat();
    writer
        .write_to_known_channel(&header, &data)
        .expect("written");
    writer.finish().expect("written");
}

fn refused(definition: &str, bytes: &[u8], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    log(&path, definition, bytes);
    let mut out = Vec::new();
    let error = export_csv(&path, "/c", NonZeroU64::MIN, &mut out).expect_err("no table");
    assert!(matches!(error, LogError::Format { .. }), "{error}");
    let message = error.to_string();
    for word in [&["run.mcap", "/c"], words].concat() {
        assert!(message.contains(word), "{word} in {message}");
    }
    assert!(info(&path).is_ok(), "the rest of the log is sound");
}

const LINE: &str =
    "================================================================================";

#[test]
fn a_message_that_holds_itself() {
    refused("A a\n", &[0; 8], &["p/A", "holds itself"]);
    refused("A[] a\n", &[255; 4096], &["p/A", "holds itself"]);
    let by_another = format!("B b\n{LINE}\nMSG: p/B\nint8 x\nA[] a\n");
    refused(&by_another, &[255; 4096], &["holds itself"]);
}

#[test]
fn messages_that_double_with_every_level() {
    let mut definition = "M0 a\nM0 b\n".to_owned();
    for i in 0..30 {
        definition += &format!("{LINE}\nMSG: p/M{i}\nM{0} a\nM{0} b\n", i + 1);
    }
    definition += &format!("{LINE}\nMSG: p/M30\nint8[0] x\n");
    refused(&definition, &[0; 8], &["at a.a.a", "at most 100000 fields"]);
}

#[test]
fn more_elements_than_there_are_bytes() {
    let nothing = format!("N[9223372036854775808] n\n{LINE}\nMSG: p/N\nint8[0] x\n");
    refused(&nothing, &[0; 8], &["at n", "at most 100000 fields"]);
    refused(
        "int8[0] z\nint8[99999999999999999999] n\n",
        &[0; 8],
        &["cannot read"],
    );
    let sequence = format!("N[] n\n{LINE}\nMSG: p/N\nint8[0] x\n");
    refused(&sequence, &[255; 4], &["at n", "at most 100000 fields"]);
}

/// A log that claims more than a machine's memory and has it, on a disk that stores no zeros.
#[test]
fn a_record_as_long_as_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let length: u64 = 1 << 40;
    let attachment = [&[9_u8][..], &length.to_le_bytes()].concat();
    std::fs::write(&path, [mcap::MAGIC, &attachment].concat()).expect("written");
    let file = File::options().write(true).open(&path).expect("opened");
    file.set_len(length + 100).expect("a sparse file");
    let error = Reader::open(&path).expect_err("refused");
    assert!(error.to_string().contains("run.mcap"), "{error}");
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let fifo = folder.path().join("run.mcap");
    let made = std::process::Command::new("mkfifo").arg(&fifo).status();
    assert!(made.expect("mkfifo is there").success());
    for (path, word) in [
        (fifo.as_path(), "a FIFO"),
        (Path::new("/dev/zero"), "a character device"),
        (folder.path(), "a folder"),
    ] {
        let to = folder.path().join("to.mcap");
        let errors = [
            Reader::open(path).expect_err("refused"),
            recover(path, &to).expect_err("refused"),
        ];
        for error in errors {
            assert!(matches!(error, LogError::Read { .. }), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        assert!(!to.exists());
    }
}
