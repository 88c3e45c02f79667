//! Ownership and free space of the system's shared-memory objects.
//!
//! Linux allocates the pages of a shared-memory object at the first write, and sends SIGBUS if no memory is left. A
//! joining process therefore checks the free space first, and then preallocates all objects of the system.

use crate::domain::Domain;
use crate::error::IpcError;
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, open, statvfs};
use rustix::io::Errno;
use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Folder of the named shared-memory objects.
const FOLDER: &str = "/dev/shm";
/// Management data of each port and service, rounded up \[bytes\].
const MANAGEMENT_BYTES: u64 = 512 * 1024;

/// Objects whose names have this system's prefix.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct SharedObjects {
    /// Objects of this user.
    pub owned: Vec<PathBuf>,
    /// Objects of other users, with the user id. This process never opens or removes them.
    pub owned_by_others: Vec<(PathBuf, u32)>,
}

/// Lists the objects of a system.
pub(crate) fn objects(domain: &Domain) -> io::Result<SharedObjects> {
    let user = rustix::process::getuid().as_raw();
    partition_by_owner(Path::new(FOLDER), &domain.object_prefix(), user)
}

fn partition_by_owner(folder: &Path, begin: &str, user: u32) -> io::Result<SharedObjects> {
    let mut objects = SharedObjects::default();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        if !name.as_encoded_bytes().starts_with(begin.as_bytes()) {
            continue;
        }
        let about = match entry.metadata() {
            Ok(about) => about,
            // The owner of the object has just removed it.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error),
        };
        if about.uid() == user && about.is_file() {
            objects.owned.push(entry.path());
        } else {
            objects.owned_by_others.push((entry.path(), about.uid()));
        }
    }
    Ok(objects)
}

/// Fails if this process has mapped an object that belongs to another user.
pub(crate) fn refuse_foreign(domain: &Domain) -> Result<(), IpcError> {
    let found = objects(domain).map_err(|error| unreadable(&error))?;
    if found.owned_by_others.is_empty() {
        return Ok(());
    }
    let maps = fs::read_to_string("/proc/self/maps").map_err(|error| unreadable(&error))?;
    let is_mapped = |object: &Path| {
        maps.lines()
            .any(|line| line.ends_with(&*object.to_string_lossy()))
    };
    match found
        .owned_by_others
        .into_iter()
        .find(|(object, _)| is_mapped(object))
    {
        Some((object, owner)) => Err(foreign(domain, object, owner)),
        None => Ok(()),
    }
}

/// Replaces the error by [`IpcError::Foreign`] if another user's object with a name of this system exists.
pub(crate) fn add_foreign_object_cause(domain: &Domain, error: IpcError) -> IpcError {
    let IpcError::Service { .. } = error else {
        return error;
    };
    match objects(domain).map(|found| found.owned_by_others.into_iter().next()) {
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

/// Fails if the free space is less than `messages_bytes` plus the management data.
pub(crate) fn check_free_space(messages_bytes: u64) -> Result<(), IpcError> {
    let about = statvfs(FOLDER).map_err(|error| unreadable(&error.into()))?;
    // A file system without a size limit reports zero blocks.
    let free_bytes = match about.f_blocks {
        0 => u64::MAX,
        _ => about.f_bavail.saturating_mul(about.f_frsize),
    };
    require_bytes(messages_bytes + MANAGEMENT_BYTES, free_bytes)
}

fn require_bytes(needed_bytes: u64, free_bytes: u64) -> Result<(), IpcError> {
    if free_bytes >= needed_bytes {
        return Ok(());
    }
    Err(IpcError::SharedMemoryFull {
        needed_bytes,
        free_bytes,
    })
}

/// Preallocates all pages of every object of the system.
pub(crate) fn reserve(domain: &Domain) -> Result<(), IpcError> {
    for object in objects(domain).map_err(|error| unreadable(&error))?.owned {
        let Ok(file) = open(
            &object,
            OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW,
            Mode::empty(),
        ) else {
            // The creator of the object has just removed it, or is still creating it and will preallocate it.
            continue;
        };
        let about = rustix::fs::fstat(&file).map_err(|error| unreadable(&error.into()))?;
        let bytes = u64::try_from(about.st_size).unwrap_or_default();
        let given_bytes = u64::try_from(about.st_blocks).unwrap_or_default() * 512;
        if given_bytes >= bytes {
            continue;
        }
        match fallocate(&file, FallocateFlags::empty(), 0, bytes) {
            // A file system without fallocate needs no preallocation.
            Ok(()) | Err(Errno::OPNOTSUPP | Errno::NOSYS) => {}
            Err(Errno::NOSPC | Errno::DQUOT) => require_bytes(bytes, given_bytes)?,
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
    fn objects_are_partitioned_by_owner() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("mine_1"), b"").expect("written");
        fs::write(path("other"), b"").expect("written");
        fs::create_dir(path("mine_folder")).expect("made");
        std::os::unix::fs::symlink("/etc/hostname", path("mine_link")).expect("made");
        let me = rustix::process::getuid().as_raw();
        let found = partition_by_owner(folder.path(), "mine_", me).expect("read");
        assert_eq!(found.owned, [path("mine_1")]);
        assert_eq!(found.owned_by_others.len(), 2);
        // Seen from another user, all three objects belong to others.
        let found = partition_by_owner(folder.path(), "mine_", me + 1).expect("read");
        assert_eq!((found.owned.len(), found.owned_by_others.len()), (0, 3));
        assert!(found.owned_by_others.contains(&(path("mine_1"), me)));
    }

    #[test]
    fn insufficient_space_is_an_error_with_sizes_and_remedy() {
        assert!(require_bytes(1000, 1000).is_ok());
        let text = require_bytes(44_000_001, 3_000_000)
            .expect_err("too little")
            .to_string();
        for part in ["/dev/shm", "45 MB", "3 MB", "size="] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
