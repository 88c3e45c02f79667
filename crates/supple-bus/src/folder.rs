//! A folder for Unix sockets that only its owner can access: the folder has mode 0700, each socket 0600.

use crate::error::BusError;
use rustix::fs::{Mode, chmod};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use supple_realtime::{PrivateFolderError, open_private_folder};

/// Maximum length of a Unix socket's path.
const MAX_PATH_BYTES: usize = 107;

/// An existing folder that belongs to this user and that no other user can access.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnerFolder(PathBuf);

impl OwnerFolder {
    /// Creates the folder, or uses an existing one if it belongs to this user and no other user can access it.
    ///
    /// # Errors
    /// [`BusError::Folder`] if it cannot be created, belongs to another user, is a link, or if other users can access
    /// it.
    pub fn open(path: impl Into<PathBuf>) -> Result<OwnerFolder, BusError> {
        let path = path.into();
        match open_private_folder(&path) {
            Ok(()) => Ok(OwnerFolder(path)),
            Err(error) => Err(BusError::Folder {
                path,
                remedy: match error {
                    PrivateFolderError::Create(_) => "choose a folder that you may write to",
                    PrivateFolderError::Read(_) | PrivateFolderError::OtherUser { .. } => {
                        "choose a folder of your own"
                    }
                    PrivateFolderError::NoFolder => {
                        "name the folder itself: symbolic links are not followed"
                    }
                    PrivateFolderError::OpenToOthers { .. } => {
                        "restrict it to yourself with chmod 700"
                    }
                },
                problem: error.to_string(),
            }),
        }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Binds a datagram socket in the folder, accessible only to the owner. Replaces a file of this name unless it
    /// is a socket that a process has open.
    ///
    /// # Errors
    /// [`BusError::SocketInUse`] if a process has it open; [`BusError::Folder`] if it cannot be created.
    pub fn bind(&self, name: &str) -> Result<UnixDatagram, BusError> {
        let path = self.0.join(name);
        let folder_error = |problem: String, remedy| BusError::Folder {
            path: path.clone(),
            problem,
            remedy,
        };
        if path.as_os_str().len() > MAX_PATH_BYTES {
            return Err(folder_error(
                format!("has a path of {} bytes", path.as_os_str().len()),
                "a socket allows at most 107: choose a folder with a shorter path",
            ));
        }
        if is_open(&path) {
            return Err(BusError::SocketInUse { path });
        }
        match std::fs::remove_file(&path) {
            Ok(()) => {}
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => {
                return Err(folder_error(
                    format!("cannot be replaced: {error}"),
                    "delete it",
                ));
            }
        }
        let bound = UnixDatagram::bind(&path);
        let socket = bound.map_err(|error| {
            folder_error(
                format!("cannot be created: {error}"),
                "choose another folder",
            )
        })?;
        chmod(&path, Mode::RUSR | Mode::WUSR)
            .map_err(BusError::io("restricting the permissions of a socket"))?;
        Ok(socket)
    }
}

/// Whether a process has the socket at this path open.
fn is_open(path: &Path) -> bool {
    UnixDatagram::unbound().is_ok_and(|probe| probe.connect(path).is_ok())
}
