//! Malicious files give an error with file and element quickly and with bounded memory.

use mcap::records::{MessageHeader, Metadata};
use std::collections::BTreeMap;
use std::fs::File;
use std::num::NonZeroU64;
use std::path::Path;
use supple_log::{LogError, Reader, export_csv, info, recover};

/// A log with one message of `bytes` on the channel `topic`, of the type `p/A` that `definition` defines.
fn log(path: &Path, topic: &str, definition: &str, bytes: &[u8]) {
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
    let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new());
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

fn assert_rejected(definition: &str, bytes: &[u8], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    log(&path, "/c", definition, bytes);
    let mut out = Vec::new();
    let error = export_csv(&path, "/c", NonZeroU64::MIN, &mut out).expect_err("no table");
    assert!(matches!(error, LogError::Format { .. }), "{error}");
    let message = error.to_string();
    for word in [&["run.mcap", "/c"], words].concat() {
        assert!(message.contains(word), "{word} in {message}");
    }
    assert!(info(&path).is_ok(), "the rest of the log is valid");
}

/// The fields without which a definition is none of a record, and the bytes of a message of them.
const RECORD: &str = "uint64 step\nuint64 input_cycle\nuint64 cycle\nuint8 mode\nfloat64[3] position_rad\n\
                      float64[3] velocity_rad_per_s\nfloat64[3] torque_nm\n";
const RECORD_BYTES: usize = 104;

/// Records are decoded by the definition inside the file.
fn assert_no_record(definition: &str, bytes: &[u8], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    log(&path, "/controller_state", definition, bytes);
    let reader = Reader::open(&path).expect("opened");
    let mut records = reader.records::<3>().expect("three joints");
    let errors = [
        info(&path).expect_err("no record"),
        records.next().expect("a message").expect_err("no record"),
    ];
    for error in errors {
        let message = error.to_string();
        for word in [&["run.mcap", "/controller_state"], words].concat() {
            assert!(message.contains(word), "{word} in {message}");
        }
    }
}

#[test]
fn a_definition_of_a_record_from_outside() {
    let data = &[0; RECORD_BYTES];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    log(&path, "/controller_state", RECORD, data);
    assert_eq!(info(&path).expect("a record").steps, 1);

    let empty = "MSG: p/N\nint8[0] x\n";
    let nothing = format!("{RECORD}N[9223372036854775808] n\n{LINE}\n{empty}");
    assert_no_record(&nothing, data, &["more fields than a message of 104 bytes"]);
    let mut doubling = format!("{RECORD}M0 a\nM0 b\n");
    for i in 0..30 {
        doubling += &format!("{LINE}\nMSG: p/M{i}\nM{0} a\nM{0} b\n", i + 1);
    }
    doubling += &format!("{LINE}\nMSG: p/M30\nint8[0] x\n");
    assert_no_record(&doubling, data, &["more fields than"]);
    assert_no_record(
        &format!("{RECORD}bool a\nbool a\n"),
        data,
        &["field a is there twice"],
    );
    assert_no_record("string data\n", data, &["no field step"]);
    let vector = format!(
        "{RECORD}geometry_msgs/Vector3 tip_position_m\n{LINE}\nMSG: geometry_msgs/Vector3\nfloat32 x\n"
    );
    assert_no_record(
        &vector,
        data,
        &["geometry_msgs/Vector3 is not three numbers"],
    );
    let shorter = RECORD.replace("float64[3] torque_nm", "float64[2] torque_nm");
    assert_no_record(&shorter, data, &["torque_nm"]);
}

const LINE: &str =
    "================================================================================";

#[test]
fn a_recursive_message_type() {
    assert_rejected("A a\n", &[0; 8], &["p/A", "is recursive"]);
    assert_rejected("A[] a\n", &[255; 4096], &["p/A", "is recursive"]);
    let by_another = format!("B b\n{LINE}\nMSG: p/B\nint8 x\nA[] a\n");
    assert_rejected(&by_another, &[255; 4096], &["is recursive"]);
}

#[test]
fn messages_that_double_with_every_level() {
    let mut definition = "M0 a\nM0 b\n".to_owned();
    for i in 0..30 {
        definition += &format!("{LINE}\nMSG: p/M{i}\nM{0} a\nM{0} b\n", i + 1);
    }
    definition += &format!("{LINE}\nMSG: p/M30\nint8[0] x\n");
    assert_rejected(&definition, &[0; 8], &["at a.a.a", "at most 100000 fields"]);
}

#[test]
fn more_elements_than_there_are_bytes() {
    let nothing = format!("N[9223372036854775808] n\n{LINE}\nMSG: p/N\nint8[0] x\n");
    assert_rejected(&nothing, &[0; 8], &["at n", "at most 100000 fields"]);
    assert_rejected(
        "int8[0] z\nint8[99999999999999999999] n\n",
        &[0; 8],
        &["cannot read"],
    );
    let sequence = format!("N[] n\n{LINE}\nMSG: p/N\nint8[0] x\n");
    assert_rejected(&sequence, &[255; 4], &["at n", "at most 100000 fields"]);
}

/// A record whose stated length exceeds the memory, in a sparse file of that length.
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
fn special_files_are_not_read() {
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
