//! Owner-only folders, and the path at which the processes of a user find them.

use std::fs::DirBuilder;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Permissions of such a folder.
const OWNER_ONLY: u32 = 0o700;
/// Permissions of all other users.
const OTHERS: u32 = 0o077;

/// Reason why a folder is not accessible only to this user. The message is the predicate of a sentence whose subject is the
/// folder.
#[derive(Debug, thiserror::Error)]
pub enum PrivateFolderError {
    /// The folder does not exist and cannot be created.
    #[error("cannot be created: {0}")]
    Create(io::Error),
    /// The owner and the permissions of the folder cannot be read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// The path is not a folder; symbolic links are not followed.
    #[error("is a link or no folder")]
    NoFolder,
    /// The folder belongs to another user.
    #[error("belongs to user {owner}, you are {user}")]
    OtherUser {
        /// Id of the owner.
        owner: u32,
        /// Id of this user.
        user: u32,
    },
    /// Other users have permissions on the folder.
    #[error("has mode {mode:o}, open to others")]
    OpenToOthers {
        /// The permissions.
        mode: u32,
    },
}

/// Creates a folder, and its missing parents, that only the owner can access. An existing folder is not changed.
///
/// # Errors
/// If the operating system refuses to create a folder.
pub fn create_private_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new()
        .recursive(true)
        .mode(OWNER_ONLY)
        .create(path)
}

/// Creates the folder; if the path exists, checks that it is a folder of this user that no other user can access.
///
/// # Errors
/// [`PrivateFolderError`] with the reason.
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

/// Returns the path for the sockets and locks of this user's processes: `NAME` under `$XDG_RUNTIME_DIR`, or `/tmp/NAME-UID` if the
/// variable is not set. The folder may not exist.
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
            println!("skipped: this user may not change the owner of a folder");
            return;
        }
        let error = open_private_folder(folder.path()).expect_err("of another user");
        let PrivateFolderError::OtherUser { owner, user } = error else {
            panic!("{error}");
        };
        assert!(owner == other && user != other);
    }
}
