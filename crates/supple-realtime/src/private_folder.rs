//! Folders that only their owner can enter, and where the processes of a user find them.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Permissions of such a folder.
const OWNER_ONLY: u32 = 0o700;
/// Permissions of all other users.
const OTHERS: u32 = 0o077;

/// Why a folder is not private to this user. The message continues one that names the folder.
#[derive(Debug, thiserror::Error)]
pub enum PrivateFolderError {
    /// It does not exist and cannot be created.
    #[error("cannot be created: {0}")]
    Create(io::Error),
    /// Its owner and its permissions cannot be read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// Something else has its name; links are not followed.
    #[error("is a link or no folder")]
    NoFolder,
    /// It belongs to another user.
    #[error("belongs to user {owner}, you are {user}")]
    OtherUser {
        /// Id of the owner.
        owner: u32,
        /// Id of this user.
        user: u32,
    },
    /// Other users have permissions.
    #[error("has mode {mode:o}, open to others")]
    OpenToOthers {
        /// The permissions.
        mode: u32,
    },
}

/// Creates a folder that only its owner can enter, and missing parents alike; one that exists stays as it is.
///
/// # Errors
/// Of the operating system.
pub fn create_private_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new()
        .recursive(true)
        .mode(OWNER_ONLY)
        .create(path)
}

/// Creates the folder, or checks that it is a folder, that it belongs to this user and is closed to all others.
///
/// # Errors
/// [`PrivateFolderError`].
pub fn open_private_folder(path: &Path) -> Result<(), PrivateFolderError> {
    create_private_folder(path).map_err(PrivateFolderError::Create)?;
    let found = path.symlink_metadata().map_err(PrivateFolderError::Read)?;
    let user = rustix::process::geteuid().as_raw();
    if !found.is_dir() {
        return Err(PrivateFolderError::NoFolder);
    }
    if found.uid() != user {
        let owner = found.uid();
        return Err(PrivateFolderError::OtherUser { owner, user });
    }
    if found.mode() & OTHERS != 0 {
        let mode = found.mode() & 0o777;
        return Err(PrivateFolderError::OpenToOthers { mode });
    }
    Ok(())
}

/// Path for the sockets and locks of this user's processes: `NAME` under `$XDG_RUNTIME_DIR`, or `/tmp/NAME-UID` if the
/// variable is not set. It may not exist.
pub fn runtime_folder(name: &str) -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(runtime) if !runtime.is_empty() => PathBuf::from(runtime).join(name),
        _ => {
            let user = rustix::process::geteuid().as_raw();
            PathBuf::from(format!("/tmp/{name}-{user}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};

    #[test]
    fn a_new_folder_and_its_parents_are_closed_to_others() {
        let above = tempfile::tempdir().expect("a folder");
        let parent = above.path().join("parent");
        let folder = parent.join("folder");
        open_private_folder(&folder).expect("created");
        open_private_folder(&folder).expect("opened again");
        for path in [parent, folder] {
            let mode = fs::metadata(path).expect("there").mode();
            assert_eq!(mode & 0o777, OWNER_ONLY);
        }
    }

    #[test]
    fn a_folder_open_to_others_is_refused_and_stays_as_it_is() {
        let folder = tempfile::tempdir().expect("a folder");
        for mode in [0o710, 0o704, 0o755, 0o777] {
            fs::set_permissions(folder.path(), PermissionsExt::from_mode(mode)).expect("changed");
            let error = open_private_folder(folder.path()).expect_err("open to others");
            assert!(error.to_string().contains(&format!("{mode:o}")), "{error}");
            let found = fs::metadata(folder.path()).expect("there").mode();
            assert_eq!(found & 0o777, mode);
        }
    }

    #[test]
    fn links_and_files_are_refused() {
        let above = tempfile::tempdir().expect("a folder");
        let at = |name: &str| above.path().join(name);
        open_private_folder(&at("folder")).expect("created");
        symlink(at("folder"), at("link")).expect("a link");
        fs::write(at("file"), "").expect("written");
        let link = open_private_folder(&at("link")).expect_err("a link");
        assert!(matches!(link, PrivateFolderError::NoFolder), "{link}");
        let file = open_private_folder(&at("file")).expect_err("a file");
        assert!(matches!(file, PrivateFolderError::Create(_)), "{file}");
    }

    #[test]
    fn a_folder_of_another_user_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let other = 65_534;
        if std::os::unix::fs::chown(folder.path(), Some(other), None).is_err() {
            println!("skipped: no folder can be given to another user");
            return;
        }
        let error = open_private_folder(folder.path()).expect_err("of another user");
        let PrivateFolderError::OtherUser { owner, user } = error else {
            panic!("{error}");
        };
        assert!(owner == other && user != other);
    }
}
