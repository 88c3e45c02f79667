//! Devices, FIFOs, sockets, folders and links instead of files. Nothing is written to a device: the tests assert
//! that it is rejected and still exists.
#![cfg(unix)]

use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use supple_files::{check_output, create_output, open_input, open_output, read_text, write_atomic};

fn fifo(folder: &Path) -> PathBuf {
    let path = folder.join("fifo");
    let made = Command::new("mkfifo").arg(&path).status();
    assert!(made.expect("mkfifo is there").success());
    path
}

fn assert_rejected(path: &Path, kind: ErrorKind, word: &str) {
    let errors = [
        check_output(path).expect_err("rejected"),
        open_output(path).expect_err("rejected"),
        create_output(path).expect_err("rejected"),
        write_atomic(path, b"text").expect_err("rejected"),
        open_input(path).expect_err("rejected"),
        read_text(path, 10).expect_err("rejected"),
    ];
    for error in errors {
        assert_eq!(error.kind(), kind, "{}: {error}", path.display());
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn special_files_are_rejected_and_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let fifo = fifo(folder.path());
    let socket = folder.path().join("socket");
    let _listener = UnixListener::bind(&socket).expect("bound");
    for device in ["/dev/null", "/dev/zero", "/dev/full"] {
        assert_rejected(
            Path::new(device),
            ErrorKind::InvalidInput,
            "a character device",
        );
        let kind = fs::metadata(device).expect("still there").file_type();
        assert!(kind.is_char_device(), "{device}");
    }
    assert_rejected(&fifo, ErrorKind::InvalidInput, "a FIFO");
    assert_rejected(&socket, ErrorKind::InvalidInput, "a socket");
    assert_rejected(folder.path(), ErrorKind::IsADirectory, "a folder");
    let link = folder.path().join("link");
    symlink(&fifo, &link).expect("linked");
    assert_rejected(&link, ErrorKind::InvalidInput, "a FIFO");
    let kind = |path: &Path| fs::symlink_metadata(path).expect("still there").file_type();
    assert!(kind(&fifo).is_fifo() && kind(&socket).is_socket() && kind(&link).is_symlink());
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["fifo", "link", "socket"], "and no other file");
}

#[test]
fn an_atomic_write_replaces_the_file_and_leaves_no_part() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    for text in ["longer than the other", "other"] {
        write_atomic(&path, text.as_bytes()).expect("written");
        assert_eq!(read_text(&path, 100).expect("read"), text);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

/// The target of a link is not written: another user may have created the link at the `.part` name.
#[test]
fn a_part_file_is_not_written_through_a_link() {
    let folder = tempfile::tempdir().expect("a folder");
    let (other, path) = (folder.path().join("other"), folder.path().join("file"));
    fs::write(&other, "kept").expect("written");
    symlink(&other, folder.path().join("file.part")).expect("linked");
    write_atomic(&path, b"text").expect_err("rejected");
    assert_eq!(fs::read_to_string(&other).expect("there"), "kept");
    assert!(!path.exists());
}

#[test]
fn an_oversized_file_is_rejected_before_it_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    let file = create_output(&path).expect("made");
    // Sparse file: reading it would need a terabyte of memory.
    file.set_len(1 << 40).expect("a long file");
    let error = read_text(&path, 1 << 20).expect_err("too long");
    assert_eq!(error.kind(), ErrorKind::FileTooLarge);
    assert!(error.to_string().contains("1099511627776"), "{error}");
    file.set_len(10).expect("a short file");
    assert_eq!(
        read_text(&path, 10).expect("maximum allowed length").len(),
        10
    );
}
