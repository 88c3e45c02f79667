//! Reading a malicious file fails quickly and with bounded memory; the error names the file and the element.

use mcap::records::{MessageHeader, Metadata};
use std::collections::BTreeMap;
use std::fs::File;
use std::num::NonZeroU64;
use std::path::Path;
use supple_log::{LogError, Reader, export_csv, info, recover};

/// Writes a log with one message of `bytes` on the channel `topic`, of the type `p/A` that `definition` defines.
fn write_log(path: &Path, topic: &str, definition: &str, bytes: &[u8]) {
    let file = File::create(path).expect("created");
    let mut writer = mcap::Writer::new(file).expect("begun");
    let entries = ["software", "arm", "experiment"].map(|key| (key.to_owned(), "x".to_owned()));
    let mut entries = BTreeMap::from(entries);
    entries.insert("start_ns".to_owned(), "0".to_owned());
    entries.insert("joints".to_owned(), "a b c".to_owned());
    let metadata = Metadata {
        name: "supple".to_owned(),
        metadata: entries,
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
    let cdr_header: [u8; 4] = [0, 1, 0, 0];
    let data = [&cdr_header[..], bytes].concat();
    writer
        .write_to_known_channel(&header, &data)
        .expect("written");
    writer.finish().expect("written");
}

fn assert_rejected(definition: &str, bytes: &[u8], expected: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    write_log(&path, "/c", definition, bytes);
    let mut out = Vec::new();
    let error = export_csv(&path, "/c", NonZeroU64::MIN, &mut out).expect_err("no table");
    assert!(matches!(error, LogError::Format { .. }), "{error}");
    let message = error.to_string();
    for text in [&["run.mcap", "/c"], expected].concat() {
        assert!(message.contains(text), "{text} in {message}");
    }
    assert!(info(&path).is_ok(), "the rest of the log is valid");
}

/// The fields that the definition of a record must have, and the size of a message with only these fields.
const RECORD: &str = "uint64 step\nuint64 input_cycle\nuint64 cycle\nuint8 mode\nfloat64[3] position_rad\n\
                      float64[3] velocity_rad_per_s\nfloat64[3] torque_nm\n";
const RECORD_BYTES: usize = 104;

/// Checks that reading records fails: they are decoded with the definition inside the file, which may be malicious.
fn assert_record_rejected(definition: &str, bytes: &[u8], expected: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    write_log(&path, "/controller_state", definition, bytes);
    let reader = Reader::open(&path).expect("opened");
    let mut records = reader.records::<3>().expect("three joints");
    let errors = [
        info(&path).expect_err("no record"),
        records.next().expect("a message").expect_err("no record"),
    ];
    for error in errors {
        let message = error.to_string();
        for text in [&["run.mcap", "/controller_state"], expected].concat() {
            assert!(message.contains(text), "{text} in {message}");
        }
    }
}

#[test]
fn a_malicious_record_definition_is_rejected() {
    let data = &[0; RECORD_BYTES];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    write_log(&path, "/controller_state", RECORD, data);
    assert_eq!(info(&path).expect("a record").steps, 1);

    let empty_type = "MSG: p/N\nint8[0] x\n";
    let empty_elements = format!("{RECORD}N[9223372036854775808] n\n{SEPARATOR}\n{empty_type}");
    assert_record_rejected(
        &empty_elements,
        data,
        &["more fields than a message of 104 bytes"],
    );
    let mut doubled_per_level = format!("{RECORD}M0 a\nM0 b\n");
    for i in 0..30 {
        doubled_per_level += &format!("{SEPARATOR}\nMSG: p/M{i}\nM{0} a\nM{0} b\n", i + 1);
    }
    doubled_per_level += &format!("{SEPARATOR}\nMSG: p/M30\nint8[0] x\n");
    assert_record_rejected(&doubled_per_level, data, &["more fields than"]);
    assert_record_rejected(
        &format!("{RECORD}bool a\nbool a\n"),
        data,
        &["field a is defined twice"],
    );
    assert_record_rejected("string data\n", data, &["no field step"]);
    let vector = format!(
        "{RECORD}geometry_msgs/Vector3 tip_position_m\n{SEPARATOR}\nMSG: geometry_msgs/Vector3\nfloat32 x\n"
    );
    assert_record_rejected(
        &vector,
        data,
        &["geometry_msgs/Vector3 is not three numbers"],
    );
    let shorter = RECORD.replace("float64[3] torque_nm", "float64[2] torque_nm");
    assert_record_rejected(&shorter, data, &["torque_nm"]);
}

/// Line between the message definitions of a schema.
const SEPARATOR: &str =
    "================================================================================";

#[test]
fn a_recursive_message_type_is_rejected() {
    assert_rejected("A a\n", &[0; 8], &["p/A", "is recursive"]);
    assert_rejected("A[] a\n", &[255; 4096], &["p/A", "is recursive"]);
    let indirect = format!("B b\n{SEPARATOR}\nMSG: p/B\nint8 x\nA[] a\n");
    assert_rejected(&indirect, &[255; 4096], &["is recursive"]);
}

#[test]
fn messages_that_double_with_every_level_are_rejected() {
    let mut definition = "M0 a\nM0 b\n".to_owned();
    for i in 0..30 {
        definition += &format!("{SEPARATOR}\nMSG: p/M{i}\nM{0} a\nM{0} b\n", i + 1);
    }
    definition += &format!("{SEPARATOR}\nMSG: p/M30\nint8[0] x\n");
    assert_rejected(&definition, &[0; 8], &["at a.a.a", "at most 100000 fields"]);
}

#[test]
fn more_elements_than_bytes_are_rejected() {
    let empty_elements = format!("N[9223372036854775808] n\n{SEPARATOR}\nMSG: p/N\nint8[0] x\n");
    assert_rejected(&empty_elements, &[0; 8], &["at n", "at most 100000 fields"]);
    assert_rejected(
        "int8[0] z\nint8[99999999999999999999] n\n",
        &[0; 8],
        &["cannot read"],
    );
    let sequence = format!("N[] n\n{SEPARATOR}\nMSG: p/N\nint8[0] x\n");
    assert_rejected(&sequence, &[255; 4], &["at n", "at most 100000 fields"]);
}

/// An MCAP record whose declared length exceeds the memory, in a sparse file of that length.
#[test]
fn an_mcap_record_as_long_as_the_file_is_rejected() {
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
