//! Devices, FIFOs, sockets, folders and links in the place of files. Nothing is written to a device: what is
//! asserted is that it is refused, and still there.
#![cfg(unix)]

use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use supple_files::{check_output, create_output, open_input, open_output, read_text, write_whole};

fn fifo(folder: &Path) -> PathBuf {
    let path = folder.join("fifo");
    let made = Command::new("mkfifo").arg(&path).status();
    assert!(made.expect("mkfifo is there").success());
    path
}

fn refused(path: &Path, kind: ErrorKind, word: &str) {
    let errors = [
        check_output(path).expect_err("refused"),
        open_output(path).expect_err("refused"),
        create_output(path).expect_err("refused"),
        write_whole(path, b"text").expect_err("refused"),
        open_input(path).expect_err("refused"),
        read_text(path, 10).expect_err("refused"),
    ];
    for error in errors {
        assert_eq!(error.kind(), kind, "{}: {error}", path.display());
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn what_is_no_regular_file_is_refused_and_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let fifo = fifo(folder.path());
    let socket = folder.path().join("socket");
    let _listener = UnixListener::bind(&socket).expect("bound");
    for device in ["/dev/null", "/dev/zero", "/dev/full"] {
        refused(
            Path::new(device),
            ErrorKind::InvalidInput,
            "a character device",
        );
        let kind = fs::metadata(device).expect("still there").file_type();
        assert!(kind.is_char_device(), "{device}");
    }
    refused(&fifo, ErrorKind::InvalidInput, "a FIFO");
    refused(&socket, ErrorKind::InvalidInput, "a socket");
    refused(folder.path(), ErrorKind::IsADirectory, "a folder");
    let link = folder.path().join("link");
    symlink(&fifo, &link).expect("linked");
    refused(&link, ErrorKind::InvalidInput, "a FIFO");
    let kind = |path: &Path| fs::symlink_metadata(path).expect("still there").file_type();
    assert!(kind(&fifo).is_fifo() && kind(&socket).is_socket() && kind(&link).is_symlink());
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["fifo", "link", "socket"], "and nothing beside it");
}

#[test]
fn a_whole_file_replaces_one_and_leaves_no_part() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    for text in ["longer than the other", "other"] {
        write_whole(&path, text.as_bytes()).expect("written");
        assert_eq!(read_text(&path, 100).expect("read"), text);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

/// What a link leads to is not written: the name beside the file may have been put there by somebody else.
#[test]
fn a_part_is_not_written_through_a_link() {
    let folder = tempfile::tempdir().expect("a folder");
    let (other, path) = (folder.path().join("other"), folder.path().join("file"));
    fs::write(&other, "kept").expect("written");
    symlink(&other, folder.path().join("file.part")).expect("linked");
    write_whole(&path, b"text").expect_err("refused");
    assert_eq!(fs::read_to_string(&other).expect("there"), "kept");
    assert!(!path.exists());
}

#[test]
fn a_file_that_is_too_long_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    let file = create_output(&path).expect("made");
    // Sparse: to read it would take a terabyte of memory.
    file.set_len(1 << 40).expect("a long file");
    let error = read_text(&path, 1 << 20).expect_err("too long");
    assert_eq!(error.kind(), ErrorKind::FileTooLarge);
    assert!(error.to_string().contains("1099511627776"), "{error}");
    file.set_len(10).expect("a short file");
    assert_eq!(read_text(&path, 10).expect("as long as may be").len(), 10);
}
