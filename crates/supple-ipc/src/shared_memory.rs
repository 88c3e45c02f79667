//! The system's objects in shared memory: whose they are, and that there is room for them.
//!
//! Linux gives memory to an object when it is written first, and ends a process by SIGBUS where there is none left. So
//! whoever joins looks for room before, and has everything that is there given its memory after.

use crate::domain::Domain;
use crate::error::IpcError;
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, open, statvfs};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Where Linux keeps shared memory by its name.
const FOLDER: &str = "/dev/shm";
/// What every port and every service takes besides its messages, rounded up \[bytes\].
const BOOKS_BYTES: u64 = 512 * 1024;

/// Objects whose names begin as this system's do.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Objects {
    /// Those of this user.
    pub ours: Vec<PathBuf>,
    /// Those of others, with the user's number: never opened, never removed.
    pub of_others: Vec<(PathBuf, u32)>,
}

/// The objects of a system.
pub(crate) fn objects(domain: &Domain) -> io::Result<Objects> {
    let user = rustix::process::getuid().as_raw();
    sorted(Path::new(FOLDER), &domain.objects(), user)
}

fn sorted(folder: &Path, begin: &str, user: u32) -> io::Result<Objects> {
    let mut objects = Objects::default();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        if !name.as_encoded_bytes().starts_with(begin.as_bytes()) {
            continue;
        }
        let about = match entry.metadata() {
            Ok(about) => about,
            // Its owner has just removed it.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error),
        };
        if about.uid() == user && about.is_file() {
            objects.ours.push(entry.path());
        } else {
            objects.of_others.push((entry.path(), about.uid()));
        }
    }
    Ok(objects)
}

/// Refuses where another user's object has been taken for one of this system's.
pub(crate) fn refuse_foreign(domain: &Domain) -> Result<(), IpcError> {
    let found = objects(domain).map_err(|error| unreadable(&error))?;
    if found.of_others.is_empty() {
        return Ok(());
    }
    let maps = fs::read_to_string("/proc/self/maps").map_err(|error| unreadable(&error))?;
    let is_mapped = |object: &Path| {
        maps.lines()
            .any(|line| line.ends_with(&*object.to_string_lossy()))
    };
    match found
        .of_others
        .into_iter()
        .find(|(object, _)| is_mapped(object))
    {
        Some((object, owner)) => Err(foreign(domain, object, owner)),
        None => Ok(()),
    }
}

/// Says that another user's object may be the cause, where there is one.
pub(crate) fn explained(domain: &Domain, error: IpcError) -> IpcError {
    let IpcError::Service { .. } = error else {
        return error;
    };
    match objects(domain).map(|found| found.of_others.into_iter().next()) {
        Ok(Some((object, owner))) => foreign(domain, object, owner),
        _ => error,
    }
}

fn foreign(domain: &Domain, object: PathBuf, owner: u32) -> IpcError {
    IpcError::Foreign {
        object,
        owner,
        prefix: domain.prefix().to_owned(),
    }
}

/// Refuses where there is no room for ports whose messages take so much \[bytes\].
pub(crate) fn expect_room(messages_bytes: u64) -> Result<(), IpcError> {
    let about = statvfs(FOLDER).map_err(|error| unreadable(&error.into()))?;
    // A folder without a limit has no blocks.
    let free_bytes = match about.f_blocks {
        0 => u64::MAX,
        _ => about.f_bavail.saturating_mul(about.f_frsize),
    };
    room(messages_bytes + BOOKS_BYTES, free_bytes)
}

fn room(wanted_bytes: u64, free_bytes: u64) -> Result<(), IpcError> {
    if free_bytes >= wanted_bytes {
        return Ok(());
    }
    Err(IpcError::NoRoom {
        wanted_bytes,
        free_bytes,
    })
}

/// Has every object of the system given all of its memory.
pub(crate) fn reserve(domain: &Domain) -> Result<(), IpcError> {
    for object in objects(domain).map_err(|error| unreadable(&error))?.ours {
        let Ok(file) = open(
            &object,
            OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW,
            Mode::empty(),
        ) else {
            // Its maker has just removed it, or still makes it and reserves it then.
            continue;
        };
        let about = rustix::fs::fstat(&file).map_err(|error| unreadable(&error.into()))?;
        let bytes = u64::try_from(about.st_size).unwrap_or_default();
        let given_bytes = u64::try_from(about.st_blocks).unwrap_or_default() * 512;
        if given_bytes >= bytes {
            continue;
        }
        match fallocate(&file, FallocateFlags::empty(), 0, bytes) {
            // What the folder's kind cannot reserve, it need not.
            Ok(()) | Err(Errno::OPNOTSUPP | Errno::NOSYS) => {}
            Err(Errno::NOSPC | Errno::DQUOT) => room(bytes, given_bytes)?,
            Err(error) => return Err(unreadable(&error.into())),
        }
    }
    Ok(())
}

fn unreadable(cause: &io::Error) -> IpcError {
    IpcError::Service {
        service: FOLDER.to_owned(),
        cause: cause.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_of_others_and_what_is_no_file_are_kept_apart() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("mine_1"), b"").expect("written");
        fs::write(path("other"), b"").expect("written");
        fs::create_dir(path("mine_folder")).expect("made");
        std::os::unix::fs::symlink("/etc/hostname", path("mine_link")).expect("made");
        let me = rustix::process::getuid().as_raw();
        let found = sorted(folder.path(), "mine_", me).expect("read");
        assert_eq!(found.ours, [path("mine_1")]);
        assert_eq!(found.of_others.len(), 2);
        // Seen by another user, all of it is somebody else's.
        let found = sorted(folder.path(), "mine_", me + 1).expect("read");
        assert_eq!((found.ours.len(), found.of_others.len()), (0, 3));
        assert!(found.of_others.contains(&(path("mine_1"), me)));
    }

    #[test]
    fn too_little_room_is_refused_with_the_sizes_and_the_remedy() {
        assert!(room(1000, 1000).is_ok());
        let words = room(44_000_001, 3_000_000)
            .expect_err("too little")
            .to_string();
        for part in ["/dev/shm", "45 MB", "3 MB", "size="] {
            assert!(words.contains(part), "{part}: {words}");
        }
    }
}
