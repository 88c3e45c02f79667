//! An incomplete file never has the name of a complete one, and every failure names file and cause.

use crate::common;
use std::fs;
use std::path::Path;
use supple_log::{Extras, LogError, Writer};

fn writer(path: &Path) -> Result<Writer<{ common::N }>, LogError> {
    let (description, config) = (common::description(), common::config());
    Writer::create(path, &description, &config, &common::run_info())
}

#[test]
fn a_log_has_its_final_name_only_when_it_is_complete() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let part = folder.path().join("run.mcap.part");
    fs::write(&path, "an older log").expect("written");

    let dropped = writer(&path).expect("created");
    assert!(part.exists());
    drop(dropped);
    assert!(part.exists());
    assert_eq!(fs::read(&path).expect("read"), b"an older log");

    common::write(&path, 10).expect("written over both");
    assert!(!part.exists());
    assert!(fs::read(&path).expect("read").starts_with(mcap::MAGIC));
}

/// No byte of an empty file is valid, and there is nothing to recover.
#[test]
fn an_empty_file_is_reported_as_empty() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("empty.mcap");
    fs::write(&path, "").expect("written");
    let Err(error) = supple_log::Reader::open(&path) else {
        panic!("nothing was read");
    };
    let words = error.to_string();
    assert!(
        words.contains("empty.mcap is empty") && !words.contains("bytes"),
        "{words}"
    );
    // Of a file that ends within the first eight bytes no more are valid than there are.
    fs::write(&path, &mcap::MAGIC[..3]).expect("written");
    let Err(error) = supple_log::Reader::open(&path) else {
        panic!("nothing was read");
    };
    let words = error.to_string();
    assert!(words.contains("after 3 valid bytes"), "{words}");
}

#[test]
fn a_second_writer_of_the_same_name_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let first = writer(&path).expect("created");
    let Err(error) = writer(&path) else {
        panic!("two logs are written into one file");
    };
    assert!(matches!(error, LogError::Busy { .. }), "{error}");
    assert!(error.to_string().contains("run.mcap.part"));
    first.finish().expect("undisturbed");
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "").expect("written");
    for path in [
        folder.path().join("missing/run.mcap"),
        file.join("run.mcap"),
        "/proc/run.mcap".into(),
    ] {
        let Err(error) = writer(&path) else {
            panic!("{} was created", path.display());
        };
        assert!(matches!(error, LogError::Create { .. }), "{error}");
        assert!(error.to_string().contains("run.mcap"), "{error}");
        assert!(error.to_string().contains("choose a folder"), "{error}");
    }
    assert!(matches!(
        writer(folder.path()),
        Err(LogError::Create { .. })
    ));
}

/// Devices, FIFOs and folders at the final or temporary name of the log are rejected before anything is written,
/// and are not changed.
#[cfg(unix)]
#[test]
fn special_files_are_not_replaced() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    for fifo in ["fifo", "a.mcap.part"] {
        let made = std::process::Command::new("mkfifo").arg(at(fifo)).status();
        assert!(made.expect("mkfifo is there").success());
    }
    symlink("/dev/null", at("b.mcap.part")).expect("linked");
    symlink("/dev/null", at("c.mcap")).expect("linked");
    fs::create_dir(at("d.mcap.part")).expect("made");
    for (path, word) in [
        (at("fifo"), "a FIFO"),
        (at("a.mcap"), "a FIFO"),
        (at("b.mcap"), "a character device"),
        (at("c.mcap"), "a character device"),
        (at("d.mcap"), "a folder"),
        ("/dev/null".into(), "a character device"),
        (folder.path().into(), "a folder"),
    ] {
        let Err(error) = writer(&path) else {
            panic!("{} was created", path.display());
        };
        assert!(matches!(error, LogError::Create { .. }), "{error}");
        for word in [word, "regular file"] {
            assert!(error.to_string().contains(word), "{error}");
        }
    }
    let device = fs::metadata("/dev/null").expect("still there").file_type();
    assert!(device.is_char_device());
    let link = fs::symlink_metadata(at("c.mcap")).expect("still there");
    assert!(link.is_symlink());
    assert!(!at("a.mcap").exists() && !at("b.mcap").exists() && !at("d.mcap").exists());
}

/// The disk fills up during a run: after the first failed write every write fails, and so does finishing. A limit on
/// the file size, for a child process of this test only, simulates the full disk.
#[cfg(unix)]
#[test]
fn all_writes_fail_after_the_disk_is_full() {
    const FILE: &str = "SUPPLE_LOG_LIMITED_FILE";
    if let Some(path) = std::env::var_os(FILE) {
        return write_until_full(Path::new(&path));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let this = std::env::current_exe().expect("this test");
    let child = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 300; exec \"$@\"", "sh"])
        .arg(this)
        .args([
            "--exact",
            "incomplete_files::all_writes_fail_after_the_disk_is_full",
            "--nocapture",
        ])
        .env(FILE, &path)
        .status();
    assert!(child.expect("a shell").success());
    assert!(folder.path().join("run.mcap.part").exists());
    assert!(!path.exists());
}

fn write_until_full(path: &Path) {
    let mut writer = writer(path).expect("there is room for the beginning");
    let (mut written, mut failures) = (0, Vec::new());
    common::run(common::STEPS, |cycle| {
        let extras = Extras::default();
        match writer.write(cycle.time_ns, &cycle.input, &cycle.output, &extras) {
            Ok(()) if failures.is_empty() => written += 1,
            Ok(()) => panic!("a write after a failure was accepted"),
            Err(error) => failures.push(error.to_string()),
        }
    });
    assert!(written > 250, "{written} written");
    assert!(failures[0].contains("run.mcap.part") && failures[0].contains("File too large"));
    assert!(writer.finish().is_err());
}
