//! Reads and writes user-named paths safely.
//!
//! A path can be a device, a FIFO, a socket or a folder. Opening one can block forever, reading one can exhaust
//! the memory, and renaming a finished file over one replaces it: `--log /dev/null` as root would remove
//! `/dev/null`. All functions reject special files before they read or write anything. Every file that a user
//! has named is opened through this crate.

#![forbid(unsafe_code)]

use std::borrow::Cow;
use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io::{Error, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// Rejects a path that exists and is not a regular file (device, FIFO, socket, folder), also behind a symbolic
/// link. A path that does not exist is accepted.
///
/// # Errors
/// [`ErrorKind::IsADirectory`] for a folder, [`ErrorKind::InvalidInput`] for anything else that is not a
/// regular file, with its kind; the error of the operating system if the path cannot be examined.
pub fn check_output(path: &Path) -> Result<(), Error> {
    match path.metadata() {
        Ok(found) => expect_regular(&found),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

/// Opens a file for writing and creates it if necessary; its content stays until the caller truncates it. Symbolic
/// links are not followed.
///
/// # Errors
/// As [`check_output`]; errors of the operating system.
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

/// Opens an empty file for writing and creates it if necessary. Symbolic links are not followed.
///
/// # Errors
/// As [`open_output`].
pub fn create_output(path: &Path) -> Result<File, Error> {
    let file = open_output(path)?;
    file.set_len(0)?;
    Ok(file)
}

/// Writes a file atomically: writes `<name>.part`, syncs it to disk, then renames it.
///
/// # Errors
/// As [`open_output`]; the path is then unchanged, and no `.part` file is left.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    check_output(path)?;
    let part = with_suffix(path, ".part");
    let mut file = create_output(&part)?;
    let written = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        // The caller needs the earlier error.
        let _ = std::fs::remove_file(&part);
    }
    written
}

/// Opens a regular file for reading; returns it with its length in bytes. A FIFO without a writer does not block.
///
/// # Errors
/// As [`check_output`]; errors of the operating system, [`ErrorKind::NotFound`] if the path does not exist.
pub fn open_input(path: &Path) -> Result<(File, u64), Error> {
    // Check before opening: opening a device can have side effects.
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

/// Reads the text of a regular file of at most `max_bytes`.
///
/// # Errors
/// As [`open_input`]; [`ErrorKind::FileTooLarge`] for a longer file, before it is read;
/// [`ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64) -> Result<String, Error> {
    let (file, bytes) = open_input(path)?;
    let too_large = |bytes: u64| {
        let message = format!("it has {bytes} bytes, at most {max_bytes} are read");
        Error::new(ErrorKind::FileTooLarge, message)
    };
    if bytes > max_bytes {
        return Err(too_large(bytes));
    }
    let mut text = String::new();
    // The file may grow during reading.
    let read = file.take(max_bytes + 1).read_to_string(&mut text)? as u64;
    match read > max_bytes {
        true => Err(too_large(read)),
        false => Ok(text),
    }
}

/// Characters of a value that a message quotes.
pub const EXCERPT_CHARACTERS: usize = 80;

/// Returns a value of a file for quotation in a message: at most its first [`EXCERPT_CHARACTERS`] characters, then its length.
pub fn excerpt(value: &str) -> Cow<'_, str> {
    match value.char_indices().nth(EXCERPT_CHARACTERS) {
        None => value.into(),
        Some((end, _)) => {
            let characters = value.chars().count();
            format!("{}... ({characters} characters)", &value[..end]).into()
        }
    }
}

/// Returns `path` with `suffix` appended to its file name: `run.mcap.part`.
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
