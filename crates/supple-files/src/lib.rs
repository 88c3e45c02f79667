//! Regular files: what a program reads and writes by a name that somebody gave it.
//!
//! A name can lead to a device, a FIFO, a socket or a folder. Opening one can block for ever, reading one can
//! fill all memory, and renaming a finished file over one replaces it: `--log /dev/null` as root would leave a
//! machine without `/dev/null`. Everything here refuses what is not a regular file, before anything is read
//! or written. Whoever opens a file that a user has named does it through this crate.

#![forbid(unsafe_code)]

use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io::{Error, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// Refuses a name at which something stands that a file must not replace: a device, a FIFO, a socket or a
/// folder, also where a link leads to it. A name at which nothing stands is free.
///
/// # Errors
/// [`ErrorKind::IsADirectory`] for a folder, [`ErrorKind::InvalidInput`] for anything else that is not a
/// regular file, with what it is; what the system says where it cannot be looked at.
pub fn check_output(path: &Path) -> Result<(), Error> {
    match path.metadata() {
        Ok(found) => expect_regular(&found),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

/// Opens a file to write it, made if need be; what is in it stays until the caller truncates it. A link is
/// not followed.
///
/// # Errors
/// As [`check_output`]; what the system says.
pub fn open_output(path: &Path) -> Result<File, Error> {
    check_output(path)?;
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        libc::O_NONBLOCK | libc::O_NOFOLLOW,
    );
    let file = options.open(path)?;
    expect_regular(&file.metadata()?)?;
    Ok(file)
}

/// Opens an empty file to write it, made if need be. A link is not followed.
///
/// # Errors
/// As [`open_output`].
pub fn create_output(path: &Path) -> Result<File, Error> {
    let file = open_output(path)?;
    file.set_len(0)?;
    Ok(file)
}

/// Writes a whole file: beside its place first, as `<name>.part`, then on the disk, then under its name.
///
/// # Errors
/// As [`open_output`]; then nothing stands at the name that was not there before, and no `.part`.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    check_output(path)?;
    let part = with_suffix(path, ".part");
    let mut file = create_output(&part)?;
    let written = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        // The error that led here is the one to report.
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Opens a regular file to read it, with its length in bytes. A FIFO without a writer does not block.
///
/// # Errors
/// As [`check_output`]; what the system says, [`ErrorKind::NotFound`] where nothing is there.
pub fn open_input(path: &Path) -> Result<(File, u64), Error> {
    // Before it is opened: opening a device can act on it.
    expect_regular(&path.metadata()?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    let file = options.open(path)?;
    let found = file.metadata()?;
    expect_regular(&found)?;
    Ok((file, found.len()))
}

/// The text of a regular file of at most `most_bytes`.
///
/// # Errors
/// As [`open_input`]; [`ErrorKind::FileTooLarge`] for a longer file, before it is read;
/// [`ErrorKind::InvalidData`] where it is not UTF-8.
pub fn read_text(path: &Path, most_bytes: u64) -> Result<String, Error> {
    let (file, bytes) = open_input(path)?;
    let too_large = |bytes: u64| {
        let message = format!("it has {bytes} bytes, at most {most_bytes} are read");
        Error::new(ErrorKind::FileTooLarge, message)
    };
    if bytes > most_bytes {
        return Err(too_large(bytes));
    }
    let mut text = String::new();
    // It may grow while it is read.
    let read = file.take(most_bytes + 1).read_to_string(&mut text)? as u64;
    match read > most_bytes {
        true => Err(too_large(read)),
        false => Ok(text),
    }
}

/// `path` with `suffix` after its last name: `run.mcap.part`.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn expect_regular(found: &Metadata) -> Result<(), Error> {
    let kind = found.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let error = match kind.is_dir() {
        true => ErrorKind::IsADirectory,
        false => ErrorKind::InvalidInput,
    };
    let message = format!("it is {}, not a regular file", name(kind));
    Err(Error::new(error, message))
}

fn name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_char_device() {
            return "a character device";
        }
        if kind.is_block_device() {
            return "a block device";
        }
        if kind.is_fifo() {
            return "a FIFO";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    match kind.is_dir() {
        true => "a folder",
        false => "something else",
    }
}
